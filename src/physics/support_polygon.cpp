#include "rayrep/physics/support_polygon.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>
#include <numbers>
#include <tuple>
#include <utility>

#include "mesh/predicates.h"
#include "rayrep/base/error.h"

namespace rayrep {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;
using Polygon = std::vector<Vector2d>;  // convex, counter-clockwise

double cross(const Vector2d& a, const Vector2d& b) { return a.x() * b.y() - a.y() * b.x(); }

// In plan, the corners of what lies no higher than `top` of every triangle.
Polygon points_below(const Mesh& mesh, double top) {
  Polygon points;
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t)
    for (int k = 0; k < 3; ++k) {
      const Vector3d& a = mesh.corner(t, k);
      const Vector3d& b = mesh.corner(t, (k + 1) % 3);
      if (a.z() <= top) points.emplace_back(a.head<2>());
      if ((a.z() <= top) == (b.z() <= top)) continue;
      const auto& [low, high] = a.z() < b.z() ? std::tie(a, b) : std::tie(b, a);  // the same point for both triangles of the edge
      points.emplace_back((low + (top - low.z()) / (high.z() - low.z()) * (high - low)).head<2>());
    }
  return points;
}

// Andrew's monotone chain, with exact signs.
Polygon convex_hull(Polygon points) {
  const auto less = [](const Vector2d& a, const Vector2d& b) { return a.x() < b.x() || (a.x() == b.x() && a.y() < b.y()); };
  std::sort(points.begin(), points.end(), less);
  points.erase(std::unique(points.begin(), points.end()), points.end());
  if (points.size() < 3) return points;
  Polygon hull;
  const auto add = [&hull](const Vector2d& p, std::size_t keep) {
    while (hull.size() > keep && orient2d(hull[hull.size() - 2], hull.back(), p) <= 0) hull.pop_back();
    hull.push_back(p);
  };
  for (const Vector2d& p : points) add(p, 1);
  const std::size_t lower = hull.size();
  for (auto p = points.rbegin() + 1; p != points.rend(); ++p) add(*p, lower);
  hull.pop_back();
  return hull;
}

std::size_t farthest_from(const Polygon& points, const Vector2d& p) {
  std::size_t farthest = 0;
  for (std::size_t i = 1; i < points.size(); ++i)
    if ((points[i] - p).squaredNorm() > (points[farthest] - p).squaredNorm()) farthest = i;
  return farthest;
}

// Appends corners first + 1 ... last of the hull (cyclic), without those that the chords between the others pass by `tolerance`.
void append_chain(const Polygon& hull, std::size_t first, std::size_t last, double tolerance, Polygon& out) {
  std::vector<std::size_t> ends = {last};  // a stack: chords may be as many as corners
  while (!ends.empty()) {
    const Vector2d& a = hull[first % hull.size()];
    const Vector2d along = (hull[ends.back() % hull.size()] - a).normalized();
    std::size_t farthest = first;
    double distance = tolerance;
    for (std::size_t i = first + 1; i < ends.back(); ++i)
      if (const double d = std::abs(cross(along, hull[i % hull.size()] - a)); d > distance) {
        distance = d;
        farthest = i;
      }
    if (farthest != first) {
      ends.push_back(farthest);
    } else {
      first = ends.back();
      out.push_back(hull[first % hull.size()]);
      ends.pop_back();
    }
  }
}

// Douglas and Peucker, from two corners that are none's neighbours on a line: each is the farthest from somewhere.
Polygon without_collinear(const Polygon& hull, double tolerance) {
  if (hull.size() < 2) return hull;
  const std::size_t first = farthest_from(hull, hull.front());
  const std::size_t second = farthest_from(hull, hull[first]);
  if ((hull[second] - hull[first]).norm() <= tolerance) return {hull[first]};
  Polygon out;
  const std::size_t middle = second > first ? second : second + hull.size();
  append_chain(hull, first, middle, tolerance, out);
  append_chain(hull, middle, first + hull.size(), tolerance, out);
  // Where a chord runs along an edge, a point of the edge may have come out as the farthest one.
  const auto height = [&out](std::size_t k) {
    const Vector2d& before = out[(k + out.size() - 1) % out.size()];
    return std::abs(cross((out[(k + 1) % out.size()] - before).normalized(), out[k] - before));
  };
  while (out.size() > 2) {
    std::size_t lowest = 0;
    for (std::size_t k = 1; k < out.size(); ++k)
      if (height(k) < height(lowest)) lowest = k;
    if (height(lowest) > 0.1 * tolerance) break;
    out.erase(out.begin() + static_cast<std::ptrdiff_t>(lowest));
  }
  std::rotate(
      out.begin(),
      std::min_element(out.begin(), out.end(),
                       [](const Vector2d& a, const Vector2d& b) { return a.x() < b.x() || (a.x() == b.x() && a.y() < b.y()); }),
      out.end());
  return out;
}

