#include "mesh/cut_plane.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <deque>

// The segment is put in by turning the sides that it crosses, those that cannot be turned yet after the others (Sloan, "A fast
// algorithm for generating constrained Delaunay triangulations", 1993). Where it crosses a segment both are split.

namespace rayrep {
namespace {

using Face = CutPlane::Face;

std::size_t next(std::size_t k) { return k == 2 ? 0 : k + 1; }
std::size_t previous(std::size_t k) { return k == 0 ? 2 : k - 1; }

/// What lies beyond a side of a face.
struct Side {
  int neighbour = -1, line = -1, stamp = -1;
};
Side side_of_face(const Face& f, std::size_t k) { return {f.neighbour[k], f.line[k], f.stamp[k]}; }

/// A face like `like` with other corners, and with what lies opposite to each.
Face face_like(const Face& like, const std::array<int, 3>& vertex, const std::array<Side, 3>& sides) {
  Face f = like;
  f.vertex = vertex;
  for (std::size_t k = 0; k < 3; ++k) {
    f.neighbour[k] = sides[k].neighbour;
    f.line[k] = sides[k].line;
    f.stamp[k] = sides[k].stamp;
  }
  return f;
}

/// Whether d lies inside the circle through a, b, c (counter-clockwise) by more than rounding.
bool in_circle(const Eigen::Vector2d& a, const Eigen::Vector2d& b, const Eigen::Vector2d& c, const Eigen::Vector2d& d) {
  const Eigen::Vector2d u = a - d, v = b - d, w = c - d;
  const double uu = u.squaredNorm(), vv = v.squaredNorm(), ww = w.squaredNorm();
  const double vw = v.x() * w.y(), wv = v.y() * w.x();
  const double wu = w.x() * u.y(), uw = w.y() * u.x();
  const double uv = u.x() * v.y(), vu = u.y() * v.x();
  const double det = uu * (vw - wv) + vv * (wu - uw) + ww * (uv - vu);
  const double permanent =
      uu * (std::abs(vw) + std::abs(wv)) + vv * (std::abs(wu) + std::abs(uw)) + ww * (std::abs(uv) + std::abs(vu));
  return det > 1e-14 * permanent;
}

}  // namespace

CutPlane::CutPlane(int axis, const std::array<ExactPoint, 3>& corners, const std::array<int, 3>& lines, Crossing crossing)
    : axis_(axis), crossing_(std::move(crossing)), points_(corners.begin(), corners.end()), face_at_(3, 0) {
  Face f;
  f.vertex = {0, 1, 2};
  f.line = lines;
  faces_.push_back(f);
}

int CutPlane::orient(int a, int b, int c) const {
  return orient2d(points_[static_cast<std::size_t>(a)], points_[static_cast<std::size_t>(b)], points_[static_cast<std::size_t>(c)],
                  axis_);
}

/// True when the point lies in the face or on its rim; `outside` is a side that it lies beyond otherwise.
bool CutPlane::place_in(int face, const ExactPoint& point, Place& place, int& outside) const {
  const Face& f = faces_[static_cast<std::size_t>(face)];
  place = {.face = face};
  std::array<int, 3> on{};
  int zeros = 0;
  for (std::size_t k = 0; k < 3; ++k) {
    const auto corner = [&](std::size_t n) -> const ExactPoint& { return points_[static_cast<std::size_t>(f.vertex[n])]; };
    const int s = orient2d(corner(next(k)), corner(previous(k)), point, axis_);
    if (s < 0) {
      outside = static_cast<int>(k);
      return false;
    }
    if (s == 0) on[static_cast<std::size_t>(zeros++)] = static_cast<int>(k);
  }
  if (zeros == 1) place.side = on[0];
  if (zeros == 2) place.corner = 3 - on[0] - on[1];
  return true;
}

/// A walk towards the point; where it goes round in circles every face is tried.
CutPlane::Place CutPlane::locate(const ExactPoint& point) const {
  Place place;
  int face = hint_;
  int outside = 0;
  for (std::size_t steps = 0; face >= 0 && steps <= faces_.size(); ++steps) {
    if (place_in(face, point, place, outside)) return place;
    face = faces_[static_cast<std::size_t>(face)].neighbour[static_cast<std::size_t>(outside)];
  }
  for (int f = 0; f < static_cast<int>(faces_.size()); ++f)
    if (place_in(f, point, place, outside)) return place;
  assert(false && "a point outside the first triangle");
  return place;
}

void CutPlane::put(int face, const Face& value) {
  faces_[static_cast<std::size_t>(face)] = value;
  for (const int v : value.vertex) face_at_[static_cast<std::size_t>(v)] = face;
}

/// Where a face had `from` beside it, it now has `to`.
void CutPlane::relink(int neighbour, int from, int to) {
  if (neighbour < 0) return;
  for (int& n : faces_[static_cast<std::size_t>(neighbour)].neighbour)
    if (n == from) {
      n = to;
      return;
    }
}

int CutPlane::corner_of(int face, int vertex) const {
  const auto& v = faces_[static_cast<std::size_t>(face)].vertex;
  return v[0] == vertex ? 0 : v[1] == vertex ? 1 : 2;
}

void CutPlane::split_face(int face, int point) {
  const Face old = faces_[static_cast<std::size_t>(face)];
  const int second = static_cast<int>(faces_.size());
  const int third = second + 1;
  faces_.resize(faces_.size() + 2);
  const auto [a, b, c] = old.vertex;
  put(face, face_like(old, {a, b, point}, {Side{second}, Side{third}, side_of_face(old, 2)}));
  put(second, face_like(old, {b, c, point}, {Side{third}, Side{face}, side_of_face(old, 0)}));
  put(third, face_like(old, {c, a, point}, {Side{face}, Side{second}, side_of_face(old, 1)}));
  relink(old.neighbour[0], face, second);
  relink(old.neighbour[1], face, third);
}

void CutPlane::split_side(int face, int side, int point) {
  const auto k = static_cast<std::size_t>(side);
  const Face old = faces_[static_cast<std::size_t>(face)];
  const int a = old.vertex[k], b = old.vertex[next(k)], c = old.vertex[previous(k)];
  const int other = old.neighbour[k];
  const int face2 = static_cast<int>(faces_.size());
  const int other2 = other < 0 ? -1 : face2 + 1;
  faces_.resize(faces_.size() + (other < 0 ? 1 : 2));
  Side half = side_of_face(old, k);
  const auto across = [&half](int neighbour) {
    half.neighbour = neighbour;
    return half;
  };
  // a, b, point stays in place, a, point, c is new; beyond the side d, point, b and d, c, point.
  put(face, face_like(old, {a, b, point}, {across(other2), Side{face2}, side_of_face(old, previous(k))}));
  put(face2, face_like(old, {a, point, c}, {across(other), side_of_face(old, next(k)), Side{face}}));
  relink(old.neighbour[next(k)], face, face2);
  if (other < 0) return;
  const Face beyond = faces_[static_cast<std::size_t>(other)];
  std::size_t m = 0;
  while (beyond.vertex[m] == b || beyond.vertex[m] == c) ++m;
  const int d = beyond.vertex[m];
  put(other, face_like(beyond, {d, c, point}, {across(face2), Side{other2}, side_of_face(beyond, previous(m))}));
  put(other2, face_like(beyond, {d, point, b}, {across(face), side_of_face(beyond, next(m)), Side{other}}));
  relink(beyond.neighbour[next(m)], other, other2);
}

/// Turns the side opposite to a corner into the other diagonal of the quadrilateral around it.
void CutPlane::flip(int face, int side) {
  const auto k = static_cast<std::size_t>(side);
  const Face f = faces_[static_cast<std::size_t>(face)];
  const int other = f.neighbour[k];
  const Face g = faces_[static_cast<std::size_t>(other)];
  const int a = f.vertex[k], b = f.vertex[next(k)], c = f.vertex[previous(k)];
  std::size_t m = 0;
  while (g.vertex[m] == b || g.vertex[m] == c) ++m;
  const int d = g.vertex[m];
  put(face, face_like(f, {a, b, d}, {side_of_face(g, next(m)), Side{other}, side_of_face(f, previous(k))}));
  put(other, face_like(f, {a, d, c}, {side_of_face(g, previous(m)), side_of_face(f, next(k)), Side{face}}));
  relink(g.neighbour[next(m)], other, face);
  relink(f.neighbour[next(k)], face, other);
}

/// Whether the side can be turned.
bool CutPlane::convex(int face, int side) const {
  const auto k = static_cast<std::size_t>(side);
  const Face& f = faces_[static_cast<std::size_t>(face)];
  const Face& g = faces_[static_cast<std::size_t>(f.neighbour[k])];
  const int a = f.vertex[k], b = f.vertex[next(k)], c = f.vertex[previous(k)];
  const int d = g.vertex[0] + g.vertex[1] + g.vertex[2] - b - c;
  return orient(a, b, d) > 0 && orient(a, d, c) > 0;
}

bool CutPlane::improvable(int face, int side) const {
  const auto k = static_cast<std::size_t>(side);
  const Face& f = faces_[static_cast<std::size_t>(face)];
  if (f.neighbour[k] < 0 || f.line[k] >= 0 || !f.alive) return false;
  const Face& g = faces_[static_cast<std::size_t>(f.neighbour[k])];
  const int b = f.vertex[next(k)], c = f.vertex[previous(k)];
  const int d = g.vertex[0] + g.vertex[1] + g.vertex[2] - b - c;
  const auto flat = [this](int v) {
    const Eigen::Vector3d& p = points_[static_cast<std::size_t>(v)].near;
    return Eigen::Vector2d(p[(axis_ + 1) % 3], p[(axis_ + 2) % 3]);
  };
  return in_circle(flat(f.vertex[k]), flat(b), flat(c), flat(d)) && convex(face, side);
}

void CutPlane::legalise(std::vector<std::pair<int, int>> sides) {
  // Rounding may not agree with itself about nearly round quadrilaterals: it is not given the time to go round in circles.
  std::size_t turns = 100 + 20 * faces_.size();
  while (!sides.empty() && turns > 0) {
    const auto [a, b] = sides.back();
    sides.pop_back();
    const auto [face, side] = find_side(a, b);
    if (face < 0 || !improvable(face, side)) continue;
    --turns;
    const int other = faces_[static_cast<std::size_t>(face)].neighbour[static_cast<std::size_t>(side)];
    flip(face, side);
    for (const int f : {face, other})
      for (std::size_t k = 0; k < 3; ++k) {
        const auto& v = faces_[static_cast<std::size_t>(f)].vertex;
        sides.emplace_back(v[next(k)], v[previous(k)]);
      }
  }
}

void CutPlane::improve() {
  std::vector<std::pair<int, int>> sides;
  for (const Face& f : faces_)
    for (std::size_t k = 0; k < 3; ++k)
      if (f.vertex[next(k)] < f.vertex[previous(k)]) sides.emplace_back(f.vertex[next(k)], f.vertex[previous(k)]);
  legalise(std::move(sides));
}

int CutPlane::insert(ExactPoint point) {
  const Place place = locate(point);
  const auto& at = faces_[static_cast<std::size_t>(place.face)];
  hint_ = place.face;
  if (place.corner >= 0) {
    const int v = at.vertex[static_cast<std::size_t>(place.corner)];
    if (point.vertex >= 0) points_[static_cast<std::size_t>(v)].vertex = point.vertex;
    return v;
  }
  const int number = static_cast<int>(points_.size());
  std::vector<std::pair<int, int>> sides;
  for (std::size_t k = 0; k < 3; ++k) sides.emplace_back(at.vertex[next(k)], at.vertex[previous(k)]);
  points_.push_back(std::move(point));
  face_at_.push_back(place.face);
  if (place.side >= 0)
    split_side(place.face, place.side, number);
  else
    split_face(place.face, number);
  legalise(std::move(sides));
  hint_ = face_at_[static_cast<std::size_t>(number)];
  return number;
}

/// The face that has the side from a to b, and the corner opposite to it.
std::pair<int, int> CutPlane::find_side(int a, int b) const {
  const auto at = [&](int face) -> const Face& { return faces_[static_cast<std::size_t>(face)]; };
  const int first = face_at_[static_cast<std::size_t>(a)];
  int face = first;
  for (;;) {  // against the clock, up to a rim
    const auto i = static_cast<std::size_t>(corner_of(face, a));
    if (at(face).vertex[next(i)] == b) return {face, static_cast<int>(previous(i))};
    face = at(face).neighbour[next(i)];
    if (face == first) return {-1, -1};
    if (face < 0) break;
  }
  face = first;
  for (;;) {
    const auto i = static_cast<std::size_t>(corner_of(face, a));
    face = at(face).neighbour[previous(i)];
    if (face < 0) return {-1, -1};
    const auto j = static_cast<std::size_t>(corner_of(face, a));
    if (at(face).vertex[next(j)] == b) return {face, static_cast<int>(previous(j))};
  }
}

/// Looks for the face at `from` through which the segment leaves, against the clock and then with it.
CutPlane::Step CutPlane::walk(int from, int to) const {
  const int first = face_at_[static_cast<std::size_t>(from)];
  for (const bool turn : {true, false}) {
    int face = first;
    do {
      const Face& f = faces_[static_cast<std::size_t>(face)];
      const auto i = static_cast<std::size_t>(corner_of(face, from));
      const int p = f.vertex[next(i)], q = f.vertex[previous(i)];
      if (p == to || q == to) return {.vertex = to, .alive = f.alive};
      const int sp = orient(from, to, p);
      const int sq = orient(from, to, q);
      if (sp == 0 && sq > 0) return {.vertex = p, .alive = f.alive};
      if (sq == 0 && sp < 0) return {.vertex = q, .alive = f.alive};
      if (sp < 0 && sq > 0) return walk_across({.alive = f.alive}, {face, static_cast<int>(i)}, from, to);
      face = f.neighbour[turn ? next(i) : previous(i)];
    } while (face >= 0 && face != first);
  }
  assert(false && "a segment that leaves the first triangle");
  return {.vertex = to, .alive = false};
}

CutPlane::Step CutPlane::walk_across(Step step, std::pair<int, int> at, int from, int to) const {
  auto [face, side] = at;
  for (;;) {
    const Face& f = faces_[static_cast<std::size_t>(face)];
    const auto k = static_cast<std::size_t>(side);
    const int beyond = f.neighbour[k];
    const bool wanted = f.alive || (beyond >= 0 && faces_[static_cast<std::size_t>(beyond)].alive);
    if (f.line[k] >= 0 && wanted) {
      step.face = face;
      step.side = side;
      return step;
    }
    assert(beyond >= 0);
    const int p = f.vertex[next(k)], q = f.vertex[previous(k)];
    step.crossed.emplace_back(p, q);
    const Face& g = faces_[static_cast<std::size_t>(beyond)];
    const int r = g.vertex[0] + g.vertex[1] + g.vertex[2] - p - q;
    const int s = r == to ? 0 : orient(from, to, r);
    if (s == 0) {
      step.vertex = r;
      return step;
    }
    // On to the side across which the segment leaves: opposite to the corner that stays behind.
    face = beyond;
    side = corner_of(beyond, s > 0 ? q : p);
  }
}

/// Makes `from` to `to` a side by turning those that it crosses.
void CutPlane::force(int from, int to, const std::vector<std::pair<int, int>>& crossed) {
  std::deque<std::pair<int, int>> open(crossed.begin(), crossed.end());
  while (!open.empty()) {
    const auto [p, q] = open.front();
    open.pop_front();
    const auto [face, side] = find_side(p, q);
    if (!convex(face, side)) {
      open.emplace_back(p, q);
      continue;
    }
    const Face& f = faces_[static_cast<std::size_t>(face)];
    const Face& g = faces_[static_cast<std::size_t>(f.neighbour[static_cast<std::size_t>(side)])];
    const int a = f.vertex[static_cast<std::size_t>(side)];
    const int d = g.vertex[0] + g.vertex[1] + g.vertex[2] - p - q;
    flip(face, side);
    if (a == from || a == to || d == from || d == to) continue;
    if (orient(from, to, a) * orient(from, to, d) < 0) open.emplace_back(a, d);
  }
}

void CutPlane::insert(int from, int to, const Segment& segment) {
  while (from != to) {
    Step step = walk(from, to);
    int end = step.vertex;
    if (end < 0) {
      const int line = faces_[static_cast<std::size_t>(step.face)].line[static_cast<std::size_t>(step.side)];
      end = static_cast<int>(points_.size());
      points_.push_back(crossing_(segment.line, line));
      face_at_.push_back(step.face);
      split_side(step.face, step.side, end);
    }
    if (step.alive) force(from, end, step.crossed);
    const auto mark = [&](std::pair<int, int> at) {
      if (at.first < 0) return;
      Face& f = faces_[static_cast<std::size_t>(at.first)];
      int& line = f.line[static_cast<std::size_t>(at.second)];
      if (line < 0) line = segment.line;
      f.stamp[static_cast<std::size_t>(at.second)] = segment.stamp;
    };
    if (step.alive || step.crossed.empty()) {
      mark(find_side(from, end));
      mark(find_side(end, from));
    }
    from = end;
  }
}

}  // namespace rayrep
