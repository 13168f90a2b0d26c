#include "physics/pockets.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <optional>
#include <tuple>
#include <utility>

#include "base/union_find.h"

namespace rayrep {

Frame frame_of(const Eigen::Vector3d& normal) {
  int smallest = 0;
  normal.cwiseAbs().minCoeff(&smallest);
  const Eigen::Vector3d u = normal.cross(Eigen::Vector3d::Unit(smallest)).normalized();
  return {u, normal.cross(u), normal};
}

std::vector<char> pinched_vertices(const std::vector<Eigen::Vector3i>& triangles, std::size_t vertices) {
  Mesh mesh;
  mesh.vertices.resize(vertices);
  mesh.triangles = triangles;
  const VertexCorners at(mesh);
  std::vector<char> pinched(vertices, 0);
  for (std::size_t v = 0; v < vertices; ++v) {
    const int count = at.first[v + 1] - at.first[v];
    if (count == 0) continue;
    const auto beside = [&](int n, int k) {
      const int corner = at.corners[at.first[v] + n];
      return triangles[corner / 3][(corner % 3 + k) % 3];
    };
    int met = 1;
    int end = beside(0, 2);
    while (end != beside(0, 1) && met <= count) {
      int n = 0;
      while (n < count && beside(n, 1) != end) ++n;
      if (n == count) break;
      end = beside(n, 2);
      ++met;
    }
    pinched[v] = end != beside(0, 1) || met != count;
  }
  return pinched;
}

bool may_have_pockets(const std::vector<Eigen::Vector3i>& triangles, const std::vector<double>& heights,
                      const std::vector<double>& projected, const std::vector<char>& pinched, double below) {
  constexpr char has_lower_neighbour = 1;
  constexpr char is_lowest_of_one_that_faces_up = 2;
  std::vector<char> marks(heights.size(), 0);
  for (std::size_t t = 0; t < triangles.size(); ++t) {
    const Eigen::Vector3i& v = triangles[t];
    int lowest = v[0];
    for (int k = 1; k < 3; ++k)
      if (heights[v[k]] < heights[lowest] || (heights[v[k]] == heights[lowest] && v[k] < lowest)) lowest = v[k];
    for (int k = 0; k < 3; ++k)
      if (v[k] != lowest && !pinched[v[k]]) marks[v[k]] |= has_lower_neighbour;
    if (projected[t] > 0) marks[lowest] |= is_lowest_of_one_that_faces_up;
  }
  for (std::size_t i = 0; i < marks.size(); ++i)
    if (marks[i] == is_lowest_of_one_that_faces_up && heights[i] < below) return true;
  return false;
}

namespace {

// The angle of each use's triangle about the edge, from an arbitrary direction.
std::vector<double> angles_about_edge(const Mesh& mesh, const EdgeUse* uses, std::size_t count) {
  const Eigen::Vector3d& a = mesh.vertices[uses->low];
  const Frame frame = frame_of((mesh.vertices[uses->high] - a).normalized());
  std::vector<double> angles(count);
  for (std::size_t i = 0; i < count; ++i) {
    const Eigen::Vector3i& v = mesh.triangles[uses[i].triangle];
    int third = 0;
    while (third < 2 && (v[third] == uses[i].low || v[third] == uses[i].high)) ++third;
    const Eigen::Vector3d r = mesh.vertices[v[third]] - a;
    angles[i] = std::atan2(frame.v.dot(r), frame.u.dot(r));
  }
  return angles;
}

// Calls pair(use, use) for the two triangles that bound the same wedge of the outside at an edge, alone(use) for the others.
template <typename Pair, typename Alone>
void pair_across_edge(const Mesh& mesh, const EdgeUse* uses, std::size_t count, const Pair& pair, const Alone& alone) {
  if (count == 2 && uses[0].direction != uses[1].direction) {
    pair(uses[0], uses[1]);
    return;
  }
  // A triangle that runs along the edge has the outside on the side of larger angles, the others on that of smaller ones.
  const std::vector<double> angles = angles_about_edge(mesh, uses, count);
  std::vector<std::size_t> order(count);
  for (std::size_t i = 0; i < count; ++i) order[i] = i;
  std::sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
    return std::pair(angles[a], uses[a].direction) < std::pair(angles[b], uses[b].direction);
  });
  std::vector<bool> paired(count, false);
  for (std::size_t i = 0; i < count; ++i) {
    const std::size_t here = order[i];
    const std::size_t next = order[(i + 1) % count];
    if (uses[here].direction != 1 || uses[next].direction != -1) continue;
    pair(uses[here], uses[next]);
    paired[here] = paired[next] = true;
  }
  for (std::size_t i = 0; i < count; ++i)
    if (!paired[i]) alone(uses[i]);
}

