#include "run.h"

#include <sys/resource.h>
#include <tbb/global_control.h>

#include <algorithm>
#include <cstdio>
#include <ctime>
#include <iostream>
#include <limits>
#include <list>
#include <system_error>

#include "batch.h"
#include "input.h"
#include "interrupt.h"
#include "measure.h"
#include "pictures.h"
#include "rayrep/draw/bead_bars.h"
#include "rayrep/rayrep.h"
#include "scene.h"
#include "stages.h"
#include "studio.h"

namespace rayrep::tool {
namespace {

/// Stages that follow the work, and a way to stop it.
Progress followed_by(Stages& stages, const std::function<bool()>& cancelled) {
  return {.stage = [&stages](std::string_view name) { stages.begin(name); },
          .cancelled =
              [&stages, cancelled] {
                stages.tick();
                return cancelled && cancelled();
              }};
}

double peak_memory_mb() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  return static_cast<double>(usage.ru_maxrss) / 1024;
}

/// @param judged  what the page shows
void write_report(const Options& options, const RunReport& report, const Delivery& judged) {
  if (options.json) std::cout << to_json(report);
  std::cout.flush();  // what was said before comes first where the report goes the same way
  if (!options.report.empty()) write_text_file(options.report, to_json(report));
  if (!options.html.empty()) write_text_file(options.html, to_html(report, judged));
}

/// What failed and the judge's explanation, for the message that goes with exit code 4: "(NAMES)END EXPLANATION".
std::string failures(const Verdict& verdict, const std::string& end) {
  std::string text;
  for (const Criterion& c : verdict.criteria)
    if (!c.pass()) text += (text.empty() ? "(" : ", ") + c.name;
  text += ")" + end;
  for (const std::string& note : verdict.notes) text += " " + note;
  return text;
}

/// What is known of a run before its goal is looked at.
RunReport start_report(const Options& options, const ReadMesh& mesh) {
  RunReport report;
  report.command = options.word;
  report.input = mesh.summary;
  report.options = options.in_force;
  report.changed = options.changed;
  return report;
}

/// Writes the files for simulators that were asked for.
void write_inertial(const Options& options, const MassProperties& body) {
  if (!options.urdf.empty()) write_text_file(options.urdf, urdf_inertial(body));
  if (!options.mjcf.empty()) write_text_file(options.mjcf, mjcf_inertial(body));
}

/// Finds out before the work that an output cannot be written, and clears away what killed runs have left there. What is text may
/// go to a device.
void require_outputs(const Options& options) {
  constexpr std::int64_t kOld_s = 3600;
  std::vector<std::filesystem::path> files = options.meshes();
  std::vector<std::filesystem::path> texts = {options.report, options.html,  options.saved_config, options.urdf,
                                              options.mjcf,   options.gcode, options.picture};
  for (const SectionFile& section : options.sections) texts.push_back(section.path);
  for (const auto& text : texts)
    if (!text.empty() && !is_stream(text)) files.push_back(text);
  for (const auto& file : files) {
    require_writable(file);
    remove_abandoned(file, std::time(nullptr) - kOld_s);
  }
  clean_up_beside(files);
}

/// The bodies of a mesh, in the order of the file.
std::vector<ReadMesh> bodies_in(const ReadMesh& mesh, const CheckOptions& check, const Progress& progress) {
  const Mesh& all = mesh.checked.mesh;
  const Components bodies = bodies_of(all, progress);
  std::vector<Mesh> parts(static_cast<std::size_t>(bodies.count));
  for (std::size_t t = 0; t < all.triangles.size(); ++t) {
    Mesh& part = parts[static_cast<std::size_t>(bodies.of_triangle[t])];
    const auto first = static_cast<int>(part.vertices.size());
    for (int k = 0; k < 3; ++k) part.vertices.push_back(all.corner(t, k));
    part.triangles.emplace_back(first, first + 1, first + 2);
  }
  std::vector<ReadMesh> result;
  for (const Mesh& part : parts) {
    ReadMesh one{.checked = check_mesh(part, check, progress), .summary = mesh.summary};
    one.summary.body = result.size() + 1;
    one.summary.bodies = parts.size();
    one.summary.size_mm = bounding_box(part).sizes();
    one.summary.notes.insert(one.summary.notes.end(), mesh.summary.check.notes.begin(), mesh.summary.check.notes.end());
    one.summary.check = one.checked.report;
    one.summary.check.vertices_merged = 0;  // not in the file
    one.summary.vertices = one.checked.mesh.vertices.size();
    one.summary.triangles = one.checked.mesh.triangles.size();
    result.push_back(std::move(one));
  }
  return result;
}

/// "out.stl" for a body: "out-2.stl".
std::filesystem::path numbered(const std::filesystem::path& path, std::size_t number) {
  if (path.empty() || is_stream(path)) return path;
  std::filesystem::path name = path.stem();
  name += "-" + std::to_string(number);
  name += path.extension();
  return path.parent_path() / name;
}

/// The options for one body of many.
Options options_for(const Options& options, std::size_t number) {
  Options one = options;
  for (std::filesystem::path* path :
       {&one.output, &one.insert_output, &one.plug_output, &one.outside_output, &one.dense_output, &one.sparse_output,
        &one.piece_output, &one.report, &one.html, &one.urdf, &one.mjcf, &one.gcode, &one.picture})
    *path = numbered(*path, number);
  for (SectionFile& section : one.sections) section.path = numbered(section.path, number);
  refuse_overwriting(one);
  require_outputs(one);
  return one;
}

using RunOne = std::function<void(const Options& options, const ReadMesh& body, Stages& stages, const Progress& progress)>;

/// Runs a command on each body by itself; what fails is told, and the others are gone on with.
/// @throws Error with the largest exit code, if any
void for_each_body(const Options& options, std::vector<ReadMesh> bodies, const Progress& progress, const RunOne& run_one) {
  std::vector<Options> all;
  for (const ReadMesh& body : bodies) all.push_back(options_for(options, body.summary.body));
  ErrorCode worst = ErrorCode::internal;
  std::size_t failed = 0;
  for (std::size_t n = 0; n < bodies.size(); ++n) {
    if (n > 0 && !options.quiet) std::cout << "\n";
    Stages stages(options);
    const Progress own = followed_by(stages, progress.cancelled);
    try {
      run_one(all[n], bodies[n], stages, own);
    } catch (const Error& error) {
      if (error.code() == ErrorCode::interrupted && n > 0)
        throw Error(ErrorCode::interrupted, "Interrupted at body " + std::to_string(n + 1) + " of " +
                                                std::to_string(bodies.size()) + "; those before it are done.");
      if (error.code() == ErrorCode::interrupted || error.code() == ErrorCode::internal) throw;
      stages.finish();
      std::cout.flush();
      std::cerr << "rayrep: body " << n + 1 << " of " << bodies.size() << ": " << printable(error.what()) << std::endl;
      worst = std::max(worst, error.code());
      ++failed;
    }
  }
  if (failed > 0)
    throw Error(worst, std::to_string(failed) + " of " + std::to_string(bodies.size()) +
                           (bodies.size() == 1 ? " body" : " bodies") + " failed; what failed is told above" +
                           (failed < bodies.size() ? ", the others are done." : "."));
}

/// "to judge it again: ...": of what was judged, a mesh or G-code; nothing of what is only expected to be printed.
std::string judged_again(const Options& options, const RunReport& report, bool with_original) {
  if (!report.hollow->slices.empty() && !report.print) return "";
  Options judging = options;
  if (report.outside) {  // in millimetres, of its final size
    judging.input = report.outside->path;
    judging.size_mm.reset();
  }
  Spec spec = report.hollow->spec;
  if (auto* stand = std::get_if<StandSpec>(&spec); stand && report.print && stand->flatten_mm > 0) {  // a print stands on its base
    judging.input = report.output;
    judging.size_mm.reset();
    stand->flatten_mm = 0;
  }
  if (const Eigen::Vector3d& up = options.slicer.print_direction; report.print && up != Eigen::Vector3d::UnitZ())
    print_of(spec).direction = up;
  const std::string what = report.print ? report.print->path : report.output;
  return "\nto judge it again: " +
         printable(judging_command(judging, spec, what, with_original || report.print || report.outside)) + "\n";
}

/// With a picture of it, if the file can hold one.
Delivery with_thumbnail(Delivery delivery, const std::filesystem::path& target, const Eigen::Vector3d& up) {
  if (can_write_infill(target)) delivery.thumbnail_png = thumbnail_png(delivery, up);
  return delivery;
}

/// What is drawn of a body that was judged.
/// @param outside  what touches water and ground
Subject subject_of(const Options& options, const Delivery& delivery, const Mesh& outside, const RunReport& report,
                   const Progress& progress) {
  const Spec& spec = report.hollow ? report.hollow->spec : options.spec;
  const std::filesystem::path& file = options.command == Command::hollow ? options.output : options.input;
  return {delivery, marks_of(outside, spec, report.after.body, progress), file.filename().string(), is_printed(file)};
}

/// What touches water and ground: of a body whose holes are closed by plugs the original's surface.
Mesh touched(const Delivery& delivered, const Mesh* original) {
  return original && !delivered.mesh_of(Part::Role::plug).triangles.empty() ? *original : delivered.body();
}

Eigen::Vector3d centre_of(const Mesh& solid, const Progress& progress) {
  return mass_properties(boundary_of_union(solid, progress), 1).centre_of_mass_mm;
}

struct ToDeliver {
  const Options& options;
  const Mesh& given;           ///< the solid as it was read
  const Mesh& solid;           ///< its outside may have been changed: RunReport::outside
  const SlicedBodies* sliced;  ///< null: the mesh alone is judged
};

/// Meshes of their own that go with the output: they wait beside their final places until it is judged.
class Companions {
public:
  /// @throws Error{write}
  std::filesystem::path write(const std::filesystem::path& target, const Mesh& mesh, const Eigen::Vector3d& up) {
    PendingFile& file = files_.emplace_back(target);
    file.write(with_thumbnail({{{.mesh = mesh}}}, target, up));
    std::error_code ignored;
    if (std::filesystem::exists(target, ignored)) replaced_ += "; it replaced " + printable(target.string()) + ", too";
    return file.path();
  }
  void commit() {
    for (PendingFile& file : files_) file.commit();
  }
  /// What of these was there before, for the summary.
  const std::string& replaced() const { return replaced_; }

private:
  std::list<PendingFile> files_;
  std::string replaced_;
};

/// Each piece as it lies on the bed, above the origin. @returns their paths
/// @throws Error{write} when rounding of coordinates spoils one
std::vector<std::string> write_pieces(const Options& options, const Delivery& made, Companions& companions,
                                      const Progress& progress) {
  std::vector<std::string> paths;
  for (const Part& part : made.parts) {
    if (options.piece_output.empty() || part.role != Part::Role::body) continue;
    Mesh mesh = transformed(part.mesh, part.to_bed);
    const Eigen::Vector3d middle = bounding_box(mesh).center();
    for (Eigen::Vector3d& v : mesh.vertices) v.head<2>() -= middle.head<2>();
    const std::filesystem::path target = options.output_of_piece(paths.size() + 1);
    refuse_overwriting(options, target);
    clean_up_beside({target});
    const CheckedMesh back =
        check_mesh(read_mesh(companions.write(target, mesh, Eigen::Vector3d::UnitZ())).mesh, {.unite = false}, progress);
    const double volume_mm3 = mesh_moments(mesh)[M1];
    constexpr double kRounding = 1e-5;
    if (!back.report.usable || std::abs(mesh_moments(back.mesh)[M1] - volume_mm3) > kRounding * volume_mm3)
      throw Error(ErrorCode::write, "The " + part.name + " does not stand the rounding of coordinates in '" + target.string() +
                                        "': write .3mf or .obj, which keep all digits.");
    paths.push_back(target.string());
  }
  return paths;
}

/// Writes the hollowed mesh and a core beside their final places, has them judged as re-read from disk, and puts them in place if
/// they pass.
void deliver(const ToDeliver& what, RunReport& report, Stages& stages, const Progress& progress) {
  const auto& [options, given, solid, sliced] = what;
  HollowResult& hollow = *report.hollow;
  progress.begin("write");
  PendingFile pending(options.output);
  report.delivered_triangles = hollow.delivery.solid().triangles.size();
  const Eigen::Vector3d up = up_of(options.spec);
  pending.write(with_thumbnail(hollow.delivery, options.output, up), options.flavor);
  // What is put in: the user's own, then what was made for it.
  Part made{{}, Part::Role::insert, options.insert_density()};
  std::vector<Part> put_in;
  for (const Part& part : hollow.delivery.parts) {
    if (part.role != Part::Role::insert || in_pieces(hollow.delivery)) continue;
    if (put_in.size() < options.fixed.size())
      put_in.push_back(part);
    else
      append(made.mesh, part.mesh);
  }
  report.pauses_mm = hollow.delivery.pauses_mm;
  Companions companions;
  std::vector<Part> plugs;
  if (const Mesh all = hollow.delivery.mesh_of(Part::Role::plug); !all.triangles.empty()) {
    report.plugs = {options.plug_output.string(), connected_components(with_merged_vertices(all)).count};
    if (!options.plug_output.empty()) plugs = read_plugs(companions.write(options.plug_output, all, up));
  }
  if (options.phases && hollow.delivery.has_infill()) {
    companions.write(options.dense_output, hollow.delivery.solid(), up);
    companions.write(options.sparse_output, hollow.delivery.mesh_of(Part::Role::modifier), up);
    report.dense_output = options.dense_output.string();
    report.sparse_output = options.sparse_output.string();
  }
  report.piece_outputs = write_pieces(options, hollow.delivery, companions, progress);
  hollow.delivery = {};
  constexpr ReadOptions kAnySize{.memory_bytes = std::numeric_limits<std::size_t>::max()};
  if (!made.mesh.triangles.empty()) {
    made.mesh = read_mesh(companions.write(options.insert_output, made.mesh, up), kAnySize).mesh;
    report.insert = {options.insert_output.string(), mass_properties(made.mesh, made.density_g_cm3),
                     connected_components(with_merged_vertices(made.mesh)).count};
    put_in.push_back(std::move(made));
  }
  Mesh outside;
  if (report.outside) outside = read_mesh(companions.write(report.outside->path, solid, up), kAnySize).mesh;
  const Mesh& original = report.outside ? outside : solid;
  progress.begin("verify");
  Delivery delivered = delivery_of(read_mesh(pending.path(), kAnySize), print_of(hollow.spec).infill.percent_laid_down);
  delivered.parts.insert(delivered.parts.end(), put_in.begin(), put_in.end());
  delivered.parts.insert(delivered.parts.end(), plugs.begin(), plugs.end());
  report.after =
      sliced ? sliced->judged(delivered, original, report, progress) : verify(delivered, &original, hollow.spec, {}, progress);
  judge_kept({options, delivered, &original}, hollow.spec, report.after, progress);
  report.before = state_figures(original, hollow.spec, {}, progress);
  Pictures pictures;
  if (report.after.pass() && options.draws()) {
    progress.begin("draw");
    Subject subject = subject_of(options, delivered, touched(delivered, &original), report, progress);
    subject.marks.centre_before_mm = centre_of(given, progress);
    pictures.draw(options, {subject, &given, report.outside ? &solid : nullptr});
  }
  report.timings_s = stages.finish();
  report.peak_memory_mb = peak_memory_mb();
  if (!report.after.pass()) {
    if (!options.attempt) write_report(options, report, delivered);
    if (!options.attempt && !options.quiet) std::cout << printable(to_text(report, options.verbose));
    const std::string jumps =
        sliced
            ? " After " + std::to_string(hollow.slices.size()) +
                  " slices the print still misses it: what a slicer lays down jumps by whole layers, most of all where the floor "
                  "of the cavity is level. Thinner layers, another wall, or a waterline left open help."
            : "";
    throw Error(ErrorCode::goal, std::string(sliced ? "The print" : "The hollowed mesh") + " does not meet the goal " +
                                     failures(report.after, "; nothing was written.") + jumps);
  }
  std::error_code ignored;
  const bool replaced = std::filesystem::exists(options.output, ignored);
  progress.check();
  const Uninterrupted whole(!options.each);
  companions.commit();
  pending.commit();
  if (sliced) sliced->deliver(hollow.best_slice);
  pictures.write();
  report.output = options.output.string();
  write_report(options, report, delivered);
  if (options.quiet) return;
  std::cout << printable(to_text(report, options.verbose));
  if (options.verbose) {
    const bool alike = !options.each && (report.input.scale != 1 || report.input.mm_per_unit == 1 || report.input.format == "3MF");
    std::cout << judged_again(options, report, alike);
  }
  char took[32];
  std::snprintf(took, sizeof took, "%.2f", report.timings_s.back().second);
  std::cout << "VERIFIED: wrote " << printable(report.output) << ", " << report.delivered_triangles << " triangles, in " << took
            << " s" << (replaced ? "; it replaced the file that was there" : "") << companions.replaced() << "\n"
            << printable(pictures.told()) << printing_text(report);
}

/// Finds out before the work that STL, which stores float32, cannot hold the wall so far from the origin.
void require_room_for_wall(const Options& options, const Mesh& solid) {
  const Eigen::AlignedBox3d box = bounding_box(solid);
  const double wall_mm = print_of(options.spec).wall_mm;
  if (ending_of(options.output) != ".stl" || float32_holds_wall(box, wall_mm)) return;
  char text[256];
  std::snprintf(text, sizeof text,
                "So far from the origin the numbers of an STL file (float32) lie %.3g mm apart: too far for a wall of %.3g mm. "
                "Write .3mf or .obj, which keep doubles (-o), or move the body to the origin.",
                float32_spacing_mm(box), wall_mm);
  throw Error(ErrorCode::input, text);
}

DeformOptions deform_options(const Options& options, const Progress& progress, Notes* notes = nullptr) {
  DeformOptions how = options.deform;
  for (const auto& path : options.deform_fixed) how.fixed.emplace_back(read_closed(path, options, progress, notes));
  return how;
}

/// The solid, or with its outside deformed where that is allowed and takes it.
Mesh outside_for(const Options& options, const Mesh& solid, const HollowOptions& how, RunReport& report, const Progress& progress) {
  if (!options.deform.limit_mm) return solid;
  const Deformation deformation =
      options.outside ? *options.outside
                      : deform(solid, options.spec, how, deform_options(options, progress, &report.input.notes), progress);
  if (!deformation.changed) return solid;
  report.outside = {options.outside_output.string(), deformation.figures(), deformation.words()};
  return as_stored(options.outside_output, deformation.mesh);
}

void hollow_one(const Options& options, const ReadMesh& input, Stages& stages, const Progress& progress) {
  const Mesh& solid = input.checked.mesh;
  require_room_for_wall(options, solid);
  require_planes_meet(options, solid);
  RunReport report = start_report(options, input);
  HollowOptions how = hollow_options(options, progress, &report.input.notes);
  std::optional<SlicedBodies> sliced;
  if (!options.slicer.program.empty() || !options.as_sliced.empty()) {
    sliced.emplace(options, progress);
    how.as_printed = [&sliced](const Delivery& delivery) { return sliced->slice(delivery); };
  }
  const Mesh outside = outside_for(options, solid, how, report, progress);
  report.hollow = hollow(outside, options.spec, how, progress);
  deliver({options, solid, outside, sliced ? &*sliced : nullptr}, report, stages, progress);
  write_inertial(options, report.after.body);
}

void run_hollow(const Options& options, Stages& stages, const Progress& progress) {
  ReadMesh input = read(options.input, options, {}, progress);
  refuse_unusable(input);
  if (options.each) {
    stages.finish();
    for_each_body(options, bodies_in(input, {}, progress), progress, hollow_one);
    return;
  }
  refuse_loose_bodies(options, input, progress);
  hollow_one(options, input, stages, progress);
}

constexpr CheckOptions kChecksToJudge{.self_intersections = false, .unite = false};
constexpr CheckOptions kChecksOfOriginal{.self_intersections = false};

/// What a nozzle lays down, bead by bead; in the frame of the mesh if that was found in it.
Mesh laid_down(const Measurement& measurement) {
  constexpr std::size_t kMost = 1'000'000;
  const std::vector<Bead>& beads = measurement.printed.beads;
  if (beads.empty())
    throw Error(ErrorCode::usage, measurement.path +
                                      ": the layers of a resin printer are pixels, which are not drawn. The slicer's preview shows "
                                      "them; 'rayrep inspect' measures them.");
  if (beads.size() > kMost)
    throw Error(ErrorCode::usage, measurement.path + " lays down " + std::to_string(beads.size()) + " beads, more than the " +
                                      std::to_string(kMost) + " that are drawn. 'rayrep inspect' measures it.");
  const Mesh bars = bead_bars(beads);
  return measurement.placed ? transformed(bars, measurement.placed->to_mesh) : bars;
}

/// Writes the pictures of what was judged, whatever the verdict.
Pictures draw_judged(const Options& options, const Subject& subject, const Mesh* original, const Progress& progress) {
  Pictures pictures;
  BodyPicture picture{subject, original};
  if (original) picture.after.marks.centre_before_mm = centre_of(*original, progress);
  if (is_printed(options.input)) picture.cut = usual_plane(subject.delivery.body(), subject.marks.up);
  pictures.draw(options, picture);
  pictures.write();
  return pictures;
}

/// What both verdicts on meshes and on prints end with.
void tell_verdict(const Options& options, RunReport& report, const Delivery& judged, const Pictures& pictures, Stages& stages) {
  report.timings_s = stages.finish();
  report.peak_memory_mb = peak_memory_mb();
  write_report(options, report, judged);
  if (!options.quiet) std::cout << printable(to_text(report, options.verbose) + pictures.told());
  if (!report.after.pass()) throw Error(ErrorCode::goal, "It does not meet the goal " + failures(report.after, "."));
  if (!options.quiet) std::cout << "VERIFIED\n";
}

/// The original, with bodies of it that overlap made one as for a maker, unless those of what is judged were left as they are.
ReadMesh original_of(const Options& options, const ReadMesh& judged, const Progress& progress) {
  ReadMesh original = read(options.original, options, kChecksOfOriginal, progress);
  return overlaps_stand(original.checked, judged.checked.mesh, progress) ? read(options.original, options, kChecksToJudge, progress)
                                                                         : original;
}

void verify_one(const Options& options, const ReadMesh& mesh, Stages& stages, const Progress& progress) {
  ReadMesh input = mesh;
  require_planes_meet(options, input.checked.mesh);
  std::optional<ReadMesh> original;
  if (!options.original.empty()) {
    original = original_of(options, input, progress);
    refuse_unusable(*original);
    if (original->checked.report.first_aid)
      for (const std::string& note : original->checked.report.notes) input.summary.notes.push_back("Of --original: " + note);
  }
  RunReport report = start_report(options, input);
  progress.begin("verify");
  Delivery delivered;
  try {
    delivered = delivery_of(input.as_file(), print_of(options.spec).infill.percent_laid_down);
    const std::vector<Part> fixed = read_fixed(options, progress, &report.input.notes);
    delivered.parts.insert(delivered.parts.end(), fixed.begin(), fixed.end());
    if (!options.plugs.empty())
      for (Part& part : read_plugs(options.plugs)) delivered.parts.push_back(std::move(part));
    report.after = verify(delivered, original ? &original->checked.mesh : nullptr, options.spec, {}, progress);
    judge_kept({options, delivered, original ? &original->checked.mesh : nullptr, &report.input.notes}, options.spec, report.after,
               progress);
  } catch (const Error& error) {
    // The check says better than the judge what is wrong with a mesh that has no inside.
    if (error.code() == ErrorCode::input) refuse_unusable(input);
    throw;
  }
  Pictures pictures;
  if (options.draws() && !input.checked.report.usable) {
    report.after.notes.emplace_back("Of a surface that is not closed no pictures are drawn.");
  } else if (options.draws()) {
    progress.begin("draw");
    const Subject subject =
        subject_of(options, delivered, touched(delivered, original ? &original->checked.mesh : nullptr), report, progress);
    pictures = draw_judged(options, subject, original ? &original->checked.mesh : nullptr, progress);
  }
  tell_verdict(options, report, delivered, pictures, stages);
}

void verify_printed(const Options& options, Stages& stages, const Progress& progress) {
  ReadMesh original = read(options.original, options, kChecksOfOriginal, progress);
  refuse_unusable(original);
  require_planes_meet(options, original.checked.mesh);
  RunReport report = start_report(options, original);
  progress.begin("measure");
  Options reading = options;
  reading.printed.keep_beads = options.draws();
  report.print = measured(reading, &original.checked.mesh, options.original.string());
  const Mesh bars = options.draws() ? laid_down(*report.print) : Mesh{};
  Spec spec = options.spec;
  std::visit([&](auto& s) { s.print.density_g_cm3 = report.print->density_g_cm3; }, spec);
  progress.begin("verify");
  Delivery judged{read_fixed(options, progress, &report.input.notes)};
  if (!options.plugs.empty())
    for (Part& part : read_plugs(options.plugs)) judged.parts.push_back(std::move(part));
  report.after = verify_print_with(judged, original.checked.mesh, *report.print, spec, progress);
  Pictures pictures;
  if (options.draws()) {
    progress.begin("draw");
    Delivery printed = judged;
    printed.parts.push_back({.mesh = bars});
    const Mesh& outside = original.checked.mesh;
    pictures = draw_judged(options, subject_of(options, printed, outside, report, progress), &outside, progress);
  }
  judged.parts.push_back({.mesh = original.checked.mesh});
  tell_verdict(options, report, judged, pictures, stages);
}

/// Of a print that is only looked at.
Pictures draw_printed(const Options& options, const Measurement& measurement) {
  const Delivery body{{{.mesh = laid_down(measurement)}}};
  require_planes_meet(options, body.parts.front().mesh);
  Subject subject{body, {.up = options.picture_up.normalized()}, options.input.filename().string()};
  subject.marks.mass_g = measurement.body.mass_g;
  subject.marks.centre_of_mass_mm = measurement.body.centre_of_mass_mm;
  subject.is_print = true;
  BodyPicture picture{subject};
  picture.cut = usual_plane(body.parts.front().mesh, subject.marks.up);
  Pictures pictures;
  pictures.draw(options, picture);
  pictures.write();
  return pictures;
}

void run_measure(const Options& options, Stages& stages, const Progress& progress) {
  std::optional<ReadMesh> mesh;
  if (!options.original.empty()) {
    mesh = read(options.original, options, kChecksOfOriginal, progress);
    refuse_unusable(*mesh);
  }
  progress.begin("measure");
  Options reading = options;
  reading.printed.keep_beads = options.draws();
  const Measurement measurement = measured(reading, mesh ? &mesh->checked.mesh : nullptr, options.original.string());
  Pictures pictures;
  if (options.draws()) {
    progress.begin("draw");
    pictures = draw_printed(options, measurement);
  }
  stages.finish();
  if (options.json)
    std::cout << to_json(measurement);
  else if (!options.quiet)
    std::cout << printable(to_text(measurement) + pictures.told());
  write_inertial(options, measurement.body);
}

void run_verify(const Options& options, Stages& stages, const Progress& progress) {
  if (is_printed(options.input)) {
    verify_printed(options, stages, progress);
    return;
  }
  // What rayrep has written is in millimetres and of its final size; unit and size are then those of what it was made from.
  Options as_written = options;
  if (!options.original.empty()) {
    as_written.unit = LengthUnit::millimetre;
    as_written.size_mm.reset();
  }
  ReadMesh input = read(options.input, as_written, kChecksToJudge, progress);
  if (options.each) {
    refuse_unusable(input);
    if (!input.pieces.empty())
      throw Error(ErrorCode::usage, "'" + options.input.string() + "' holds one body in pieces: leave --each out.");
    if (!input.modifiers.empty())
      throw Error(ErrorCode::usage, "--each does not know whose the modifiers of '" + options.input.string() +
                                        "' are: save each body with its own as a file of its own.");
    stages.finish();
    for_each_body(options, bodies_in(input, kChecksToJudge, progress), progress, verify_one);
    return;
  }
  if (input.checked.report.usable && input.pieces.empty()) refuse_loose_bodies(options, input, progress);
  verify_one(options, input, stages, progress);
}

/// Of a mesh that is only looked at.
Pictures draw_looked_at(const Options& options, const ReadMesh& mesh, const Progress& progress) {
  progress.begin("draw");
  require_planes_meet(options, mesh.checked.mesh);
  Delivery body = delivery_of(mesh.as_file(), std::nullopt);
  for (Part& part : read_fixed(options, progress)) body.parts.push_back(std::move(part));
  const double density = options.print.density_g_cm3;
  const MassProperties mass = mass_properties(moments_of(body, progress) + insert_moments(body, density), density);
  Subject subject{body, {.up = options.picture_up.normalized()}, options.input.filename().string()};
  subject.marks.mass_g = mass.mass_g;
  subject.marks.centre_of_mass_mm = mass.centre_of_mass_mm;
  Pictures pictures;
  pictures.draw(options, {subject});
  pictures.write();
  return pictures;
}

void write_page(const Options& options, const ReadMesh& input, const Inspection& inspection) {
  if (options.html.empty()) return;
  std::cout.flush();
  write_text_file(options.html, to_html(inspection, delivery_of(input.as_file(), std::nullopt)));
}

void run_inspect(const Options& options, Stages& stages, const Progress& progress) {
  const ReadMesh input = read(options.input, options, {}, progress);
  const LookedAt found = look_at(options, input, progress);
  Pictures pictures;
  if (found.mass && options.draws()) pictures = draw_looked_at(options, input, progress);
  stages.finish();
  const Inspection inspection = inspection_of(options, input, found);
  if (options.json)
    std::cout << to_json(inspection);
  else if (!options.quiet)
    std::cout << printable(to_text(inspection) + pictures.told());
  write_page(options, input, inspection);
  refuse_unusable(input);
  write_inertial(options, *found.mass);
}

void run_view(const Options& options, Stages& stages, const Progress& progress) {
  if (is_printed(options.input)) {
    progress.begin("measure");
    Options keeping = options;
    keeping.printed.keep_beads = true;
    const Measurement measurement = measured(keeping, nullptr, "");
    progress.begin("draw");
    const Pictures pictures = draw_printed(options, measurement);
    stages.finish();
    if (!options.quiet) std::cout << printable(pictures.told());
    return;
  }
  const ReadMesh input = read(options.input, options, kChecksToJudge, progress);
  refuse_unusable(input);
  Pictures pictures;
  if (options.draws()) pictures = draw_looked_at(options, input, progress);
  stages.finish();
  if (!options.quiet) std::cout << printable(pictures.told());
  if (options.html.empty()) return;
  write_page(options, input, inspection_of(options, input, look_at(options, input, progress)));
  if (!options.quiet) std::cout << "page: " << printable(options.html.string()) << "\n";
}

std::optional<tbb::global_control> limit_threads(const Options& options) {
  std::optional<tbb::global_control> limit;
  if (options.threads > 0) limit.emplace(tbb::global_control::max_allowed_parallelism, static_cast<std::size_t>(options.threads));
  return limit;
}

/// That a mesh with holes be closed by a guess, if it can be hollowed then.
Advice advise_repair(const Options& options, const Progress& progress, const Search& search) {
  Options repairing = options;
  repairing.repair = true;
  ReadMesh input = read(options.input, repairing, {}, progress);
  refuse_unusable(input);
  refuse_loose_bodies(repairing, input, progress);
  Advice advice{{}, "--repair"};
  const HollowOptions how = hollow_options(options, progress);
  const HollowResult result = hollow(input.checked.mesh, options.spec, how, progress);
  if (!verify(result.delivery, &input.checked.mesh, result.spec, {}, progress).pass()) return advice;
  advice.suggestions.push_back({"the holes closed by a guess", {{"repair", ""}}});
  if (search.found) search.found(advice.suggestions.back());
  return advice;
}

}  // namespace

