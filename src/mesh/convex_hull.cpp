#include "mesh/convex_hull.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cassert>
#include <map>
#include <unordered_map>
#include <utility>

#include "mesh/predicates.h"
#include "rayrep/base/error.h"

namespace rayrep {
namespace {

using Eigen::Vector3d;
using Points = std::vector<Vector3d>;

struct Triangle {
  std::array<int, 3> corners;
  std::array<int, 3> beside;  ///< triangle across the side from corner k to k + 1
  Vector3d normal;            ///< outward, a unit vector
  std::vector<int> outside;   ///< points farther than the tolerance above it that no other triangle has
  bool alive = true;
};

/// The triangulated hull of some of the points, which grows by one at a time.
class Quickhull {
public:
  Quickhull(const Points& points, double tolerance) : points_(points), tolerance_(tolerance) {
    begin_with_four();
    for (std::size_t t = 0; t < triangles_.size(); ++t)  // new ones come at the end
      if (triangles_[t].alive && !triangles_[t].outside.empty()) add(static_cast<int>(t));
  }

  std::vector<Triangle> result() const {
    std::vector<int> place(triangles_.size(), -1);
    std::vector<Triangle> alive;
    for (std::size_t t = 0; t < triangles_.size(); ++t)
      if (triangles_[t].alive) {
        place[t] = static_cast<int>(alive.size());
        alive.push_back(triangles_[t]);
      }
    for (Triangle& t : alive)
      for (int& other : t.beside) other = place[static_cast<std::size_t>(other)];
    return alive;
  }

private:
  const Vector3d& at(int n) const { return points_[static_cast<std::size_t>(n)]; }
  Triangle& triangle(int t) { return triangles_[static_cast<std::size_t>(t)]; }
  double above(const Triangle& t, int p) const { return t.normal.dot(at(p) - at(t.corners[0])); }

  /// The point for which `value` is largest.
  template <typename Value>
  int farthest(const Value& value) const {
    int best = 0;
    double largest = -1;
    for (int n = 0; n < static_cast<int>(points_.size()); ++n)
      if (const double v = value(at(n)); v > largest) {
        largest = v;
        best = n;
      }
    return best;
  }

  int push(const std::array<int, 3>& corners) {
    const Vector3d& a = at(corners[0]);
    triangles_.push_back({corners, {-1, -1, -1}, (at(corners[1]) - a).cross(at(corners[2]) - a).normalized(), {}});
    return static_cast<int>(triangles_.size()) - 1;
  }

  void begin_with_four() {
    if (points_.empty()) throw_flat();
    const int a = farthest([this](const Vector3d& p) { return (p - points_[0]).norm(); });
    const int b = farthest([&](const Vector3d& p) { return (p - at(a)).norm(); });
    const Vector3d along = (at(b) - at(a)).normalized();
    const int c = farthest([&](const Vector3d& p) { return along.cross(p - at(a)).norm(); });
    const Vector3d normal = along.cross(at(c) - at(a)).normalized();
    const int d = farthest([&](const Vector3d& p) { return std::abs(normal.dot(p - at(a))); });
    if (!(std::abs(normal.dot(at(d) - at(a))) > tolerance_)) throw_flat();
    const bool below = orient3d(at(a), at(b), at(c), at(d)) < 0;
    const std::array<int, 4> v = below ? std::array{a, b, c, d} : std::array{a, c, b, d};
    for (const auto& corners :
         {std::array{v[0], v[1], v[2]}, std::array{v[0], v[3], v[1]}, std::array{v[1], v[3], v[2]}, std::array{v[2], v[3], v[0]}})
      push(corners);
    std::map<std::pair<int, int>, int> side;
    for (int t = 0; t < 4; ++t)
      for (std::size_t k = 0; k < 3; ++k) side[{triangle(t).corners[k], triangle(t).corners[(k + 1) % 3]}] = t;
    for (int t = 0; t < 4; ++t)
      for (std::size_t k = 0; k < 3; ++k)
        triangle(t).beside[k] = side.at({triangle(t).corners[(k + 1) % 3], triangle(t).corners[k]});
    std::vector<int> all(points_.size());
    for (std::size_t n = 0; n < all.size(); ++n) all[n] = static_cast<int>(n);
    give(all, 0);
  }

  [[noreturn]] static void throw_flat() { throw Error(ErrorCode::input, "The body is flat: it has no convex hull with a volume."); }

