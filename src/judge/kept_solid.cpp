#include "rayrep/judge/kept_solid.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "judge/verify_detail.h"
#include "mesh/surface_gap.h"
#include "rayrep/mesh/surface_query.h"

namespace rayrep {
namespace {

using namespace verify_detail;

/// How deep the vertices lie where the winding number of the surface has that sign, at most; 0: none does.
double depth_mm(const Mesh& mesh, const SurfaceQuery& surface, int sign) {
  double deepest = 0;
  for (const Eigen::Vector3d& p : mesh.vertices)
    if (sign * winding_at(surface, p) > 0)
      deepest = std::max(deepest, surface.closest(p, std::numeric_limits<double>::infinity()).distance_mm);
  return deepest;
}

/// Of the cavities from one region; negative where they overlap.
double distance_mm(const Mesh& cavities, const SurfaceQuery& around, const Mesh& region, const Progress& progress) {
  constexpr double kCross_mm = 1e-6;  // what crosses overlaps, though no vertex may tell
  const SurfaceQuery surface(region);
  const double gap_mm = smallest_gap(cavities, surface, progress);
  const double overlap_mm = std::max(depth_mm(cavities, surface, 1), depth_mm(region, around, -1));
  return overlap_mm > 0 || gap_mm == 0 ? -std::max(overlap_mm, kCross_mm) : gap_mm;
}

/// Cavities, those that holes lead into with the holes.
Mesh rooms_of(const Mesh& delivered, const KeptSolidTerms& terms, const Progress& progress) {
  if (!terms.original || !terms.drains || !terms.drains->wanted()) return cavities_of(delivered);
  Verdict found;
  return rooms_in(judge_surface(delivered, terms.original, progress, found, terms.drains), progress);
}

}  // namespace

KeptSolidTerms kept_solid_terms(const std::vector<Mesh>& regions, const Spec& spec, const Mesh* original) {
  const Print& print = print_of(spec);
  return {.regions = regions, .wall_mm = print.wall_mm, .original = original, .drains = &print.drains};
}

void judge_kept_solid(const Mesh& delivered, const KeptSolidTerms& terms, Verdict& verdict, const Progress& progress) {
  if (terms.regions.empty()) return;
  Figure figure{.name = "kept_solid_mm", .words = "cavities from what is kept solid", .unit = Unit::mm, .value = {}};
  const Mesh cavities = rooms_of(delivered, terms, progress);
  if (!cavities.triangles.empty()) {
    const SurfaceQuery around(cavities);
    double least_mm = std::numeric_limits<double>::infinity();
    for (const Mesh& region : terms.regions) least_mm = std::min(least_mm, distance_mm(cavities, around, region, progress));
    figure.value = least_mm;
    verdict.criteria.push_back(terms.wall_mm > 0 ? at_least("kept_solid", "distance from what is kept solid, over the wall",
                                                            least_mm / terms.wall_mm, terms.wall_ratio)
                                                 : at_least("kept_solid", "distance from what is kept solid, mm", least_mm, 0));
  }
  verdict.figures.push_back(figure);
}

}  // namespace rayrep