Advice advise(const Options& options, const std::function<bool()>& cancelled, const Search& search) {
  const auto limit = limit_threads(options);
  Stages stages(options);
  const Progress progress = followed_by(stages, cancelled);
  ReadMesh input = read(options.input, options, {}, progress);
  if (!input.checked.report.usable && input.checked.report.repairable) return advise_repair(options, progress, search);
  refuse_unusable(input);
  refuse_loose_bodies(options, input, progress);
  Search looked_for = search;
  looked_for.deform = deform_options(options, progress);
  return suggest(input.checked.mesh, options.spec, hollow_options(options, progress), looked_for, progress);
}

void run(const Options& options, const std::function<bool()>& cancelled) {
  const auto limit = limit_threads(options);
  if (!options.each) require_outputs(options);
  if (!options.saved_config.empty()) write_text_file(options.saved_config, options.config);
  Stages stages(options);
  const Progress progress = followed_by(stages, cancelled);
  switch (options.command) {
    case Command::hollow:
      run_hollow(options, stages, progress);
      break;
    case Command::verify:
      run_verify(options, stages, progress);
      break;
    case Command::inspect:
      run_inspect(options, stages, progress);
      break;
    case Command::view:
      run_view(options, stages, progress);
      break;
    case Command::measure:
      run_measure(options, stages, progress);
      break;
    case Command::batch:
      run_batch(options, progress);
      break;
    case Command::sweep:
      run_sweep(options);
      break;
    case Command::studio:
      run_studio(options, cancelled);
      break;
    case Command::scene:
      run_scene(options, stages, progress);
      break;
    case Command::motion:
      run_motion(options, stages, progress);
      break;
    case Command::balance:
      run_balance(options, stages, progress);
      break;
    case Command::carve:
      run_carve(options, stages, progress);
      break;
    case Command::text:
      std::cout << options.text;
      break;
  }
  if (std::cout.flush()) return;
  const bool delivered = options.command == Command::hollow;  // or an error would have been thrown
  throw Error(
      ErrorCode::write,
      "Cannot write to standard output" +
          (delivered && options.each ? ": only the summary is missing, the meshes are verified and in place."
           : delivered ? ": only the summary is missing, the mesh is verified and in place: " + options.output.string() + "."
                       : std::string(".")));
}

}  // namespace rayrep::tool
