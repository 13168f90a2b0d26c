#include "mesh/polygon.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <utility>

#include "mesh/order.h"

namespace rayrep {
namespace {

/// A face whose corners lie further from a plane than this times its size is not flat: its surface depends on how it is split.
constexpr double kFlat = 1e-9;

/// A polygon seen along its Newell normal, counter-clockwise. A coordinate is dropped rather than the polygon turned,
/// so that the coordinates stay exact.
struct Projection {
  std::vector<Eigen::Vector2d> points;
  bool has_area = false;
  double bulge = 0;  ///< largest distance of a corner from the plane through the middle of the corners, relative to their box
};

double cross(const Eigen::Vector2d& a, const Eigen::Vector2d& b, const Eigen::Vector2d& c) {
  return (b.x() - a.x()) * (c.y() - a.y()) - (b.y() - a.y()) * (c.x() - a.x());
}

Projection project(std::span<const int> polygon, const Mesh& mesh) {
  const Eigen::Vector3d& origin = mesh.vertices[polygon[0]];
  Eigen::Vector3d normal = Eigen::Vector3d::Zero();
  for (std::size_t i = 1; i + 1 < polygon.size(); ++i)
    normal += (mesh.vertices[polygon[i]] - origin).cross(mesh.vertices[polygon[i + 1]] - origin);
  int axis = 0;
  const double largest = normal.cwiseAbs().maxCoeff(&axis);
  Projection result;
  result.has_area = std::isfinite(largest) && largest > 0;
  int u = (axis + 1) % 3;
  int v = (axis + 2) % 3;
  if (normal[axis] < 0) std::swap(u, v);
  result.points.reserve(polygon.size());
  Eigen::AlignedBox3d box;
  Eigen::Vector3d middle = Eigen::Vector3d::Zero();
  for (const int i : polygon) {
    result.points.emplace_back(mesh.vertices[i][u], mesh.vertices[i][v]);
    box.extend(mesh.vertices[i]);
    middle += (mesh.vertices[i] - origin) / static_cast<double>(polygon.size());
  }
  if (!result.has_area) return result;
  normal.normalize();
  for (const int i : polygon)
    result.bulge = std::max(result.bulge, std::abs(normal.dot(mesh.vertices[i] - origin - middle)) / box.diagonal().norm());
  return result;
}

/// The same polygon from its corner of smallest coordinates on, so that nothing depends on where the file starts it.
std::vector<int> from_first_corner(std::span<const int> polygon, const Mesh& mesh) {
  const auto earlier = [&](int a, int b) { return comes_first(mesh.vertices[a], mesh.vertices[b]); };
  const std::size_t n = polygon.size();
  std::size_t best = 0;
  for (std::size_t i = 1; i < n; ++i) {
    // Corners repeat where a hole is joined by a double edge: then the one that follows decides.
    const bool same = mesh.vertices[polygon[i]] == mesh.vertices[polygon[best]];
    if (same ? earlier(polygon[(i + 1) % n], polygon[(best + 1) % n]) : earlier(polygon[i], polygon[best])) best = i;
  }
  std::vector<int> result(polygon.begin(), polygon.end());
  std::rotate(result.begin(), result.begin() + static_cast<std::ptrdiff_t>(best), result.end());
  return result;
}

/// True if the quad from its first corner on is better split from its second to its fourth corner: along the shorter diagonal that
/// runs inside.
bool splits_at_second(const std::vector<int>& quad, const Mesh& mesh, const std::vector<Eigen::Vector2d>& p) {
  const bool first = cross(p[0], p[1], p[2]) > 0 && cross(p[0], p[2], p[3]) > 0;
  const bool second = cross(p[1], p[2], p[3]) > 0 && cross(p[1], p[3], p[0]) > 0;
  if (first != second) return second;
  const auto length = [&](int a, int b) { return (mesh.vertices[quad[a]] - mesh.vertices[quad[b]]).squaredNorm(); };
  return length(1, 3) < length(0, 2);
}

bool is_strictly_convex(const std::vector<Eigen::Vector2d>& p) {
  for (std::size_t i = 0, n = p.size(); i < n; ++i)
    if (!(cross(p[i], p[(i + 1) % n], p[(i + 2) % n]) > 0)) return false;
  return true;
}

/// Points in square cells, about one each, to find those in a box.
class Grid {
public:
  explicit Grid(const std::vector<Eigen::Vector2d>& points) {
    for (const auto& p : points) box_.extend(p);
    const double cells = std::sqrt(static_cast<double>(points.size()));
    columns_ = static_cast<int>(cells) + 1;
    const Eigen::Vector2d size = box_.sizes();
    for (int k = 0; k < 2; ++k) per_length_[k] = size[k] > 0 && std::isfinite(size[k]) ? cells / size[k] : 0;
    first_.assign(static_cast<std::size_t>(columns_) * columns_ + 1, 0);
    for (const auto& p : points) ++first_[cell(column(p.x(), 0), column(p.y(), 1)) + 1];
    for (std::size_t c = 1; c < first_.size(); ++c) first_[c] += first_[c - 1];
    points_.resize(points.size());
    std::vector<std::size_t> next = first_;
    for (std::size_t i = 0; i < points.size(); ++i) points_[next[cell(column(points[i].x(), 0), column(points[i].y(), 1))]++] = i;
  }

