#include "mesh/surface_gap.h"

#include <tbb/parallel_for.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstddef>
#include <optional>

#include "mesh/cell_boxes.h"

// Triangles that follow each other in the mesh mostly lie together. Some of them at a time ask the surface for what is near, and
// what a plane keeps away from them is not looked at further.

namespace rayrep {
namespace {

using Eigen::Vector3d;

constexpr std::size_t kMost = 16;  // triangles in a cluster
constexpr double kSpan = 2;        // and how much larger than its first triangle, or the limit, it may be

/// Finds the triangles of a surface in a box.
class FacesNear {
public:
  /// @param asked  how many triangles are looked at: of many a tree of its own pays
  FacesNear(const SurfaceQuery& surface, std::size_t asked) : surface_(surface), grid_(surface.mesh()) {
    constexpr std::size_t kPays = 16;  // triangles of the surface for one that is looked at
    if (kPays * asked >= surface.mesh().triangles.size()) tree_.emplace(grid_, surface.mesh());
  }

  const SurfaceQuery& surface() const { return surface_; }
  const CellGrid& grid() const { return grid_; }

  /// Maybe some more; in an order that depends on the surface alone.
  void find(const Eigen::AlignedBox3d& box, std::vector<int>& found) const {
    if (tree_) return tree_->meeting(grid_.around(box), found);
    surface_.triangles_near(box.center(), 0.5 * box.diagonal().norm(), found);
    std::sort(found.begin(), found.end());
  }

private:
  const SurfaceQuery& surface_;
  CellGrid grid_;
  std::optional<BoxesInEights> tree_;
};

Eigen::AlignedBox3d grown(const Eigen::AlignedBox3d& box, double by_mm) {
  return {box.min() - Vector3d::Constant(by_mm), box.max() + Vector3d::Constant(by_mm)};
}

/// A triangle of the surface with its plane.
struct Face {
  int triangle;
  Corners3 corners;
  Eigen::AlignedBox3d box;
  Vector3d normal;  ///< of unit length, 0 where rounding may have tilted it
};

Eigen::AlignedBox3d box_of(const Corners3& t) { return {t[0].cwiseMin(t[1]).cwiseMin(t[2]), t[0].cwiseMax(t[1]).cwiseMax(t[2])}; }

/// Squared, without branches.
inline double distance2(const Eigen::AlignedBox3d& a, const Eigen::AlignedBox3d& b) {
  return (a.min() - b.max()).cwiseMax(b.min() - a.max()).cwiseMax(0).squaredNorm();
}

Vector3d safe_normal(const Corners3& t) {
  const Vector3d ab = t[1] - t[0];
  const Vector3d ac = t[2] - t[0];
  const Vector3d normal = ab.cross(ac);
  const double area2 = normal.squaredNorm();
  if (!(area2 > 1e-10 * ab.squaredNorm() * ac.squaredNorm())) return Vector3d::Zero();
  return normal / std::sqrt(area2);
}

/// How far a triangle stays from a plane; not above 0 where it reaches both sides.
double clearance(const Vector3d& origin, const Vector3d& normal, const Corners3& t) {
  const double a = normal.dot(t[0] - origin);
  const double b = normal.dot(t[1] - origin);
  const double c = normal.dot(t[2] - origin);
  return std::max(std::min({a, b, c}), -std::max({a, b, c}));
}

/// Whether two triangles are at least `limit_mm` apart, by planes between points that approach each other: those nearest to each
/// other's.
bool kept_apart(const Corners3& p, const Corners3& q, double limit_mm) {
  Vector3d at = (p[0] + p[1] + p[2]) / 3;
  for (int step = 0; step < 2; ++step) {
    Vector3d there;
    const double to_q = point_triangle_distance(at, q[0], q[1], q[2], &there);
    if (to_q < limit_mm) return false;
    if (clearance(there, (at - there) / to_q, p) >= limit_mm) return true;
    const double to_p = point_triangle_distance(there, p[0], p[1], p[2], &at);
    if (to_p < limit_mm) return false;
    if (clearance(at, (there - at) / to_p, q) >= limit_mm) return true;
  }
  return false;
}

/// Some triangles of the mesh and what of the surface is near them.
class Cluster {
public:
  Cluster(const Mesh& mesh, const FacesNear& near) : mesh_(mesh), near_(near), surface_(near.surface()) {}

