#include <tbb/parallel_for.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <vector>

#include "mesh/point_tree.h"
#include "mesh/quadric_clip.h"
#include "mesh/quadric_landing.h"

namespace rayrep {
namespace {

using Eigen::Vector3d;
using On = QuadricClipped::On;

/// By more than 60 degrees, where it is no needle thinner than the error.
bool is_turned(const Mesh& before, const Mesh& after, std::size_t t, double error_mm) {
  const auto area = [t](const Mesh& mesh) -> Vector3d {
    return (mesh.corner(t, 1) - mesh.corner(t, 0)).cross(mesh.corner(t, 2) - mesh.corner(t, 0));
  };
  const Vector3d now = area(after);
  const Vector3d then = area(before);
  if (now.dot(then) >= 0.5 * now.norm() * then.norm()) return false;
  double longest = 0;
  for (int k = 0; k < 3; ++k) longest = std::max(longest, (after.corner(t, k) - after.corner(t, (k + 1) % 3)).norm());
  return now.norm() > error_mm * longest;
}

/// How far the points of creases have gone, for what is near to them. theory.md (140)
class Ways {
public:
  /// Keeps a reference to `from`.
  Ways(const std::vector<Vector3d>& from, const std::vector<Vector3d>& to, const std::vector<On>& on)
      : from_(from), way_(from.size(), Vector3d::Zero()), tree_(from, creases(on)) {
    constexpr double kReach = 4;  // times the way: what is near is not folded
    for (std::size_t n = 0; n < from.size(); ++n)
      if (on[n] == On::crease) {
        way_[n] = to[n] - from[n];
        reach_mm_ = std::max(reach_mm_, kReach * way_[n].norm());
      }
  }

  /// Of a point that goes along with the creases near to it, the less the farther it is from them.
  Vector3d at(const Vector3d& p) const {
    std::vector<int> near;
    if (reach_mm_ > 0) tree_.near_segment(p, p, reach_mm_, near);
    Vector3d sum = Vector3d::Zero();
    double weights = 0;
    double largest = 0;
    for (const int n : near) {
      const double share = std::max(0.0, 1 - (from_[n] - p).norm() / reach_mm_);
      const double weight = share * share * share * share;
      sum += weight * way_[n];
      weights += weight;
      largest = std::max(largest, share);
    }
    return weights > 0 ? Vector3d(largest / weights * sum) : Vector3d::Zero();
  }

private:
  static std::vector<int> creases(const std::vector<On>& on) {
    std::vector<int> numbers;
    for (std::size_t n = 0; n < on.size(); ++n)
      if (on[n] == On::crease) numbers.push_back(static_cast<int>(n));
    return numbers;
  }

  const std::vector<Vector3d>& from_;
  std::vector<Vector3d> way_;
  PointTree tree_;
  double reach_mm_ = 0;
};

/// Goes a way along the surface, as far from it as before, and on to where it is above f = 0 if that is near.
Vector3d along_surface(const Vector3d& p, const Vector3d& way, const Quadric& f, const QuadricClipOptions& options) {
  constexpr double kLeast = 0.05;  // of the error
  constexpr double kLeastSine2 = 0.01;
  const auto before = options.surface(p);
  const auto there = before ? options.surface(p + way) : before;
  if (!there) return p;
  Vector3d end = p + way + (before->height_mm - there->height_mm) * there->normal;
  const double missing = kLeast * options.error_mm - f.distance(end);
  const Vector3d up = f.gradient(end).normalized();
  const Vector3d along = up - up.dot(there->normal) * there->normal;
  if (missing > 0 && along.squaredNorm() > kLeastSine2) end += missing / along.squaredNorm() * along;
  return end;
}

/// Moves what is near to creases by what these have moved.
void carry_along(QuadricClipped& clipped, const std::vector<Vector3d>& before, const Quadric& f,
                 const QuadricClipOptions& options) {
  std::vector<Vector3d>& vertices = clipped.mesh.vertices;
  const Ways ways(before, vertices, clipped.on);
  tbb::parallel_for(std::size_t{0}, vertices.size(), [&](std::size_t n) {
    if (clipped.on[n] == On::crease) return;
    const Vector3d way = ways.at(before[n]);
    if (way == Vector3d::Zero()) return;
    if (clipped.on[n] == On::cap) {
      vertices[n] = f.nearest(before[n] + way);
    } else if (options.surface) {
      vertices[n] = along_surface(before[n], way, f, options);
      clipped.is_new[n] = 1;
    }
  });
}

}  // namespace

bool follow(QuadricClipped& clipped, const Quadric& f, const QuadricClipOptions& options, bool carry) {
  constexpr double kReach = 8;  // times the way to f = 0: the curve goes farther where the surfaces meet at a sharp angle
  const QuadricLanding land(f, options);
  const Mesh before = clipped.mesh;
  std::vector<Vector3d>& vertices = clipped.mesh.vertices;
  tbb::parallel_for(std::size_t{0}, vertices.size(), [&](std::size_t n) {
    if (clipped.on[n] == On::surface) return;
    Vector3d& p = vertices[n];
    if (clipped.on[n] == On::crease) {
      if (const auto moved = land.on_curve(p, options.error_mm + kReach * std::abs(f.distance(p)))) {
        p = *moved;
        return;
      }
      clipped.on[n] = On::cap;
    }
    p = f.nearest(p);
  });
  if (carry) carry_along(clipped, before.vertices, f, options);
  for (std::size_t t = 0; t < before.triangles.size(); ++t)
    if (is_turned(before, clipped.mesh, t, options.error_mm)) return false;
  return true;
}

}  // namespace rayrep
