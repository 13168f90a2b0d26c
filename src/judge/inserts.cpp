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
#include "mesh/surface_gap.h"
#include "rayrep/mesh/surface_query.h"

namespace rayrep::verify_detail {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

// A printer does not see less.
constexpr double kOverlap_mm = 0.1;

// Asks how deep points and triangles lie within a closed surface, or outside of it.
class Depth {
public:
  Depth(const SurfaceQuery& surface, bool within) : surface_(surface), within_(within) {}

  double of(const Eigen::Vector3d& p) {
    constexpr double kTouches_mm = 1e-6;  // and what fills its room touches it everywhere: the quick answer first
    if (surface_.closest(p, kTouches_mm).triangle >= 0 || !lies_there(p)) return 0;
    return surface_.closest(p, kInfinity).distance_mm;
  }

  // Of the pieces of a triangle that the surface does not come near: cut in four until it does not, or all is within kOverlap_mm.
  double of(const Eigen::Matrix3d& corners) {
    const Eigen::Vector3d middle = corners.rowwise().mean();
    const double radius = (corners.colwise() - middle).colwise().norm().maxCoeff();
    if (surface_.closest(middle, radius).triangle < 0) return of(middle);
    if (radius <= kOverlap_mm) return 0;
    Eigen::Matrix3d halves;  // of the sides
    for (int k = 0; k < 3; ++k) halves.col(k) = 0.5 * (corners.col(k) + corners.col((k + 1) % 3));
    double most = of(halves);
    for (int k = 0; k < 3; ++k) {
      Eigen::Matrix3d piece;
      piece << corners.col(k), halves.col(k), halves.col((k + 2) % 3);
      most = std::max(most, of(piece));
    }
    return most;
  }

private:
  bool lies_there(const Eigen::Vector3d& p) const { return is_inside(surface_, p) == within_; }

  const SurfaceQuery& surface_;
  bool within_;
};

template <typename DepthOf>
double deepest(std::size_t count, const DepthOf& depth_of, const Progress& progress) {
  progress.check();
  return tbb::parallel_reduce(
      tbb::blocked_range<std::size_t>(0, count, 256), 0.0,
      [&](const auto& range, double most) { return std::max(most, depth_of(range)); },
      [](double a, double b) { return std::max(a, b); });
}

double deepest_corner(const Mesh& mesh, const SurfaceQuery& surface, bool within, const Progress& progress) {
  const auto depth_of = [&](const auto& range) {
    Depth depth(surface, within);
    double most = 0;
    for (std::size_t v = range.begin(); v < range.end(); ++v) most = std::max(most, depth.of(mesh.vertices[v]));
    return most;
  };
  return deepest(mesh.vertices.size(), depth_of, progress);
}

double deepest_piece(const Mesh& mesh, const SurfaceQuery& surface, const Progress& progress) {
  const auto depth_of = [&](const auto& range) {
    Depth depth(surface, true);
    double most = 0;
    for (std::size_t t = range.begin(); t < range.end(); ++t) {
      Eigen::Matrix3d corners;
      corners << mesh.corner(t, 0), mesh.corner(t, 1), mesh.corner(t, 2);
      most = std::max(most, depth.of(corners));
    }
    return most;
  };
  return deepest(mesh.triangles.size(), depth_of, progress);
}

// How deep an insert and something else reach into each other. Surfaces that do not meet leave each of them on one side of the
// other, so that corners tell; else what is thicker than 4 kOverlap_mm is not missed between them.
double overlap(const Mesh& insert, const SurfaceQuery& of_insert, const Mesh& other, const SurfaceQuery& of_other,
               const Progress& progress) {
  double most = std::max(deepest_corner(insert, of_other, true, progress), deepest_corner(other, of_insert, true, progress));
  if (smallest_gap(insert, of_other, progress) == 0) most = std::max(most, deepest_piece(insert, of_other, progress));
  return most;
}

}  // namespace

double deepest_outside(const Mesh& mesh, const SurfaceQuery& surface, const Progress& progress) {
  return deepest_corner(mesh, surface, false, progress);
}

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
    worst_mm = std::max(worst_mm, deepest_corner(mesh, outside, false, progress));
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
      grams(mass_g) + ".");
}

}  // namespace rayrep::verify_detail