struct Range {
  double min = std::numeric_limits<double>::infinity();
  double max = -std::numeric_limits<double>::infinity();
  double length() const { return max - min; }
  double middle() const { return (min + max) / 2; }
};

Range range_along(const Polygon& points, const Vector2d& direction) {
  Range range;
  for (const Vector2d& p : points) {
    range.min = std::min(range.min, direction.dot(p));
    range.max = std::max(range.max, direction.dot(p));
  }
  return range;
}

// The direction of the edge along which a convex polygon is narrowest. Calipers: the corner farthest from an edge only moves on.
Vector2d narrowest_along(const Polygon& polygon) {
  const std::size_t n = polygon.size();
  Vector2d best = (polygon[1 % n] - polygon[0]).normalized();
  double width = std::numeric_limits<double>::infinity();
  std::size_t far = 0;
  for (std::size_t k = 0; k < n; ++k) {
    const Vector2d along = (polygon[(k + 1) % n] - polygon[k]).normalized();
    const auto height = [&](std::size_t i) { return cross(along, polygon[i % n] - polygon[k]); };
    far = std::max(far, k + 1);
    while (far < k + n && height(far + 1) > height(far)) ++far;
    if (height(far) < width) {
      width = height(far);
      best = along;
    }
  }
  return best;
}

double area(const Polygon& polygon) {
  double twice = 0;
  for (std::size_t k = 0; k + 1 < polygon.size(); ++k) twice += cross(polygon[k] - polygon[0], polygon[k + 1] - polygon[0]);
  return twice / 2;
}

// A convex polygon whose edges have moved inward by r: those edges that are left.
struct Inset {
  double r_mm = 0;
  std::vector<std::size_t> edges;  // ascending, edge k from corner k to k + 1
};

// Moves all edges inward at the same speed, by `limit_mm` at most or until nothing is left. The length of an edge between two turns
// of the boundary by angles t1 and t2 falls by tan(t1/2) + tan(t2/2) for each mm; when it is used up the turns add up.
Inset inset(const Polygon& polygon, double limit_mm) {
  struct Edge {
    std::size_t previous, next;
    double turn;    // between this edge and the next one
    double length;  // at r = 0, if its neighbours had always been its neighbours
    bool left = true;
  };
  const std::size_t n = polygon.size();
  std::vector<Edge> edges(n);
  for (std::size_t k = 0; k < n; ++k) {
    const Vector2d here = polygon[(k + 1) % n] - polygon[k];
    const Vector2d after = polygon[(k + 2) % n] - polygon[(k + 1) % n];
    edges[k] = {(k + n - 1) % n, (k + 1) % n, std::atan2(cross(here, after), here.dot(after)), here.norm()};
  }
  const auto rate = [&](const Edge& e) { return std::tan(edges[e.previous].turn / 2) + std::tan(e.turn / 2); };
  Inset result;
  for (std::size_t left = n; left > 2; --left) {
    std::size_t shortest = 0;
    double r = std::numeric_limits<double>::infinity();
    for (std::size_t k = 0; k < n; ++k)
      if (edges[k].left)
        if (const double used_up = edges[k].length / rate(edges[k]); used_up < r) {
          r = used_up;
          shortest = k;
        }
    if (r > limit_mm) {
      result.r_mm = limit_mm;
      break;
    }
    result.r_mm = std::max(result.r_mm, r);
    Edge& gone = edges[shortest];
    Edge& before = edges[gone.previous];
    Edge& after = edges[gone.next];
    if (before.turn + gone.turn > std::numbers::pi - 1e-12) break;  // its neighbours face each other: nothing is left between them
    const double before_length = before.length - r * rate(before);
    const double after_length = after.length - r * rate(after);
    gone.left = false;
    before.turn += gone.turn;
    before.next = gone.next;
    after.previous = gone.previous;
    before.length = before_length + r * rate(before);
    after.length = after_length + r * rate(after);
  }
  for (std::size_t k = 0; k < n; ++k)
    if (edges[k].left) result.edges.push_back(k);
  return result;
}

// The middle of a segment, or of what is nearly a point: of two points as far apart as they come.
Vector2d middle_of(const Polygon& points) {
  const Vector2d& one = points[farthest_from(points, points.front())];
  return (one + points[farthest_from(points, one)]) / 2;
}

}  // namespace