  /// True if found(i) holds for any of the points in the cells that a triangle touches.
  template <class Found>
  bool any_in(const std::array<Eigen::Vector2d, 3>& triangle, const Found& found) const {
    Eigen::AlignedBox2d box;
    for (const auto& p : triangle) box.extend(p);
    const int top = column(box.max().y(), 1);
    for (int y = column(box.min().y(), 1); y <= top; ++y) {
      // Only the stretch of the row that the triangle crosses, since an ear may be long and thin; a cell more for rounding.
      const auto [low, high] = extent_in_row(triangle, y);
      const int right = std::min(column(high, 0) + 1, columns_ - 1);
      for (int x = std::max(column(low, 0) - 1, 0); x <= right; ++x)
        for (std::size_t n = first_[cell(x, y)]; n < first_[cell(x, y) + 1]; ++n)
          if (found(points_[n])) return true;
    }
    return false;
  }

private:
  /// Monotonic, so that a point in the box lies in one of its cells; NaN in column 0.
  int column(double coordinate, int axis) const {
    const double cells = (coordinate - box_.min()[axis]) * per_length_[axis];
    return cells > 0 ? static_cast<int>(std::min<double>(cells, columns_ - 1)) : 0;
  }
  /// Smallest and largest x of a triangle between the heights of a row, which are taken a little wider.
  std::pair<double, double> extent_in_row(const std::array<Eigen::Vector2d, 3>& triangle, int row) const {
    if (per_length_[1] == 0) return {box_.min().x(), box_.max().x()};
    const double bottom = box_.min().y() + (row - 0.01) / per_length_[1];
    const double top = box_.min().y() + (row + 1.01) / per_length_[1];
    double low = box_.max().x();
    double high = box_.min().x();
    for (std::size_t k = 0; k < 3; ++k) {
      const auto& p = triangle[k];
      const auto& q = triangle[(k + 1) % 3];
      for (const double level : {p.y(), q.y(), bottom, top}) {
        if (level < bottom || level > top || level < std::min(p.y(), q.y()) || level > std::max(p.y(), q.y())) continue;
        const double rise = q.y() - p.y();
        const double x = rise == 0 ? p.x() : p.x() + (level - p.y()) / rise * (q.x() - p.x());
        low = std::min(low, x);
        high = std::max(high, x);
        if (rise == 0) {
          low = std::min(low, q.x());
          high = std::max(high, q.x());
        }
      }
    }
    return {low, high};
  }
  std::size_t cell(int x, int y) const { return static_cast<std::size_t>(y) * columns_ + x; }

