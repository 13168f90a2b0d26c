#include "measure.h"

#include <fstream>
#include <numbers>
#include <sstream>

namespace rayrep::tool {

Measurement measured(const Options& options, const Mesh* mesh, const std::string& mesh_name) {
  Measurement result;
  result.path = options.input.string();
  result.printed = read_printed(options.input, options.printed);
  const Printed& printed = result.printed;
  result.density_told = !options.density_given && printed.density_g_cm3.has_value();
  const Print& print = options.command == Command::verify ? print_of(options.spec) : options.print;
  result.density_g_cm3 = options.density_given ? print.density_g_cm3 : printed.likely_density_g_cm3().value_or(print.density_g_cm3);
  Moments s = printed.body();
  if (!(s[M1] > 0))
    throw Error(ErrorCode::input, result.path +
                                      ": nothing of it becomes part of the body: all that is extruded is skirt, brim, "
                                      "support, wipe tower, or start and end code.");
  if (mesh) {
    PlacePrintOptions placing = options.placing;
    placing.print_direction = print.direction.value_or(placing.print_direction);
    placing.has_holes = print.drains.wanted();
    placing.turned_rad = options.turned_deg * std::numbers::pi / 180;
    result.placed = place_print(printed, *mesh, placing);
    result.mesh = mesh_name;
    s = result.placed->s;
  }
  if (options.measured_mass_g) {
    result.density_told = false;
    result.density_g_cm3 = *options.measured_mass_g / (1e-3 * s[M1]);
  }
  result.body = mass_properties(s, result.density_g_cm3);
  return result;
}

Delivery delivery_of(MeshFile file, const std::optional<double>& percent_laid_down) {
  Delivery delivery{std::move(file.pieces)};
  if (delivery.parts.empty()) delivery.parts.push_back({.mesh = std::move(file.mesh)});
  for (Part& part : file.inserts) delivery.parts.push_back(std::move(part));
  for (Part& part : file.modifiers) delivery.parts.push_back(std::move(part));
  assume_shares(delivery, percent_laid_down);
  return delivery;
}

bool overlaps_stand(const CheckedMesh& original, const Mesh& judged, const Progress& progress) {
  return original.report.first_aid.bodies_united > 0 &&
         check_mesh(judged, {.self_intersections = false}, progress).report.first_aid.bodies_united > 0;
}

Mesh read_closed(const std::filesystem::path& path, const Options& options, const Progress& progress, Notes* notes) {
  CheckedMesh checked =
      check_mesh(read_mesh(path, {.memory_bytes = options.memory_bytes}).mesh, {.self_intersections = false}, progress);
  if (!checked.report.usable) throw Error(ErrorCode::input, path.string() + ": " + checked.report.refusal);
  if (notes && checked.report.first_aid)
    for (const std::string& note : checked.report.notes) notes->push_back("Of " + path.string() + ": " + note);
  return std::move(checked.mesh);
}

std::vector<Part> read_fixed(const Options& options, const Progress& progress, Notes* notes) {
  std::vector<Part> parts;
  for (const FixedFile& file : options.fixed)
    parts.push_back({.mesh = read_closed(file.path, options, progress, notes),
                     .role = Part::Role::insert,
                     .density_g_cm3 = file.density_g_cm3});
  return parts;
}

std::vector<Mesh> read_kept_solid(const Options& options, const Progress& progress, Notes* notes) {
  std::vector<Mesh> regions;
  for (const auto& path : options.keep_solid) regions.push_back(read_closed(path, options, progress, notes));
  return regions;
}

void judge_kept(const Kept& what, const Spec& spec, Verdict& verdict, const Progress& progress) {
  if (what.options.keep_solid.empty()) return;
  const std::vector<Mesh> regions = read_kept_solid(what.options, progress, what.notes);
  judge_kept_solid(what.delivered.solid(), kept_solid_terms(regions, spec, what.original), verdict, progress);
}

std::vector<Part> read_plugs(const std::filesystem::path& path) {
  MeshFile file = read_mesh(path);
  std::vector<Part> parts = std::move(file.modifiers);
  std::erase_if(parts, [](const Part& part) { return part.role != Part::Role::plug; });
  // In a 3MF file they are beside the body.
  if (parts.empty() && !file.mesh.triangles.empty()) parts.push_back({.mesh = std::move(file.mesh), .role = Part::Role::plug});
  return parts;
}

Verdict verify_print_with(const Delivery& put_in, const Mesh& original, const Measurement& print, const Spec& spec,
                          const Progress& progress) {
  const Mesh plugs = put_in.mesh_of(Part::Role::plug);
  const Moments more = insert_moments(put_in, print.density_g_cm3) + mesh_moments(plugs);
  Verdict verdict = verify_print(original, print.placed->s + more, spec, {}, progress);
  if (put_in.has_inserts()) verdict.notes.emplace_back("Whether what is put in has room in the print is not judged.");
  if (print_of(spec).drains.wanted())
    verdict.notes.push_back(std::string("Of a print neither its holes are judged nor what stays in its cavities. Assumed: ") +
                            (plugs.triangles.empty() ? "no hole lets the fluid in" : "the plugs close its holes") +
                            ", and nothing stays. 'rayrep verify MESH --drain auto' judges that of the mesh that was sliced.");
  return verdict;
}

SlicedBodies::SlicedBodies(const Options& options, const Progress& progress) : options_(options), progress_(progress) {
  if (!by_hand()) {
    folder_.emplace();
    return;
  }
  const Delivery before = delivery_of(read_mesh(options.sliced_mesh), print_of(options.spec).infill.percent_laid_down);
  const Printed printed = read_printed(options.as_sliced, options.printed);
  excess_ = place_print(printed, before.body(), {options.slicer.print_direction, 0, {}}).s - moments_of(before, progress);
}

std::filesystem::path SlicedBodies::gcode(std::size_t n) const { return folder_->path() / (std::to_string(n) + ".gcode"); }

Moments SlicedBodies::slice(const Delivery& delivery) {
  if (by_hand()) return moments_of(delivery, progress_) + excess_;
  std::string ending = options_.output.extension().string();
  if (ending == ".ply") ending = ".obj";  // which keeps doubles, too, and is read by slicers
  return rayrep::slice(delivery, ending, gcode(count_++), options_.slicer, progress_).placed.s;
}

Verdict SlicedBodies::judged(const Delivery& delivered, const Mesh& original, RunReport& report, const Progress& progress) const {
  const HollowResult& hollow = *report.hollow;
  if (by_hand()) {
    const Moments expected = moments_of(delivered, progress) + excess_;
    Verdict verdict = verify(PrintedDelivery{delivered, expected}, &original, hollow.spec, {}, progress);
    verdict.notes.push_back("The figures are those of the print as " + options_.as_sliced.string() +
                            " lets expect it, with the same profile. Slice it and let 'rayrep verify' judge that G-code.");
    return verdict;
  }
  Measurement& print = report.print.emplace();
  print.path = options_.gcode.string();
  print.printed = read_printed(gcode(hollow.best_slice), options_.printed);
  print.density_g_cm3 = print_of(hollow.spec).density_g_cm3;
  print.placed = place_print(print.printed, delivered.body(),
                             {options_.slicer.print_direction, 0, read_slicer_profile(options_.slicer.profile).bed_centre_mm});
  print.mesh = options_.output.string();
  print.body = mass_properties(print.placed->s, print.density_g_cm3);
  return verify(PrintedDelivery{delivered, print.placed->s}, &original, hollow.spec, {}, progress);
}

void SlicedBodies::deliver(std::size_t n) const {
  if (by_hand()) return;
  std::ifstream in(gcode(n), std::ios::binary);
  std::ostringstream text;
  text << in.rdbuf();
  write_text_file(options_.gcode, text.str());
}

}  // namespace rayrep::tool
