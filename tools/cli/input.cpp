#include "input.h"

#include <cmath>
#include <utility>

namespace rayrep::tool {

ReadMesh read(const std::filesystem::path& path, const Options& options, CheckOptions check, const Progress& progress) {
  check.repair = options.repair;
  progress.begin("read");
  const MeshFile file = read_mesh(path, {.memory_bytes = options.memory_bytes});
  ReadMesh result;
  InputSummary& summary = result.summary;
  progress.begin("check");
  result.checked = check_mesh(file.mesh, check, progress);
  Mesh& mesh = result.checked.mesh;
  const bool own_unit = file.format == "3MF";  // already applied by the reader
  summary.mm_per_unit = own_unit ? file.mm_per_unit : millimetres(options.unit);
  double factor = own_unit ? 1 : summary.mm_per_unit;
  const Eigen::AlignedBox3d box = bounding_box(mesh);
  if (!box.isEmpty()) {
    const double longest = factor * box.sizes().maxCoeff();
    if (options.size_mm && longest > 0 && std::isfinite(longest)) {
      summary.scale = *options.size_mm / longest;
      factor *= summary.scale;
    }
    summary.size_mm = factor * box.sizes();
  }
  result.modifiers = file.modifiers;
  result.pieces = file.pieces;
  result.inserts = file.inserts;
  const bool counted = options.command == Command::verify;
  if (factor != 1) {
    for (auto& v : mesh.vertices) v *= factor;
    for (std::vector<Part>* parts : {&result.modifiers, &result.pieces, &result.inserts})
      for (Part& part : *parts) {
        for (auto& v : part.mesh.vertices) v *= factor;
        part.to_bed.translation() *= factor;
      }
  }
  if (result.checked.report.usable) require_size(mesh, path.string());
  summary.path = path.string();
  summary.format = file.format;
  summary.notes = file.notes;
  if (!result.modifiers.empty() && !counted)
    summary.notes.emplace_back(
        "The infill of modifiers is not counted here: the body is taken as solid. 'rayrep verify' counts it.");
  summary.check = result.checked.report;
  summary.vertices = mesh.vertices.size();
  summary.triangles = mesh.triangles.size();
  return result;
}

void refuse_unusable(const ReadMesh& mesh) {
  const MeshReport& report = mesh.checked.report;
  if (report.usable) return;
  throw Error(ErrorCode::input, mesh.summary.path + ": " + report.refusal);
}

void refuse_loose_bodies(const Options& options, ReadMesh& mesh, const Progress& progress) {
  const int bodies = bodies_of(mesh.checked.mesh, progress).count;
  if (bodies < 2) return;
  const std::string count = "There are " + std::to_string(bodies) + " bodies that do not touch each other";
  if (!options.rigid)
    throw Error(ErrorCode::input,
                mesh.summary.path + ": " + count +
                    ": each would float, spin or stand by itself. Say --each to treat them one by one, or --rigid if something "
                    "holds them together.");
  mesh.summary.notes.push_back(count + ": taken as one rigid body, as --rigid says.");
}

HollowOptions hollow_options(const Options& options, const Progress& progress, Notes* notes) {
  HollowOptions how = options.hollow;
  for (Part& part : read_fixed(options, progress, notes)) how.fixed.push_back({std::move(part)});
  how.keep_solid = read_kept_solid(options, progress, notes);
  how.as_stored = [&options](const Mesh& mesh) { return as_stored(options.output, mesh); };
  return how;
}

LookedAt look_at(const Options& options, const ReadMesh& input, const Progress& progress) {
  LookedAt found;
  if (!input.checked.report.usable) return found;
  const Mesh boundary = boundary_of_union(input.checked.mesh, progress);
  found.mass = mass_properties(boundary, options.print.density_g_cm3);
  found.area_mm2 = surface_area(boundary);
  return found;
}

Inspection inspection_of(const Options& options, const ReadMesh& input, const LookedAt& found) {
  return {input.summary, options.print.density_g_cm3, found.area_mm2, found.mass ? &*found.mass : nullptr};
}

}  // namespace rayrep::tool