// Rounding of positions, over the diagonal: what boundary_of_union cuts twice is this near.
constexpr double kSamePlace = 1e-10;

// The corners of a mesh, joined where sheets go on across an edge. Where an edge has no other side, as beside a T-junction, the
// sheets that end at a vertex count as one.
struct JoinedCorners {
  UnionFind sets;
  std::vector<EdgeUse> open;  // sides without a counterpart
};

JoinedCorners joined_corners(const Mesh& mesh) {
  JoinedCorners result{UnionFind(static_cast<int>(3 * mesh.triangles.size())), {}};
  const auto corner_at = [&mesh](int triangle, int vertex) {
    int k = 0;
    while (mesh.triangles[triangle][k] != vertex) ++k;
    return 3 * triangle + k;
  };
  std::vector<int> open(mesh.vertices.size(), -1);
  const auto pair = [&](const EdgeUse& a, const EdgeUse& b) {
    for (const int v : {a.low, a.high}) result.sets.unite(corner_at(a.triangle, v), corner_at(b.triangle, v));
  };
  const auto alone = [&](const EdgeUse& use) {
    result.open.push_back(use);
    for (const int v : {use.low, use.high}) {
      const int corner = corner_at(use.triangle, v);
      if (open[v] < 0) open[v] = corner;
      result.sets.unite(open[v], corner);
    }
  };
  for_each_edge(mesh,
                [&](auto begin, auto end) { pair_across_edge(mesh, &*begin, static_cast<std::size_t>(end - begin), pair, alone); });
  return result;
}

// The vertices at the ends of open sides, by x.
std::vector<int> ends_by_x(const Mesh& mesh, const std::vector<EdgeUse>& open) {
  std::vector<int> ends;
  for (const EdgeUse& use : open) ends.insert(ends.end(), {use.low, use.high});
  std::sort(ends.begin(), ends.end(),
            [&](int a, int b) { return std::pair(mesh.vertices[a].x(), a) < std::pair(mesh.vertices[b].x(), b); });
  ends.erase(std::unique(ends.begin(), ends.end()), ends.end());
  return ends;
}

// Makes vertices at the ends of open sides one that are nearer than the tolerance.
void weld_open_ends(Mesh& mesh, const std::vector<EdgeUse>& open, double tolerance) {
  const std::vector<int> ends = ends_by_x(mesh, open);
  UnionFind vertices(static_cast<int>(mesh.vertices.size()));
  for (std::size_t i = 0; i < ends.size(); ++i)
    for (std::size_t j = i + 1; j < ends.size() && mesh.vertices[ends[j]].x() - mesh.vertices[ends[i]].x() <= tolerance; ++j)
      if ((mesh.vertices[ends[j]] - mesh.vertices[ends[i]]).norm() <= tolerance) vertices.unite(ends[i], ends[j]);
  for (auto& t : mesh.triangles)
    for (int k = 0; k < 3; ++k) t[k] = vertices.root(t[k]);
}

// Calls visit(side, vertex) for each open side and each end of another that lies on it, between its ends.
template <typename Visit>
void for_each_end_on_a_side(const Mesh& mesh, const std::vector<EdgeUse>& open, double tolerance, const Visit& visit) {
  const std::vector<int> ends = ends_by_x(mesh, open);
  for (const EdgeUse& side : open) {
    const Eigen::Vector3d& a = mesh.vertices[side.low];
    const Eigen::Vector3d along = mesh.vertices[side.high] - a;
    const double length = along.norm();
    const double from = std::min(a.x(), a.x() + along.x()) - tolerance;
    const double to = std::max(a.x(), a.x() + along.x()) + tolerance;
    auto at = std::lower_bound(ends.begin(), ends.end(), from, [&](int v, double x) { return mesh.vertices[v].x() < x; });
    for (; at != ends.end() && mesh.vertices[*at].x() <= to; ++at) {
      const Eigen::Vector3d p = mesh.vertices[*at] - a;
      const double where = p.dot(along) / length;
      if (where > tolerance && where < length - tolerance && p.cross(along).norm() <= tolerance * length) visit(side, *at);
    }
  }
}

