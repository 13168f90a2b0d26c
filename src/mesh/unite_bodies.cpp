#include "mesh/unite_bodies.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numeric>
#include <utility>
#include <vector>

#include "base/text.h"
#include "mesh/close_pairs.h"
#include "mesh/crossing.h"
#include "mesh/decimate.h"
#include "mesh/orientation.h"
#include "mesh/shells.h"
#include "rayrep/mesh/boolean.h"
#include "rayrep/mesh/mesh_check.h"
#include "rayrep/mesh/surface_query.h"

namespace rayrep {
namespace {

using Eigen::AlignedBox3d;
using Eigen::Vector2d;
using Eigen::Vector3d;

/// Volume in common, over that of all: what is less is how flush faces were rounded.
constexpr double kLeastOverlap = 1e-9;

/// Of the diagonal: how far from the triangles that do without them corners may lie, as rounding has put them.
constexpr double kFlatFloat32 = 1e-8;
constexpr double kFlat = 1e-14;

/// Lines along which both solids are compared, along each side of the box.
constexpr int kLines = 24;
constexpr double kSameLength = 1e-5;   ///< of the diagonal
constexpr double kMostGrazing = 0.02;  ///< of the lines: those that run in a face tell nothing

/// The shells of a mesh and which of them are bodies that may have volume in common.
class Bodies {
public:
  explicit Bodies(const Mesh& mesh) : mesh_(mesh) {
    Mesh copy = mesh;
    const Orientation shells = orient_neighbours(copy);
    of_triangle_ = shells.of_triangle;
    count_ = shells.count;
    volumes_ = shell_volumes(mesh, of_triangle_, count_);
    boxes_.resize(volumes_.size());
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t)
      for (int k = 0; k < 3; ++k) boxes_[shell(t)].extend(mesh.corner(t, k));
  }

  double volume() const { return std::accumulate(volumes_.begin(), volumes_.end(), 0.0); }

  bool boxes_meet() const {
    std::vector<std::size_t> order;
    for (std::size_t s = 0; s < boxes_.size(); ++s)
      if (is_body(s)) order.push_back(s);
    std::sort(order.begin(), order.end(), [this](std::size_t a, std::size_t b) {
      return std::pair(boxes_[a].min().x(), a) < std::pair(boxes_[b].min().x(), b);
    });
    for (std::size_t i = 0; i < order.size(); ++i)
      for (std::size_t j = i + 1; j < order.size() && boxes_[order[j]].min().x() < boxes_[order[i]].max().x(); ++j)
        if (boxes_[order[i]].intersects(boxes_[order[j]])) return true;
    return false;
  }

  /// How many cross others, lie in the material of others, or are there twice.
  std::size_t meeting(const Progress& progress) {
    std::vector<char> meets(boxes_.size(), 0), twice(boxes_.size(), 0);
    for (const auto& [s, t] : crossing_pairs(mesh_, close_pairs(mesh_, progress))) {
      const std::size_t a = shell(static_cast<std::size_t>(s)), b = shell(static_cast<std::size_t>(t));
      if (a != b && is_body(a) && is_body(b)) meets[a] = meets[b] = 1;
      if (a == b && is_body(a) && same_corners(s, t)) meets[a] = twice[a] = 1;
    }
    ShellNesting nesting(mesh_, of_triangle_);
    Surroundings around;
    std::vector<char> seen(boxes_.size(), 0);
    for (std::size_t t = 0; t < mesh_.triangles.size(); ++t) {
      const std::size_t s = shell(t);
      if (std::exchange(seen[s], 1) || !is_body(s) || meets[s]) continue;
      progress.check();
      nesting.around(mesh_.corner(t, 0), static_cast<int>(s), around);
      if (around.winding <= 0) continue;
      meets[s] = 1;
      for (const Surroundings::Around& other : around.shells)
        if (is_body(static_cast<std::size_t>(other.shell))) meets[static_cast<std::size_t>(other.shell)] = 1;
    }
    return static_cast<std::size_t>(std::count(meets.begin(), meets.end(), 1) + std::count(twice.begin(), twice.end(), 1));
  }

private:
  std::size_t shell(std::size_t t) const { return static_cast<std::size_t>(of_triangle_[t]); }
  bool same_corners(int s, int t) const {
    Eigen::Vector3i a = mesh_.triangles[static_cast<std::size_t>(s)], b = mesh_.triangles[static_cast<std::size_t>(t)];
    std::sort(a.begin(), a.end());
    std::sort(b.begin(), b.end());
    return a == b;
  }
  bool is_body(std::size_t s) const { return volumes_[s] > 0; }