std::vector<double> SupportPolygon::edge_distances_mm(const Vector2d& p) const {
  if (corners_mm.size() == 1) return {-(p - corners_mm[0]).norm()};
  std::vector<double> distances;
  for (std::size_t k = 0; k < corners_mm.size(); ++k)
    distances.push_back(cross((corners_mm[(k + 1) % corners_mm.size()] - corners_mm[k]).normalized(), p - corners_mm[k]));
  return distances;
}

Vector2d SupportPolygon::safest_point_mm() const {
  assert(!corners_mm.empty());
  if (corners_mm.size() < 3) return middle_of(corners_mm);
  // Just before nothing is left, what is left is the set of the best centres, but with corners that can be worked out.
  const double almost = (1 - 1e-11) * inset(corners_mm, std::numeric_limits<double>::infinity()).r_mm;
  const std::vector<std::size_t> edges = inset(corners_mm, almost).edges;
  Polygon centres;
  for (std::size_t i = 0; i < edges.size(); ++i) {
    // Where two edges meet, each moved inward.
    const auto line = [&](std::size_t k, Vector2d& along, Vector2d& through) {
      along = (corners_mm[(k + 1) % corners_mm.size()] - corners_mm[k]).normalized();
      through = corners_mm[k] + almost * Vector2d(-along.y(), along.x());
    };
    Vector2d u, v, p, q;
    line(edges[i], u, p);
    line(edges[(i + 1) % edges.size()], v, q);
    centres.push_back(p + cross(q - p, v) / cross(u, v) * u);
  }
  return middle_of(centres);
}

double contact_tolerance_mm(double height_mm) { return std::max(std::min(0.15, 5e-3 * height_mm), 1e-4 * height_mm); }

SupportPolygon support_polygon(const Mesh& mesh, double tolerance_mm) {
  assert(tolerance_mm >= 0);
  if (mesh.triangles.empty()) throw Error(ErrorCode::input, "The mesh has no triangles: it stands on nothing.");
  const Vector3d* lowest = &mesh.corner(0, 0);
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t)
    for (int k = 0; k < 3; ++k) {
      const Vector3d& p = mesh.corner(t, k);
      if (!p.allFinite()) throw Error(ErrorCode::input, "The mesh has coordinates that are not finite.");
      if (p.z() < lowest->z()) lowest = &p;
    }
  SupportPolygon result;
  result.ground_mm = lowest->z();
  const auto contact = [&](double tolerance) {
    const Polygon hull = convex_hull(points_below(mesh, lowest->z() + tolerance));
    const double size_mm = 2 * (hull[farthest_from(hull, hull.front())] - hull.front()).norm();
    return without_collinear(hull, std::max(0.01 * tolerance_mm, 1e-12 * size_mm));
  };
  Polygon polygon = contact(tolerance_mm);

  if (polygon.size() > 1) {
    constexpr double slope = 0.25 * std::numbers::pi / 180;
    constexpr double small = 0.1;  // a generous tolerance is meant to make a rough base stand
    const double widest_mm = std::min(2 * tolerance_mm / slope, small * bounding_box(mesh).diagonal().norm());
    const Polygon inner = contact(tolerance_mm / 2);
    // To a half on a tip, to 0.71 on a round bottom; where feet come and go with the tolerance, to nothing or not at all.
    const auto shrinks = [&](const Vector2d& direction) {
      const double length_mm = range_along(polygon, direction).length();
      const double ratio = range_along(inner, direction).length() / length_mm;
      return length_mm <= widest_mm && ratio > 0.4 && ratio < 0.8;
    };
    const Vector2d along = narrowest_along(polygon);
    const Vector2d across(-along.y(), along.x());
    const bool narrow = polygon.size() == 2 || shrinks(across);
    if (narrow && shrinks(along)) {
      polygon = {lowest->head<2>()};
    } else if (narrow && polygon.size() > 2) {
      const Range ends = range_along(inner, along);
      const Vector2d middle = range_along(inner, across).middle() * across;
      polygon = {middle + ends.min * along, middle + ends.max * along};
    }
  }
  result.corners_mm = std::move(polygon);
  result.area_mm2 = area(result.corners_mm);
  return result;
}

std::vector<double> tipping_angles_rad(const SupportPolygon& polygon, const Vector3d& centre_of_mass_mm) {
  std::vector<double> angles = polygon.edge_distances_mm(centre_of_mass_mm.head<2>());
  for (double& a : angles) a = std::atan2(a, centre_of_mass_mm.z() - polygon.ground_mm);
  return angles;
}

}  // namespace rayrep