// The spaces outside a hull that lie below the rising water. 0 is the sea.
class Spaces {
public:
  int add() {
    ++apart_;
    parent_.push_back(static_cast<int>(parent_.size()));
    into_.push_back(-1);
    at_.push_back(std::numeric_limits<double>::infinity());
    return parent_.back();
  }
  int root(int i) {
    while (parent_[i] != i) i = parent_[i] = parent_[parent_[i]];
    return i;
  }
  int join(int a, int b, double height) {
    a = root(a);
    b = root(b);
    if (a == b) return a;
    if (a > b) std::swap(a, b);
    parent_[b] = into_[b] = a;
    at_[b] = height;
    --apart_;
    return a;
  }
  bool all_joined() const { return apart_ == 0; }

  // The height at which each was joined to the sea. Joined spaces have the lower number, so one pass does.
  std::vector<double> heights_of_joining_the_sea() const {
    std::vector<double> heights(at_);
    heights[0] = kSea;
    for (std::size_t i = 1; i < heights.size(); ++i)
      if (into_[i] > 0) heights[i] = heights[into_[i]];
    return heights;
  }

private:
  int apart_ = 0;  // roots that are not the sea
  std::vector<int> parent_{0};
  std::vector<int> into_{-1};  // as parent_, without shortcuts
  std::vector<double> at_{kSea};
};

// Triangles that are not upright, by where they are seen from above.
class TrianglesFromAbove {
public:
  TrianglesFromAbove(const std::vector<Eigen::Vector3i>& triangles, std::vector<Eigen::Vector3d> points)
      : triangles_(triangles), points_(std::move(points)) {
    for (const auto& p : points_) box_.extend(p.head<2>());
    side_ = std::clamp(static_cast<int>(std::sqrt(static_cast<double>(triangles.size()) / 2)), 1, 1024);
    cells_.resize(static_cast<std::size_t>(side_) * side_);
    for (std::size_t t = 0; t < triangles.size(); ++t) {
      if (twice_area(t, nullptr, 0) == 0) continue;
      Eigen::AlignedBox2d box;
      for (int k = 0; k < 3; ++k) box.extend(points_[triangles[t][k]].head<2>());
      const Eigen::Vector2i lo = cell(box.min());
      const Eigen::Vector2i hi = cell(box.max());
      for (int y = lo.y(); y <= hi.y(); ++y)
        for (int x = lo.x(); x <= hi.x(); ++x) cells_[static_cast<std::size_t>(y) * side_ + x].push_back(static_cast<int>(t));
    }
  }

  bool faces_up(std::size_t t) const { return twice_area(t, nullptr, 0) > 0; }

  // The first triangle met when falling from p, those for which skip(t) holds left out; -1 if there is none.
  template <typename Skip>
  int below(const Eigen::Vector3d& p, const Skip& skip) const {
    const Eigen::Vector2i c = cell(p.head<2>());
    int best = -1;
    double best_height = 0;
    for (const int t : cells_[static_cast<std::size_t>(c.y()) * side_ + c.x()]) {
      if (skip(t)) continue;
      const bool up = faces_up(t);
      double sum = 0;
      double height = 0;
      bool inside = true;
      for (int k = 0; k < 3; ++k) {
        const double area = twice_area(t, &p, k);
        inside = inside && (up ? area >= 0 : area <= 0);
        sum += area;
        height += area * points_[triangles_[t][k]].z();
      }
      height /= sum;
      if (!inside || !(height <= p.z()) || (best >= 0 && height <= best_height)) continue;
      best = t;
      best_height = height;
    }
    return best;
  }

private:
  // Of triangle t seen from above, with corner k at p.
  double twice_area(std::size_t t, const Eigen::Vector3d* p, int k) const {
    const Eigen::Vector3d* corner[3];
    for (int i = 0; i < 3; ++i) corner[i] = p && i == k ? p : &points_[triangles_[t][i]];
    const Eigen::Vector2d b = (*corner[1] - *corner[0]).head<2>();
    const Eigen::Vector2d c = (*corner[2] - *corner[0]).head<2>();
    return b.x() * c.y() - b.y() * c.x();
  }
  Eigen::Vector2i cell(const Eigen::Vector2d& p) const {
    Eigen::Vector2i c;
    for (int k = 0; k < 2; ++k) {
      const double size = box_.max()[k] - box_.min()[k];
      c[k] = size > 0 ? std::clamp(static_cast<int>((p[k] - box_.min()[k]) / size * side_), 0, side_ - 1) : 0;
    }
    return c;
  }

