#include "judge/inserts.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_reduce.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "base/text.h"
#include "judge/figures.h"
#include "judge/verify_detail.h"
#include "rayrep/mesh/surface_query.h"

namespace rayrep::verify_detail {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

// A printer does not see less.
constexpr double kOverlap_mm = 0.1;

// How deep the corners and middles of a mesh's triangles lie within a closed surface, or outside of it.
double deepest(const Mesh& mesh, const SurfaceQuery& surface, bool within, const Progress& progress) {
  progress.check();
  const auto lies_there = [&](const Eigen::Vector3d& p, std::vector<LineHit>& hits) {
    closed_line_hits(surface, p.head<2>(), hits);
    return (winding_below(hits, p.z()) > 0) == within;
  };
  const auto depth_of = [&](const Eigen::Vector3d& p, std::vector<LineHit>& hits) {
    constexpr double kTouches_mm = 1e-6;  // and what fills its room touches it everywhere: the quick answer first
    if (surface.closest(p, kTouches_mm).triangle >= 0 || !lies_there(p, hits)) return 0.0;
    ClosestPoint closest;
    for (double radius_mm = kOverlap_mm; closest.triangle < 0; radius_mm *= 8) closest = surface.closest(p, radius_mm);
    const double depth = closest.distance_mm;
    // A line through corners of the surface may miss it: what is so deep is there all around, too.
    for (const double angle : {1.0, 3.3})
      if (!lies_there(p + 0.5 * depth * Eigen::Vector3d(std::cos(angle), std::sin(angle), 0), hits)) return 0.0;
    return depth;
  };
  return tbb::parallel_reduce(
      tbb::blocked_range<std::size_t>(0, mesh.triangles.size(), 256), 0.0,
      [&](const auto& range, double most) {
        std::vector<LineHit> hits;
        for (std::size_t t = range.begin(); t < range.end(); ++t) {
          Eigen::Vector3d middle = Eigen::Vector3d::Zero();
          for (int k = 0; k < 3; ++k) {
            most = std::max(most, depth_of(mesh.corner(t, k), hits));
            middle += mesh.corner(t, k) / 3;
          }
          most = std::max(most, depth_of(middle, hits));
        }
        return most;
      },
      [](double a, double b) { return std::max(a, b); });
}

// How deep two of them reach into each other.
double overlap(const Mesh& a, const SurfaceQuery& of_a, const Mesh& b, const SurfaceQuery& of_b, const Progress& progress) {
  return std::max(deepest(a, of_b, true, progress), deepest(b, of_a, true, progress));
}

}  // namespace

void judge_inserts(const Delivery& delivered, const Mesh& solid, const Mesh& hull, const Progress& progress, Verdict& verdict) {
  const SurfaceQuery printed(solid);
  const SurfaceQuery outside(hull);
  struct Insert {
    Mesh mesh;
    SurfaceQuery surface;
  };
  std::vector<Insert> before;
  std::vector<Record> records;
  double worst_mm = 0;
  double mass_g = 0;
  for (const Part& part : delivered.parts) {
    if (part.role != Part::Role::insert) continue;
    Mesh mesh = merged_mesh(part.mesh);
    const MassProperties mass = mass_properties(mesh, part.density_g_cm3);
    if (unbalanced_edges(mesh) > 0 || !(mass.mass_g > 0)) {
      worst_mm = kInfinity;
      verdict.notes.push_back("A body that is put in is not closed, or faces inward: nothing can be said of it.");
      continue;
    }
    SurfaceQuery surface(mesh);
    worst_mm = std::max(worst_mm, overlap(mesh, surface, solid, printed, progress));
    worst_mm = std::max(worst_mm, deepest(mesh, outside, false, progress));
    for (const Insert& other : before) worst_mm = std::max(worst_mm, overlap(mesh, surface, other.mesh, other.surface, progress));
    mass_g += mass.mass_g;
    const Eigen::Vector3d& c = mass.centre_of_mass_mm;
    records.push_back({{"density_g_cm3", part.density_g_cm3},
                       {"volume_mm3", mass.volume_mm3},
                       {"mass_g", mass.mass_g},
                       {"centre_of_mass_x_mm", c.x()},
                       {"centre_of_mass_y_mm", c.y()},
                       {"centre_of_mass_z_mm", c.z()}});
    before.push_back({std::move(mesh), std::move(surface)});
  }
  verdict.figures.push_back({.name = "inserts", .words = "", .value = records});
  verdict.criteria.push_back(
      at_most("inserts_fit", "how deep what is put in reaches into the print or out of it, mm", worst_mm, kOverlap_mm));
  verdict.meaning.push_back("Of its " + number(verdict.body.mass_g, 2) + " g, " + number(mass_g, 2) +
                            " g are put in and not printed.");
  verdict.notes.push_back(
      "Assumed: what is put in cannot move, and nothing is changed to put it there. Glue it in, and weigh it: it should weigh " +
      number(mass_g, 1) + " g.");
}

}  // namespace rayrep::verify_detail