  /// Takes as many of the triangles from `begin` on as lie together. @returns how many
  std::size_t take(const int* begin, const int* end, double limit_mm) {
    first_ = begin;
    Eigen::AlignedBox3d box;
    std::size_t count = 0;
    double span_mm = 0;
    std::array<int, 3 * kMost> vertices;
    std::size_t used = 0;
    for (; begin + count != end && count < kMost; ++count) {
      const Eigen::Vector3i& t = mesh_.triangles[begin[count]];
      Eigen::AlignedBox3d extended = box;
      for (const int v : t) extended.extend(mesh_.vertices[v]);
      const double size = extended.diagonal().norm();
      if (count == 0)
        span_mm = std::max(size, limit_mm);
      else if (size > kSpan * span_mm)
        break;
      box = extended;
      for (const int v : t)
        if (std::find(vertices.begin(), vertices.begin() + used, v) == vertices.begin() + used) vertices[used++] = v;
    }
    box_ = box;
    centre_ = box.center();
    points_.resize(static_cast<Eigen::Index>(used), 3);
    for (std::size_t n = 0; n < used; ++n) points_.row(static_cast<Eigen::Index>(n)) = mesh_.vertices[vertices[n]] - centre_;
    return count;
  }

  /// Finds the faces that may be nearer than `limit_mm` to one of its triangles.
  void look_around(double limit_mm) {
    near_.find(grown(box_, limit_mm), found_);
    faces_.clear();
    boxes_.clear();
    for (const int t : found_) {
      const Corners3 corners = corners_of(surface_.mesh(), t);
      const Eigen::AlignedBox3d box = box_of(corners);
      if (distance2(box, box_) >= limit_mm * limit_mm) continue;
      const Vector3d normal = safe_normal(corners);
      const double height = normal.dot(corners[0] - centre_);
      const auto along = (points_.col(0) * normal.x() + points_.col(1) * normal.y() + points_.col(2) * normal.z()).eval();
      if (along.minCoeff() - height >= limit_mm || height - along.maxCoeff() >= limit_mm) continue;
      if (faces_.size() % kEight == 0) boxes_.emplace_back();
      boxes_.back().set(faces_.size() % kEight, near_.grid().around(box));
      faces_.push_back({t, corners, box, normal});
    }
  }

  /// The face nearest to the k-th triangle, if it is nearer than `limit_mm`.
  NearestPair nearest(std::size_t k, double limit_mm) const {
    NearestPair best;
    if (faces_.empty()) return best;
    const Own own(corners_of(mesh_, first_[k]));
    const CellBox cells = near_.grid().around(grown(own.box, limit_mm));
    for (std::size_t eight = 0; eight < boxes_.size(); ++eight)
      for (std::uint32_t bits = meeting(boxes_[eight], cells); bits != 0; bits &= bits - 1)
        consider(own, faces_[eight * kEight + static_cast<std::size_t>(std::countr_zero(bits))], limit_mm, best);
    return best;
  }

private:
  /// One of the triangles of the mesh.
  struct Own {
    Corners3 corners;
    Eigen::AlignedBox3d box;
    Vector3d normal;
    explicit Own(const Corners3& c) : corners(c), box(box_of(c)), normal(safe_normal(c)) {}
  };

  /// Makes a face the nearest if it is nearer than that and the limit.
  void consider(const Own& own, const Face& face, double limit_mm, NearestPair& best) const {
    const double farther = surface_.farther().of(face.triangle);
    const double limit = std::min(limit_mm, best.distance_mm) - farther;
    if (limit <= 0 || distance2(own.box, face.box) >= limit * limit) return;
    if (clearance(face.corners[0], face.normal, own.corners) >= limit ||
        clearance(own.corners[0], own.normal, face.corners) >= limit || kept_apart(own.corners, face.corners, limit))
      return;
    NearestPair pair = triangle_distance(own.corners, face.corners);
    if (pair.distance_mm >= limit) return;
    if (farther > 0 && pair.distance_mm > 0) pair.on_second += farther / pair.distance_mm * (pair.on_second - pair.on_first);
    pair.distance_mm += farther;
    best = pair;
  }