  Eigen::AlignedBox2d box_;
  Eigen::Vector2d per_length_;
  int columns_ = 1;
  std::vector<std::size_t> first_;  ///< of each cell, into points_
  std::vector<std::size_t> points_;
};

/// Cuts ears off one polygon; the corners that remain form a ring of indices.
class EarClipper {
public:
  explicit EarClipper(const std::vector<Eigen::Vector2d>& points)
      : p_(points), grid_(points), gone_(p_.size()), before_(p_.size()), after_(p_.size()) {
    for (std::size_t i = 0, n = p_.size(); i < n; ++i) {
      before_[i] = (i + n - 1) % n;
      after_[i] = (i + 1) % n;
    }
    ear_.resize(p_.size());
    find_ears(0, p_.size());
  }

  /// Calls emit(a, b, c) for each of the n - 2 triangles.
  template <class Emit>
  void clip_all(const Emit& emit) {
    std::size_t at = 0;
    int searches = 8;
    for (std::size_t left = p_.size(); left > 3; --left) {
      at = next_ear(at, left);
      // Cutting an ear changes its two neighbours only, unless corners lie on the edges of others: then look again, but
      // not for ever. Without an ear the polygon crosses itself or has no area, and any corner will do.
      if (!ear_[at] && searches > 0) {
        --searches;
        find_ears(at, left);
        at = next_ear(at, left);
      }
      const std::size_t a = before_[at];
      const std::size_t c = after_[at];
      emit(a, at, c);
      after_[a] = c;
      before_[c] = a;
      gone_[at] = true;
      ear_[a] = is_ear(a);
      ear_[c] = is_ear(c);
      at = after_[c];  // not c: alternating corners makes fewer slivers
    }
    emit(before_[at], at, after_[at]);
  }

private:
  void find_ears(std::size_t at, std::size_t left) {
    for (; left > 0; --left, at = after_[at]) ear_[at] = is_ear(at);
  }

  std::size_t next_ear(std::size_t at, std::size_t left) const {
    while (!ear_[at] && left-- > 0) at = after_[at];
    return at;
  }

  bool is_ear(std::size_t i) const {
    const auto& a = p_[before_[i]];
    const auto& b = p_[i];
    const auto& c = p_[after_[i]];
    if (!(cross(a, b, c) > 0)) return false;
    return !grid_.any_in({a, b, c}, [&](std::size_t j) {
      const auto& q = p_[j];
      // Corners repeat where a hole is joined to the outline by a double edge; such a twin blocks nothing.
      if (gone_[j] || q == a || q == b || q == c) return false;
      return cross(a, b, q) >= 0 && cross(b, c, q) >= 0 && cross(c, a, q) >= 0;
    });
  }

  const std::vector<Eigen::Vector2d>& p_;
  Grid grid_;
  std::vector<bool> gone_;
  std::vector<std::size_t> before_;
  std::vector<std::size_t> after_;
  std::vector<bool> ear_;
};

}  // namespace

double append_triangulated(std::span<const int> polygon, Mesh& mesh) {
  assert(polygon.size() >= 3);
  const auto emit = [&](std::size_t a, std::size_t b, std::size_t c) {
    mesh.triangles.emplace_back(polygon[a], polygon[b], polygon[c]);
  };
  if (polygon.size() == 3) {
    emit(0, 1, 2);
    return 0;
  }
  Projection seen = project(polygon, mesh);
  std::vector<int> reordered;
  if (seen.bulge > kFlat) {
    reordered = from_first_corner(polygon, mesh);
    polygon = reordered;
    seen = project(polygon, mesh);
    if (polygon.size() == 4) {
      const std::size_t second = splits_at_second(reordered, mesh, seen.points) ? 1 : 0;
      emit(second, second + 1, second + 2);
      emit(second, second + 2, (second + 3) % 4);
      return seen.bulge;
    }
  }
  if (!seen.has_area || is_strictly_convex(seen.points)) {
    for (std::size_t i = 1; i + 1 < polygon.size(); ++i) emit(0, i, i + 1);
  } else {
    EarClipper(seen.points).clip_all(emit);
  }
  return seen.bulge;
}

}  // namespace rayrep