  const Mesh& mesh_;
  std::vector<int> of_triangle_;
  int count_ = 0;
  std::vector<double> volumes_;
  std::vector<AlignedBox3d> boxes_;
};

/// Without the corners in flat faces that what is inside now has left there. theory.md (152)
Mesh without_flat_corners(Mesh mesh, const Progress& progress) {
  const double error = (is_float32(mesh) ? kFlatFloat32 : kFlat) * bounding_box(mesh).diagonal().norm();
  DecimatedMesh few = decimated(mesh, {error, [](const Mesh& as_it_is) { return as_it_is; }}, progress);
  return few.crossing == 0 ? std::move(few.mesh) : std::move(mesh);
}

double volume_of(const Mesh& mesh) { return shell_volumes(mesh, std::vector<int>(mesh.triangles.size(), 0), 1).front(); }

/// Length of a vertical line in the solid.
double length_in(const SurfaceQuery& surface, const Vector2d& xy, std::vector<LineHit>& hits) {
  closed_line_hits(surface, xy, hits);
  double length = 0;
  int winding = 0;
  for (std::size_t n = 0; n + 1 < hits.size(); ++n) {
    winding += hits[n].sign;
    if (winding > 0) length += hits[n + 1].z_mm - hits[n].z_mm;
  }
  return length;
}

/// Whether two meshes are one solid, along lines.
bool same_solid(const Mesh& a, const Mesh& b, const Progress& progress) {
  const SurfaceQuery in_a(a), in_b(b);
  const AlignedBox3d box = bounding_box(a);
  const double tolerance = kSameLength * box.diagonal().norm();
  std::vector<LineHit> hits;
  int differ = 0;
  for (int i = 0; i < kLines; ++i)
    for (int j = 0; j < kLines; ++j) {
      progress.check();
      const Vector2d share((i + 0.5479) / kLines, (j + 0.4613) / kLines);  // in no plane of symmetry
      const Vector2d xy = box.min().head<2>() + share.cwiseProduct(box.sizes().head<2>());
      differ += std::abs(length_in(in_a, xy, hits) - length_in(in_b, xy, hits)) > tolerance;
    }
  return differ <= kMostGrazing * kLines * kLines;
}

}  // namespace

UnitedBodies united_bodies(const Mesh& mesh, bool twice, const Progress& progress) {
  UnitedBodies result;
  Bodies bodies(mesh);
  if (!twice && !bodies.boxes_meet()) return result;
  const std::size_t meeting = bodies.meeting(progress);
  if (meeting == 0) return result;
  const Mesh boundary = boundary_of_union(mesh, progress);  // knows what is a solid of its own: far less work where many overlap
  CombinedMesh united = combined({&boundary, 1}, {.float32 = is_float32(mesh)}, progress);
  if (bodies.volume() - volume_of(united.mesh) <= kLeastOverlap * bodies.volume()) return result;
  result.bodies = meeting;
  if (united.crossings + united.flat > 0)
    result.left =
        concat(plural(united.crossings, "pair", "pairs"), " of triangles would cross where they all but lie on each other");
  else if (!same_solid(mesh, united.mesh, progress))
    result.left = "what came of it was not the same solid";
  else
    result.mesh = without_flat_corners(std::move(united.mesh), progress);
  return result;
}

}  // namespace rayrep