  const Mesh& mesh_;
  const FacesNear& near_;
  const SurfaceQuery& surface_;
  const int* first_ = nullptr;                                                      ///< of its triangles
  Eigen::Matrix<double, Eigen::Dynamic, 3, Eigen::ColMajor, 3 * kMost, 3> points_;  ///< their corners, from the centre
  Eigen::AlignedBox3d box_;
  Vector3d centre_ = Vector3d::Zero();
  std::vector<int> found_;
  std::vector<Face> faces_;
  std::vector<EightBoxes> boxes_;  ///< of the faces
};

}  // namespace

double smallest_gap(const Mesh& mesh, const SurfaceQuery& surface, const Progress& progress) {
  if (mesh.triangles.empty() || surface.mesh().triangles.empty()) return HUGE_VAL;
  Eigen::AlignedBox3d box = bounding_box(mesh);
  box.extend(bounding_box(surface.mesh()));
  // Some of the corners first, so that little has to be looked at around the triangles.
  constexpr std::size_t kEvery = 8;
  constexpr std::size_t kBlock = 4096;       // triangles
  constexpr std::size_t kBlocksAtOnce = 16;  // with the smallest of those before: the same for any number of threads
  double smallest = 1.01 * box.diagonal().norm();
  const auto over_blocks = [&](const auto& body) {
    const std::size_t count = mesh.triangles.size();
    for (std::size_t first = 0; first < count; first += kBlock * kBlocksAtOnce) {
      progress.check();
      std::array<double, kBlocksAtOnce> found;
      found.fill(smallest);
      tbb::parallel_for(std::size_t{0}, kBlocksAtOnce, [&](std::size_t b) {
        body(std::min(first + b * kBlock, count), std::min(first + (b + 1) * kBlock, count), found[b]);
      });
      smallest = *std::min_element(found.begin(), found.end());
    }
  };
  over_blocks([&](std::size_t begin, std::size_t end, double& found) {
    for (std::size_t t = begin; t < end; t += kEvery)
      found = std::min(found, surface.closest(mesh.corner(t, 0), found).distance_mm);
  });
  const FacesNear near(surface, mesh.triangles.size());
  over_blocks([&](std::size_t begin, std::size_t end, double& found) {
    std::vector<int> triangles;
    for (std::size_t t = begin; t < end; ++t) triangles.push_back(static_cast<int>(t));
    Cluster cluster(mesh, near);
    for (const int* at = triangles.data(); at != triangles.data() + triangles.size() && found > 0;) {
      const std::size_t count = cluster.take(at, triangles.data() + triangles.size(), found);
      cluster.look_around((1 - 1e-9) * found);
      for (std::size_t k = 0; k < count; ++k) found = std::min(found, cluster.nearest(k, (1 - 1e-9) * found).distance_mm);
      at += count;
    }
  });
  return smallest;
}

std::vector<Gap> gaps_below(const Mesh& mesh, const std::vector<int>& chosen, const SurfaceQuery& surface, double limit_mm) {
  constexpr std::size_t kBlock = 1024;
  const FacesNear near(surface, chosen.size());
  std::vector<std::vector<Gap>> found((chosen.size() + kBlock - 1) / kBlock);
  tbb::parallel_for(std::size_t{0}, found.size(), [&](std::size_t b) {
    Cluster cluster(mesh, near);
    const int* const end = chosen.data() + std::min((b + 1) * kBlock, chosen.size());
    for (const int* at = chosen.data() + b * kBlock; at != end;) {
      const std::size_t count = cluster.take(at, end, limit_mm);
      cluster.look_around(limit_mm);
      for (std::size_t k = 0; k < count; ++k)
        if (const NearestPair pair = cluster.nearest(k, limit_mm); pair.distance_mm < limit_mm) found[b].push_back({at[k], pair});
      at += count;
    }
  });
  std::vector<Gap> gaps;
  for (const auto& part : found) gaps.insert(gaps.end(), part.begin(), part.end());
  return gaps;
}

}  // namespace rayrep
