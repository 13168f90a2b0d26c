#include "mesh/planar_triangulation.h"

#include <algorithm>
#include <utility>

#include "mesh/predicates.h"

namespace rayrep {
namespace {

/// Not Delaunay by more than rounding: the angles opposite the side add up to more than pi.
bool is_not_delaunay(const PlanarTriangulation& plane, int t, int k) {
  const auto& corner = plane.triangles()[t].corner;
  const auto at = [&](int v) { return plane.point(v); };
  const Eigen::Vector2d a = at(corner[(k + 1) % 3]);
  const Eigen::Vector2d b = at(corner[(k + 2) % 3]);
  const Eigen::Vector2d c = at(corner[k]);
  const Eigen::Vector2d d = at(plane.apex(t, k));
  const auto cotangent = [](const Eigen::Vector2d& u, const Eigen::Vector2d& v) {
    return u.dot(v) / std::abs(u.x() * v.y() - u.y() * v.x());
  };
  return cotangent(a - c, b - c) + cotangent(a - d, b - d) < -1e-9;
}

}  // namespace

PlanarTriangulation::PlanarTriangulation(const Eigen::Vector2d& low, const Eigen::Vector2d& high) : improves_(is_not_delaunay) {
  const Eigen::Vector2d middle = 0.5 * (low + high);
  const double far = 1000 * (high - low).norm() + 1e-300;
  points_ = {middle + far * Eigen::Vector2d(-1, -1), middle + far * Eigen::Vector2d(1, -1), middle + far * Eigen::Vector2d(0, 1)};
  triangles_.push_back({{0, 1, 2}, {-1, -1, -1}, {false, false, false}});
  at_.assign(3, 0);
}

int PlanarTriangulation::corner_of(int t, int v) const {
  for (int k = 0; k < 3; ++k)
    if (triangles_[t].corner[k] == v) return k;
  return -1;
}

int PlanarTriangulation::side_to(int t, int neighbour) const {
  for (int k = 0; k < 3; ++k)
    if (triangles_[t].neighbour[k] == neighbour) return k;
  return -1;
}

int PlanarTriangulation::apex(int t, int k) const {
  const int other = triangles_[t].neighbour[k];
  return triangles_[other].corner[side_to(other, t)];
}

int PlanarTriangulation::way_out(int t, const Eigen::Vector2d& p, int first, Place& place) const {
  place = {t, -1, false};
  for (int i = 0; i < 3; ++i) {
    const int k = (first + i) % 3;
    const auto& corner = triangles_[t].corner;
    const int side = orient2d(points_[corner[(k + 1) % 3]], points_[corner[(k + 2) % 3]], p);
    if (side < 0) return k;
    if (side > 0) continue;
    place.on_corner = place.on_side >= 0;
    place.on_side = k;
  }
  return -1;
}

PlanarTriangulation::Place PlanarTriangulation::locate(const Eigen::Vector2d& p, int start) const {
  Place place;
  int t = start;
  for (std::size_t step = 0; t >= 0 && step <= triangles_.size() + 100; ++step) {
    const int k = way_out(t, p, static_cast<int>(step % 3), place);
    if (k < 0) return place;
    t = triangles_[t].neighbour[k];
  }
  // Where sides that stay keep it from being Delaunay a walk may go round in circles.
  for (t = 0; t < static_cast<int>(triangles_.size()); ++t)
    if (way_out(t, p, 0, place) < 0) return place;
  return {};
}

/// Sets both ends of a side.
void PlanarTriangulation::attach(int t, int k, int neighbour, int their_side) {
  triangles_[t].neighbour[k] = neighbour;
  if (neighbour >= 0) triangles_[neighbour].neighbour[their_side] = t;
}

void PlanarTriangulation::split_triangle(int t, int n) {
  const Triangle old = triangles_[t];
  const int t1 = static_cast<int>(triangles_.size());
  const int t2 = t1 + 1;
  std::array<int, 3> theirs{};
  for (int k = 0; k < 3; ++k) theirs[k] = old.neighbour[k] < 0 ? -1 : side_to(old.neighbour[k], t);
  const std::array<int, 3> made{t, t1, t2};
  triangles_.resize(triangles_.size() + 2);
  // Triangle k of them keeps the side opposite corner k.
  for (int k = 0; k < 3; ++k)
    triangles_[made[k]] = {{n, old.corner[(k + 1) % 3], old.corner[(k + 2) % 3]},
                           {-1, made[(k + 1) % 3], made[(k + 2) % 3]},
                           {old.fixed[k], false, false}};
  for (int k = 0; k < 3; ++k) {
    attach(made[k], 0, old.neighbour[k], theirs[k]);
    at_[old.corner[(k + 1) % 3]] = made[k];
    doubtful_.push_back({made[k], 0});
  }
  at_[n] = t;
}

void PlanarTriangulation::split_side(int t, int k, int n) {
  const int u = triangles_[t].neighbour[k];
  const bool stays = triangles_[t].fixed[k];
  const int a = triangles_[t].corner[(k + 1) % 3];
  // t becomes two triangles at its apex, and so does its neighbour: as if each were split with one of three pieces empty.
  const auto halve = [&](int s, int side) {
    const Triangle old = triangles_[s];
    const int half = static_cast<int>(triangles_.size());
    const int outer = old.neighbour[(side + 1) % 3];
    const int theirs = outer < 0 ? -1 : side_to(outer, s);
    triangles_.push_back(
        {{old.corner[side], n, old.corner[(side + 2) % 3]}, {-1, outer, s}, {stays, old.fixed[(side + 1) % 3], false}});
    attach(half, 1, outer, theirs);
    triangles_[s].corner[(side + 2) % 3] = n;
    triangles_[s].neighbour[(side + 1) % 3] = half;
    triangles_[s].fixed[(side + 1) % 3] = false;
    at_[old.corner[(side + 2) % 3]] = half;
    at_[old.corner[side]] = s;
    doubtful_.push_back({half, 1});
    doubtful_.push_back({s, (side + 2) % 3});
    return half;
  };
  const int half = halve(t, k);
  at_[n] = t;
  at_[a] = t;
  if (u < 0) return;
  const int side = side_to(u, t);
  const int their_half = halve(u, side);
  // t has (a, n), u (b, n): their halves the other ends.
  attach(t, k, their_half, 0);
  attach(half, 0, u, side);
}

bool PlanarTriangulation::is_convex(int t, int k) const {
  const auto& corner = triangles_[t].corner;
  const Eigen::Vector2d& c = points_[corner[k]];
  const Eigen::Vector2d& d = points_[apex(t, k)];
  return orient2d(c, points_[corner[(k + 1) % 3]], d) > 0 && orient2d(d, points_[corner[(k + 2) % 3]], c) > 0;
}

void PlanarTriangulation::flip(int t, int k) {
  const int u = triangles_[t].neighbour[k];
  const int j = side_to(u, t);
  const Triangle one = triangles_[t];
  const Triangle two = triangles_[u];
  const int c = one.corner[k];
  const int a = one.corner[(k + 1) % 3];
  const int b = one.corner[(k + 2) % 3];
  const int d = two.corner[j];
  const int outer_a = one.neighbour[(k + 1) % 3];  // across (b, c)
  const int outer_b = one.neighbour[(k + 2) % 3];  // across (c, a)
  const int below_b = two.neighbour[(j + 1) % 3];  // across (a, d): two's corners run d, b, a
  const int below_a = two.neighbour[(j + 2) % 3];  // across (d, b)
  const auto theirs = [&](int outer, int own) { return outer < 0 ? -1 : side_to(outer, own); };
  const std::array<int, 4> sides{theirs(outer_a, t), theirs(outer_b, t), theirs(below_b, u), theirs(below_a, u)};
  triangles_[t] = {{c, a, d}, {below_b, u, outer_b}, {two.fixed[(j + 1) % 3], false, one.fixed[(k + 2) % 3]}};
  triangles_[u] = {{d, b, c}, {outer_a, t, below_a}, {one.fixed[(k + 1) % 3], false, two.fixed[(j + 2) % 3]}};
  attach(t, 0, below_b, sides[2]);
  attach(t, 2, outer_b, sides[1]);
  attach(u, 0, outer_a, sides[0]);
  attach(u, 2, below_a, sides[3]);
  at_[a] = at_[c] = t;
  at_[b] = at_[d] = u;
  for (const int s : {0, 2}) {
    doubtful_.push_back({t, s});
    doubtful_.push_back({u, s});
  }
}

/// Flips doubtful sides until none is better flipped, or no end is to be seen.
void PlanarTriangulation::settle() {
  std::size_t left = 50 * (doubtful_.size() + 20);
  while (!doubtful_.empty()) {
    const auto [t, k] = doubtful_.back();
    doubtful_.pop_back();
    if (left == 0) continue;
    if (triangles_[t].neighbour[k] < 0 || triangles_[t].fixed[k] || !is_convex(t, k) || !improves_(*this, t, k)) continue;
    --left;
    flip(t, k);
  }
}

int PlanarTriangulation::insert(const Eigen::Vector2d& p, const Place& place) {
  const int n = static_cast<int>(points_.size());
  points_.push_back(p);
  at_.push_back(-1);
  if (place.on_side >= 0)
    split_side(place.triangle, place.on_side, n);
  else
    split_triangle(place.triangle, n);
  settle();
  return n;
}

int PlanarTriangulation::add(const Eigen::Vector2d& p, int near) {
  return add_where(p, near, [](int) { return true; });
}

int PlanarTriangulation::add_where(const Eigen::Vector2d& p, int near, const std::function<bool(int)>& accepts) {
  const Place place = locate(p, near < 0 ? 0 : at_[near]);
  if (place.triangle < 0 || place.on_corner || !accepts(place.triangle)) return -1;
  if (place.on_side >= 0 && triangles_[place.triangle].fixed[place.on_side]) return -1;
  return insert(p, place);
}

std::vector<int> PlanarTriangulation::around(int v) const {
  std::vector<int> found;
  const int start = at_[v];
  int t = start;
  do {  // counter-clockwise
    found.push_back(t);
    t = triangles_[t].neighbour[(corner_of(t, v) + 1) % 3];
  } while (t >= 0 && t != start);
  if (t == start) return found;
  for (t = triangles_[start].neighbour[(corner_of(start, v) + 2) % 3]; t >= 0;
       t = triangles_[t].neighbour[(corner_of(t, v) + 2) % 3])
    found.push_back(t);
  return found;
}

bool PlanarTriangulation::find_side(int a, int b, int& t, int& k) const {
  for (const int candidate : around(a)) {
    if (corner_of(candidate, b) < 0) continue;
    t = candidate;
    k = 3 - corner_of(t, a) - corner_of(t, b);
    return true;
  }
  return false;
}

bool PlanarTriangulation::crossed(int a, int b, std::vector<std::array<int, 2>>& sides) const {
  const Eigen::Vector2d& from = points_[a];
  const Eigen::Vector2d& to = points_[b];
  int t = -1;
  int right = -1;
  int left = -1;
  for (const int candidate : around(a)) {
    const int k = corner_of(candidate, a);
    right = triangles_[candidate].corner[(k + 1) % 3];
    left = triangles_[candidate].corner[(k + 2) % 3];
    const int of_right = orient2d(from, to, points_[right]);
    const int of_left = orient2d(from, to, points_[left]);
    if (of_right == 0 && (points_[right] - from).dot(to - from) > 0) return false;
    if (of_right < 0 && of_left > 0) {
      t = candidate;
      break;
    }
  }
  if (t < 0) return false;
  int k = corner_of(t, a);
  while (true) {
    if (triangles_[t].fixed[k]) return false;
    sides.push_back({right, left});
    const int u = triangles_[t].neighbour[k];
    if (u < 0) return false;
    const int top = apex(t, k);
    if (top == b) return true;
    const int side = orient2d(from, to, points_[top]);
    if (side == 0) return false;
    (side < 0 ? right : left) = top;
    t = u;
    k = 3 - corner_of(t, right) - corner_of(t, left);
  }
}

bool PlanarTriangulation::fix(int a, int b) {
  int t = -1;
  int k = -1;
  if (!find_side(a, b, t, k)) {
    std::vector<std::array<int, 2>> sides;
    if (!crossed(a, b, sides)) return false;
    // Sloan: what crosses the segment is flipped, those that cannot be yet wait.
    std::size_t patience = 100 * sides.size() + sides.size() * sides.size();
    for (std::size_t n = 0; n < sides.size(); ++n) {
      if (patience-- == 0) return false;
      const auto [right, left] = sides[n];
      if (!find_side(right, left, t, k)) return false;
      if (!is_convex(t, k)) {
        sides.push_back(sides[n]);
        continue;
      }
      const int one = triangles_[t].corner[k];
      const int two = apex(t, k);
      flip(t, k);
      if (one == a || one == b || two == a || two == b) continue;
      if (orient2d(points_[a], points_[b], points_[one]) * orient2d(points_[a], points_[b], points_[two]) < 0)
        sides.push_back(orient2d(points_[a], points_[b], points_[one]) < 0 ? std::array<int, 2>{one, two}
                                                                           : std::array<int, 2>{two, one});
    }
    doubtful_.clear();
    if (!find_side(a, b, t, k)) return false;
  }
  triangles_[t].fixed[k] = true;
  if (const int u = triangles_[t].neighbour[k]; u >= 0) triangles_[u].fixed[side_to(u, t)] = true;
  return true;
}

void PlanarTriangulation::improve() {
  doubtful_.clear();
  for (int t = 0; t < static_cast<int>(triangles_.size()); ++t)
    for (int k = 0; k < 3; ++k) doubtful_.push_back({t, k});
  settle();
}

std::vector<char> PlanarTriangulation::left_of(std::span<const std::array<int, 2>> sides) const {
  std::vector<char> inside(triangles_.size(), 0);
  std::vector<char> outside(triangles_.size(), 0);
  std::vector<int> stack;
  for (const auto& [a, b] : sides) {
    int t = -1;
    int k = -1;
    if (!find_side(a, b, t, k) || triangles_[t].neighbour[k] < 0) return {};
    int right = triangles_[t].neighbour[k];
    if (triangles_[t].corner[(k + 1) % 3] != a) std::swap(t, right);
    outside[right] = 1;
    if (!inside[t]) stack.push_back(t);
    inside[t] = 1;
  }
  while (!stack.empty()) {
    const int t = stack.back();
    stack.pop_back();
    for (int k = 0; k < 3; ++k) {
      if (triangles_[t].corner[k] < kFirst) return {};
      const int u = triangles_[t].neighbour[k];
      if (triangles_[t].fixed[k] || u < 0 || inside[u]) continue;
      inside[u] = 1;
      stack.push_back(u);
    }
  }
  for (std::size_t t = 0; t < inside.size(); ++t)
    if (inside[t] && outside[t]) return {};
  return inside;
}

}  // namespace rayrep