  const std::vector<Eigen::Vector3i>& triangles_;
  std::vector<Eigen::Vector3d> points_;
  Eigen::AlignedBox2d box_;
  int side_ = 1;
  std::vector<std::vector<int>> cells_;
};

double angle_at(const Eigen::Vector3d& p, const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
  return std::atan2((a - p).cross(b - p).norm(), (a - p).dot(b - p));
}

}  // namespace

HullSurface::HullSurface(const std::vector<Eigen::Vector3d>& vertices, const std::vector<Eigen::Vector3i>& triangles)
    : vertices_(vertices), triangles_(triangles), point_of_corner_(3 * triangles.size()) {
  Mesh mesh;
  mesh.vertices = vertices;
  mesh.triangles = triangles;
  tolerance_mm_ = kSamePlace * bounding_box(mesh).diagonal().norm();
  mesh = with_merged_vertices(mesh);
  JoinedCorners joined = joined_corners(mesh);
  if (!joined.open.empty()) {
    weld_open_ends(mesh, joined.open, tolerance_mm_);
    joined = joined_corners(mesh);
  }
  UnionFind& corners = joined.sets;
  for (std::size_t c = 0; c < point_of_corner_.size(); ++c) {
    const auto root = static_cast<std::size_t>(corners.root(static_cast<int>(c)));
    if (root == c) {
      point_of_corner_[c] = static_cast<int>(vertex_.size());
      vertex_.push_back(triangles[c / 3][static_cast<int>(c % 3)]);
    } else {
      point_of_corner_[c] = point_of_corner_[root];  // a root is the least of its corners
    }
  }
  if (!joined.open.empty()) connect_open_sides(mesh, joined.open);
  first_.assign(points() + 1, 0);
  for (const int p : point_of_corner_) ++first_[p + 1];
  for (std::size_t p = 0; p < points(); ++p) first_[p + 1] += first_[p];
  corners_.resize(point_of_corner_.size());
  std::vector<int> next(first_.begin(), first_.end() - 1);
  normal_.assign(points(), Eigen::Vector3d::Zero());
  for (std::size_t c = 0; c < point_of_corner_.size(); ++c) {
    corners_[next[point_of_corner_[c]]++] = static_cast<int>(c);
    const Eigen::Vector3i& t = triangles[c / 3];
    const Eigen::Vector3d& p = vertices[t[c % 3]];
    const Eigen::Vector3d& a = vertices[t[(c + 1) % 3]];
    const Eigen::Vector3d& b = vertices[t[(c + 2) % 3]];
    normal_[point_of_corner_[c]] += angle_at(p, a, b) * (a - p).cross(b - p).normalized();
  }
}

// @param mesh  as vertices_ and triangles_, its vertices merged
void HullSurface::connect_open_sides(const Mesh& mesh, const std::vector<EdgeUse>& open) {
  open_.assign(points(), 0);
  beside_.resize(points());
  std::vector<std::vector<int>> points_at(mesh.vertices.size());  // open ones
  const auto open_point = [&](const EdgeUse& use, int v) {
    int k = 0;
    while (mesh.triangles[use.triangle][k] != v) ++k;
    return point(3 * use.triangle + k);
  };
  for (const EdgeUse& use : open)
    for (const int v : {use.low, use.high}) {
      const int p = open_point(use, v);
      if (!open_[p]) points_at[v].push_back(p);
      open_[p] = 1;
    }
  for_each_end_on_a_side(mesh, open, tolerance_mm_, [&](const EdgeUse& side, int vertex) {
    for (const int p : points_at[vertex])
      for (const int end : {open_point(side, side.low), open_point(side, side.high)}) {
        beside_[p].push_back(end);
        beside_[end].push_back(p);
      }
  });
}