  /// Each of the points to one of the triangles from `first` on that it is above, if there is one.
  void give(const std::vector<int>& points, int first) {
    for (const int p : points) {
      int best = -1;
      double highest = tolerance_;
      for (int t = first; t < static_cast<int>(triangles_.size()); ++t)
        if (const double height = above(triangle(t), p); height > highest && sees(p, t)) {
          highest = height;
          best = t;
        }
      if (best >= 0) triangle(best).outside.push_back(p);
    }
  }

  /// The farthest point above a triangle; of those that are so, the one farthest off its middle: no point on an edge between
  /// others.
  int farthest_above(int t) {
    const Triangle& from = triangle(t);
    const Vector3d middle = (at(from.corners[0]) + at(from.corners[1]) + at(from.corners[2])) / 3;
    double highest = 0;
    for (const int p : from.outside) highest = std::max(highest, above(from, p));
    int best = -1;
    double off = -1;
    for (const int p : from.outside) {
      if (above(from, p) < highest - tolerance_ || (at(p) - middle).norm() <= off) continue;
      off = (at(p) - middle).norm();
      best = p;
    }
    return best;
  }

  bool sees(int point, int t) {
    const auto& c = triangle(t).corners;
    return orient3d(at(c[0]), at(c[1]), at(c[2]), at(point)) > 0;
  }

  /// Adds the farthest point above a triangle: what it sees makes room for triangles between it and the rim.
  void add(int above_triangle) {
    const int p = farthest_above(above_triangle);
    std::vector<int> seen{above_triangle};
    triangle(above_triangle).alive = false;
    struct Side {
      int from, to, beyond;
    };
    std::vector<Side> rim;
    for (std::size_t n = 0; n < seen.size(); ++n)
      for (std::size_t k = 0; k < 3; ++k) {
        const int other = triangle(seen[n]).beside[k];
        if (!triangle(other).alive) continue;
        if (sees(p, other)) {
          triangle(other).alive = false;
          seen.push_back(other);
        }
      }
    for (const int t : seen)
      for (std::size_t k = 0; k < 3; ++k)
        if (const int other = triangle(t).beside[k]; triangle(other).alive)
          rim.push_back({triangle(t).corners[k], triangle(t).corners[(k + 1) % 3], other});
    const int first = static_cast<int>(triangles_.size());
    std::unordered_map<int, int> begins;
    for (const Side& side : rim) {
      const int made = push({side.from, side.to, p});
      assert(!begins.contains(side.from));  // the rim is one loop
      begins[side.from] = made;
      triangle(made).beside[0] = side.beyond;
      auto& back = triangle(side.beyond);
      for (std::size_t k = 0; k < 3; ++k)
        if (back.corners[k] == side.to && back.corners[(k + 1) % 3] == side.from) back.beside[k] = made;
    }
    for (std::size_t n = 0; n < rim.size(); ++n) {
      const int made = first + static_cast<int>(n);
      const int next = begins.at(rim[n].to);
      triangle(made).beside[1] = next;
      triangle(next).beside[2] = made;
    }
    std::vector<int> homeless;
    for (const int t : seen)
      for (const int other : std::exchange(triangle(t).outside, {}))
        if (other != p) homeless.push_back(other);
    give(homeless, first);
  }