FloodHeights HullSurface::flood_heights(const Frame& frame, const std::vector<double>& heights, const std::vector<char>& wet,
                                        double highest) const {
  const auto height = [&](std::size_t p) { return heights[vertex_[p]]; };
  std::vector<int> order;
  order.reserve(points());
  for (std::size_t p = 0; p < points(); ++p)
    if (height(p) <= highest) order.push_back(static_cast<int>(p));
  // Of equal heights floors come first: a part of the body that begins on one finds the space above it.
  const auto rank = [&](int p) { return std::tuple(height(p), !(normal_[p].dot(frame.n) > 0), p); };
  std::sort(order.begin(), order.end(), [&](int a, int b) { return rank(a) < rank(b); });

  Spaces spaces;
  std::vector<int> space(points(), -1);
  std::optional<TrianglesFromAbove> from_above;  // seldom needed
  const auto see_from_above = [&] {
    if (!from_above) {
      std::vector<Eigen::Vector3d> seen;
      for (std::size_t i = 0; i < vertices_.size(); ++i)
        seen.emplace_back(frame.u.dot(vertices_[i]), frame.v.dot(vertices_[i]), heights[i]);
      from_above.emplace(triangles_, std::move(seen));
    }
  };
  const auto seen_at = [&](int p, double higher) {
    const Eigen::Vector3d& at = vertices_[vertex_[p]];
    return Eigen::Vector3d(frame.u.dot(at), frame.v.dot(at), height(p) + higher);
  };
  // Whether material lies straight below a point that has no lower neighbour. The nearest part of the surface to a place straight
  // below it is the point itself, so that its normal tells, unless part of the surface around it is missing.
  const auto on_material = [&](int p) {
    if (open_.empty() || !open_[p]) return normal_[p].dot(frame.n) > 0;
    see_from_above();
    const int t = from_above->below(seen_at(p, -tolerance_mm_), [](int) { return false; });
    return t >= 0 && !from_above->faces_up(t);
  };
  // The space that lies below a point at which the body begins.
  const auto space_below = [&](int p) {
    if (spaces.all_joined()) return 0;
    see_from_above();
    const int t = from_above->below(seen_at(p, tolerance_mm_), [&](int triangle) {
      return point(3 * triangle) == p || point(3 * triangle + 1) == p || point(3 * triangle + 2) == p ||
             !from_above->faces_up(triangle);
    });
    if (t < 0) return 0;
    for (int k = 0; k < 3; ++k)
      if (space[point(3 * t + k)] >= 0) return spaces.root(space[point(3 * t + k)]);
    return 0;
  };
  for (const int p : order) {
    int here = -1;
    for (int n = first_[p]; n < first_[p + 1]; ++n)
      for (int k = 1; k < 3; ++k) {
        const int other = space[point(corners_[n] / 3 * 3 + (corners_[n] + k) % 3)];
        if (other >= 0) here = here < 0 ? spaces.root(other) : spaces.join(here, other, height(p));
      }
    if (!beside_.empty())
      for (const int q : beside_[p])
        if (space[q] >= 0) here = here < 0 ? spaces.root(space[q]) : spaces.join(here, space[q], height(p));
    // No lower neighbour: here a space begins, or else the body does.
    if (here < 0) here = on_material(p) ? spaces.add() : space_below(p);
    if (!wet.empty() && wet[p]) here = spaces.join(here, 0, height(p));
    space[p] = here;
  }

  FloodHeights result;
  const std::vector<double> joins = spaces.heights_of_joining_the_sea();
  bool any = false;
  std::vector<double> of_point(points(), kSea);
  for (std::size_t p = 0; p < points(); ++p)
    if (space[p] >= 0) of_point[p] = joins[space[p]];
  std::vector<double> of_triangle(triangles_.size(), kSea);
  for (std::size_t t = 0; t < triangles_.size(); ++t) {
    std::size_t lowest = point(static_cast<int>(3 * t));
    for (int k = 1; k < 3; ++k) {
      const std::size_t p = point(static_cast<int>(3 * t) + k);
      if (std::pair(height(p), p) < std::pair(height(lowest), lowest)) lowest = p;
    }
    if (!(of_point[lowest] > height(lowest))) continue;  // filled as soon as it is reached: a pocket without depth
    of_triangle[t] = of_point[lowest];
    any = true;
  }
  if (!any) return result;
  result.of_triangle = std::move(of_triangle);
  result.of_point = std::move(of_point);
  return result;
}

}  // namespace rayrep