  const Points& points_;
  double tolerance_;
  std::vector<Triangle> triangles_;
};

/// Which triangles are one face: those around each of the largest whose corners lie near its plane.
std::vector<int> faces_of(const std::vector<Triangle>& triangles, const Points& points, double tolerance) {
  const auto at = [&points](int n) -> const Vector3d& { return points[static_cast<std::size_t>(n)]; };
  std::vector<std::pair<double, int>> order;
  for (std::size_t t = 0; t < triangles.size(); ++t) {
    const auto& c = triangles[t].corners;
    order.emplace_back(-(at(c[1]) - at(c[0])).cross(at(c[2]) - at(c[0])).norm(), static_cast<int>(t));
  }
  std::sort(order.begin(), order.end());
  std::vector<int> face(triangles.size(), -1);
  int count = 0;
  for (const auto& [minus_area, seed] : order) {
    if (face[static_cast<std::size_t>(seed)] >= 0) continue;
    const Triangle& plane = triangles[static_cast<std::size_t>(seed)];
    const auto near = [&](int t) {
      const auto& c = triangles[static_cast<std::size_t>(t)].corners;
      return std::all_of(c.begin(), c.end(),
                         [&](int v) { return std::abs(plane.normal.dot(at(v) - at(plane.corners[0]))) <= tolerance; });
    };
    std::vector<int> found{seed};
    face[static_cast<std::size_t>(seed)] = count;
    for (std::size_t n = 0; n < found.size(); ++n)
      for (const int other : triangles[static_cast<std::size_t>(found[n])].beside) {
        if (face[static_cast<std::size_t>(other)] >= 0 || !near(other)) continue;
        face[static_cast<std::size_t>(other)] = count;
        found.push_back(other);
      }
    ++count;
  }
  return face;
}

/// The loop around some triangles; empty where there is more than one, or one that meets itself.
std::vector<int> loop_around(const std::vector<int>& members, const std::vector<Triangle>& triangles,
                             const std::vector<int>& face) {
  std::unordered_map<int, int> next;
  for (const int t : members) {
    const Triangle& triangle = triangles[static_cast<std::size_t>(t)];
    for (std::size_t k = 0; k < 3; ++k) {
      if (face[static_cast<std::size_t>(triangle.beside[k])] == face[static_cast<std::size_t>(t)]) continue;
      if (!next.emplace(triangle.corners[k], triangle.corners[(k + 1) % 3]).second) return {};
    }
  }
  const Triangle& first = triangles[static_cast<std::size_t>(members.front())];
  std::vector<int> loop;
  for (const int start : first.corners)
    if (next.contains(start)) {
      for (int v = start; loop.empty() || v != start; v = next.at(v)) {
        loop.push_back(v);
        if (loop.size() > next.size()) return {};
      }
      break;
    }
  // A triangle within others has no corner on the rim.
  if (loop.empty() && !next.empty()) {
    const int start = std::min_element(next.begin(), next.end())->first;
    for (int v = start; loop.empty() || v != start; v = next.at(v)) loop.push_back(v);
  }
  return loop.size() == next.size() ? loop : std::vector<int>{};
}

/// The loop around each face. A face around which there is no single loop falls apart into its triangles.
std::vector<std::vector<int>> loops_of(const std::vector<Triangle>& triangles, std::vector<int> face) {
  std::vector<std::vector<int>> members(1 + static_cast<std::size_t>(*std::max_element(face.begin(), face.end())));
  for (std::size_t t = 0; t < face.size(); ++t) members[static_cast<std::size_t>(face[t])].push_back(static_cast<int>(t));
  std::vector<std::vector<int>> loops;
  for (std::size_t f = 0; f < members.size(); ++f) {
    loops.push_back(loop_around(members[f], triangles, face));
    if (!loops.back().empty()) continue;
    loops.pop_back();
    for (const int t : members[f]) {
      const auto& c = triangles[static_cast<std::size_t>(t)].corners;
      loops.push_back({c[0], c[1], c[2]});
    }
  }
  return loops;
}

/// Across which a polygon of which sides are given turns: Newell's normal.
Vector3d normal_of(const std::vector<int>& corners, const Points& points) {
  const Vector3d& origin = points[static_cast<std::size_t>(corners[0])];
  Vector3d sum = Vector3d::Zero();
  for (std::size_t k = 1; k + 1 < corners.size(); ++k)
    sum += (points[static_cast<std::size_t>(corners[k])] - origin).cross(points[static_cast<std::size_t>(corners[k + 1])] - origin);
  return sum.normalized();
}

}  // namespace

ConvexPolytope convex_hull(const std::vector<Eigen::Vector3d>& points, double tolerance_mm) {
  const std::vector<Triangle> triangles = Quickhull(points, tolerance_mm).result();
  ConvexPolytope hull;
  std::unordered_map<int, int> place;
  std::map<std::pair<int, int>, int> left_of;
  for (const std::vector<int>& loop : loops_of(triangles, faces_of(triangles, points, tolerance_mm))) {
    ConvexPolytope::Face face{normal_of(loop, points), {}};
    for (const int v : loop) {
      const auto [it, added] = place.try_emplace(v, static_cast<int>(hull.vertices.size()));
      if (added) hull.vertices.push_back(points[static_cast<std::size_t>(v)]);
      face.corners.push_back(it->second);
    }
    for (std::size_t k = 0; k < loop.size(); ++k)
      left_of[{face.corners[k], face.corners[(k + 1) % loop.size()]}] = static_cast<int>(hull.faces.size());
    hull.faces.push_back(std::move(face));
  }
  for (const auto& [side, left] : left_of)
    if (side.first < side.second) hull.edges.push_back({side.first, side.second, left, left_of.at({side.second, side.first})});
  return hull;
}

}  // namespace rayrep
