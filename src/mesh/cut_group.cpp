#include "mesh/cut_group.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <iterator>
#include <limits>
#include <span>
#include <utility>

#include "mesh/predicates.h"

namespace rayrep {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;
using Eigen::Vector3i;

Vector2d seen(const Vector3d& p, int axis) { return {p[(axis + 1) % 3], p[(axis + 2) % 3]}; }

/// A point where triangles meet: a vertex u (v = -1), or where the side from vertex u to v > u crosses triangle t.
using PointKey = std::array<int, 3>;
PointKey at_vertex(int v) { return {v, -1, -1}; }

/// Compares triangles with an operand.
struct ByOperand {
  const std::vector<int>& operand;
  bool operator()(int t, int k) const { return operand[static_cast<std::size_t>(t)] < k; }
};

class CutGroup {
public:
  CutGroup(const Arrangement& arrangement, const std::vector<int>& members)
      : all_(arrangement),
        members_(members),
        group_(members.front()),
        axis_(best_axis(corner(group_, 0), corner(group_, 1), corner(group_, 2))),
        plane_(plane_of(group_)),
        cut_(axis_, first_corners(), first_lines(), [this](int a, int b) { return crossing(a, b); }) {}

  BoundaryPart run() {
    const std::vector<int> covering = operands(members_);
    find_covered(covering);
    for (const int k : covering) {
      put_in(k);
      settle(k);
    }
    give_up([](const CutPlane::Face& f) { return f.below == f.above; });
    std::vector<int> all_cutters;
    for (const int t : members_) all_cutters.insert(all_cutters.end(), cutters(t).begin(), cutters(t).end());
    const std::vector<int> cutting = operands(all_cutters);
    std::vector<int> met;
    std::set_union(cutting.begin(), cutting.end(), covering.begin(), covering.end(), std::back_inserter(met));
    settle_others(met);
    for (const int k : most_first(cutting)) {
      if (std::binary_search(covering.begin(), covering.end(), k)) continue;
      find_alive();
      if (alive_.isEmpty()) break;
      put_in(k);
      settle(k);
    }
    return result();
  }

private:
  const Vector3d& corner(int t, int k) const { return all_.all.mesh.corner(static_cast<std::size_t>(t), k); }
  const std::vector<int>& cutters(int t) const { return all_.cutters[static_cast<std::size_t>(t)]; }
  int operand(int t) const { return all_.all.operand[static_cast<std::size_t>(t)]; }

  ExactPlane plane_of(int t) const {
    return plane_through(all_.numbers.of(corner(t, 0)), all_.numbers.of(corner(t, 1)), all_.numbers.of(corner(t, 2)));
  }

  std::vector<int> operands(const std::vector<int>& triangles) const {
    std::vector<int> found;
    for (const int t : triangles) found.push_back(operand(t));
    std::sort(found.begin(), found.end());
    found.erase(std::unique(found.begin(), found.end()), found.end());
    return found;
  }

  // ------------------------------------------------------------------------------------------------------ points and lines

  /// Of a single triangle it is that; of several one around them, with coordinates on the grid of all others.
  std::array<ExactPoint, 3> first_corners() const {
    const Vector3i& v = all_.corners(group_);
    if (members_.size() == 1) {
      std::array<ExactPoint, 3> corners{all_.exact(v[0]), all_.exact(v[1]), all_.exact(v[2])};
      if (orient2d(corners[0], corners[1], corners[2], axis_) < 0) std::swap(corners[1], corners[2]);
      return corners;
    }
    Eigen::AlignedBox2d box;
    for (const int t : members_)
      for (int k = 0; k < 3; ++k) box.extend(seen(corner(t, k), axis_));
    const double step = std::exp2(std::ceil(std::log2(box.sizes().maxCoeff())));
    const Vector2d low = (box.min() / step).array().floor() * step - step;
    std::array<ExactPoint, 3> corners;
    for (int k = 0; k < 3; ++k) {
      Vector3d& p = corners[static_cast<std::size_t>(k)].near;
      p[(axis_ + 1) % 3] = low.x() + (k == 1 ? 8 * step : 0);
      p[(axis_ + 2) % 3] = low.y() + (k == 2 ? 8 * step : 0);
      corners[static_cast<std::size_t>(k)].exact.x = all_.numbers.of(p);
    }
    return corners;
  }

  std::array<int, 3> first_lines() {
    if (members_.size() > 1) return {-1, -1, -1};
    const std::array<ExactPoint, 3> corners = first_corners();
    return {side_line(corners[1].vertex, corners[2].vertex), side_line(corners[2].vertex, corners[0].vertex),
            side_line(corners[0].vertex, corners[1].vertex)};
  }

  struct Line {
    int u = -1, v = -1;  ///< along the side between two vertices
    int triangle = -1;   ///< or in the plane of a triangle
  };
  int side_line(int u, int v) {
    lines_.push_back({.u = u, .v = v});
    return static_cast<int>(lines_.size()) - 1;
  }

  const ExactPlane& plane_at(int t) {
    auto [place, is_new] = planes_.try_emplace(t);
    if (is_new) place->second = plane_of(t);
    return place->second;
  }

  ExactPoint rounded(HomogeneousPoint exact) const {
    ExactPoint p;
    p.near = all_.numbers.rounded(exact);
    p.error = 0x1p-53 * p.near.cwiseAbs().maxCoeff();
    p.exact = std::move(exact);
    return p;
  }

  ExactPoint crossing(int first, int second) {
    const Line& a = lines_[static_cast<std::size_t>(first)];
    const Line& b = lines_[static_cast<std::size_t>(second)];
    if (a.u < 0 && b.u < 0) return rounded(three_planes(plane_, plane_at(a.triangle), plane_at(b.triangle)));
    const Line& side = a.u >= 0 ? a : b;
    const Line& other = a.u >= 0 ? b : a;
    const auto place = [this](int v) { return all_.numbers.of(all_.point(v)); };
    if (other.u < 0) return rounded(line_and_plane(place(side.u), place(side.v), plane_at(other.triangle)));
    return rounded(line_and_plane(place(side.u), place(side.v), plane_along(place(other.u), place(other.v), axis_)));
  }

  int number_of(const PointKey& key) {
    const auto [place, is_new] = numbers_.try_emplace(key, -1);
    if (!is_new) return place->second;
    const auto [u, v, t] = key;
    if (v < 0) return place->second = cut_.insert(all_.exact(u));
    const ExactPlane& plane = t == group_ ? plane_ : plane_at(t);
    return place->second =
               cut_.insert(rounded(line_and_plane(all_.numbers.of(all_.point(u)), all_.numbers.of(all_.point(v)), plane)));
  }

  // ------------------------------------------------------------------------------------------------------ where triangles meet

  /// Whether a triangle holds a point of its plane.
  bool holds(int t, const Vector3d& p) const {
    const int axis = best_axis(corner(t, 0), corner(t, 1), corner(t, 2));
    int low = 0, high = 0;
    for (int k = 0; k < 3; ++k) {
      const int s = orient2d(seen(corner(t, k), axis), seen(corner(t, (k + 1) % 3), axis), seen(p, axis));
      low = std::min(low, s);
      high = std::max(high, s);
    }
    return low == 0 || high == 0;
  }

  /// Appends where the corners and sides of s meet t.
  void add_meetings(int s, int t, std::vector<PointKey>& points) const {
    std::array<int, 3> side{};
    for (int k = 0; k < 3; ++k)
      side[static_cast<std::size_t>(k)] = orient3d(corner(t, 0), corner(t, 1), corner(t, 2), corner(s, k));
    for (int k = 0; k < 3; ++k) {
      const int u = all_.corners(s)[k];
      const int v = all_.corners(s)[(k + 1) % 3];
      const int su = side[static_cast<std::size_t>(k)];
      const int sv = side[static_cast<std::size_t>((k + 1) % 3)];
      if (su == 0 && ((all_.corners(t).array() == u).any() || holds(t, all_.point(u)))) points.push_back(at_vertex(u));
      if (su * sv < 0) add_crossing(std::minmax(u, v), t, points);
    }
  }

  /// Of a side whose ends lie on different sides of t.
  void add_crossing(std::pair<int, int> side, int t, std::vector<PointKey>& points) const {
    std::array<int, 3> s{};
    int low = 0, high = 0;
    for (int k = 0; k < 3; ++k) {
      const int sign = orient3d(all_.point(side.first), all_.point(side.second), corner(t, k), corner(t, (k + 1) % 3));
      s[static_cast<std::size_t>(k)] = sign;
      low = std::min(low, sign);
      high = std::max(high, sign);
      if (low < 0 && high > 0) return;
    }
    for (int k = 0; k < 3; ++k)
      if (s[static_cast<std::size_t>(k)] == 0 && s[static_cast<std::size_t>((k + 1) % 3)] == 0) {
        points.push_back(at_vertex(all_.corners(t)[(k + 1) % 3]));
        return;
      }
    points.push_back({side.first, side.second, t});
  }

  /// Of operand k: the sides of its triangles in the plane, and what others have in common with the group.
  void put_in(int k) {
    ++stamp_;
    std::vector<PointKey> points;
    for (const int t : members_) {
      if (operand(t) == k && members_.size() > 1) put_sides(t);
      const ByOperand before{all_.all.operand};
      const auto first = std::lower_bound(cutters(t).begin(), cutters(t).end(), k, before);
      const auto last = std::lower_bound(first, cutters(t).end(), k + 1, before);
      for (const int s : std::span(first, last)) {
        if (!near_alive(s)) continue;
        points.clear();
        add_meetings(s, t, points);
        add_meetings(t, s, points);
        put_segment(points, s);
      }
    }
  }

  void put_sides(int t) {
    const Vector3i& v = all_.corners(t);
    for (int k = 0; k < 3; ++k) {
      const int a = number_of(at_vertex(v[k]));
      const int b = number_of(at_vertex(v[(k + 1) % 3]));
      cut_.insert(a, b, {.line = side_line(v[k], v[(k + 1) % 3]), .stamp = stamp_});
    }
  }

  /// Between the at most two different points in which two triangles begin and cease to meet.
  void put_segment(std::vector<PointKey>& points, int triangle) {
    std::sort(points.begin(), points.end());
    points.erase(std::unique(points.begin(), points.end()), points.end());
    int a = -1, b = -1;
    for (const PointKey& key : points) {
      const int p = number_of(in_plane(key));
      if (a < 0)
        a = p;
      else if (p != a)
        b = p;
    }
    if (b < 0) return;
    lines_.push_back({.triangle = triangle});
    cut_.insert(a, b, {.line = static_cast<int>(lines_.size()) - 1, .stamp = stamp_});
  }

  /// A side that crosses any triangle of the group crosses its plane in the same point.
  PointKey in_plane(PointKey key) const {
    if (key[2] >= 0 && std::binary_search(members_.begin(), members_.end(), key[2])) key[2] = group_;
    return key;
  }

  // ------------------------------------------------------------------------------------------------------ what is kept

  /// The box of what is still wanted.
  void find_alive() {
    alive_.setEmpty();
    for (const CutPlane::Face& f : cut_.faces())
      for (std::size_t k = 0; k < 3 && f.alive; ++k) {
        const ExactPoint& p = cut_.points()[static_cast<std::size_t>(f.vertex[k])];
        alive_.extend(p.near - Vector3d::Constant(p.error));
        alive_.extend(p.near + Vector3d::Constant(p.error));
      }
  }

  /// Whether a triangle may meet what is still wanted, or its rim.
  bool near_alive(int t) const {
    Eigen::AlignedBox3d box;
    for (int k = 0; k < 3; ++k) box.extend(corner(t, k));
    return alive_.intersects(box);
  }

  /// Operands in the order in which least is left to do: first those by which the middle of the first triangle is given up.
  std::vector<int> most_first(std::vector<int> operands) const {
    const Vector3i& v = all_.corners(group_);
    const ExactPoint a = all_.exact(v[0]), b = all_.exact(v[1]), c = all_.exact(v[2]);
    const Probe middle(a, b, c, axis_);
    std::stable_partition(operands.begin(), operands.end(),
                          [&](int k) { return !all_.rule.holds(k, all_.windings.beside(k, middle, -1).below); });
    return operands;
  }

  template <typename Test>
  void give_up(const Test& test) {
    for (CutPlane::Face& f : cut_.faces())
      if (test(f)) f.alive = false;
  }

  double area(const CutPlane::Face& f) const {
    const auto at = [&](std::size_t k) { return seen(cut_.points()[static_cast<std::size_t>(f.vertex[k])].near, axis_); };
    const Vector2d u = at(1) - at(0), v = at(2) - at(0);
    return u.x() * v.y() - u.y() * v.x();
  }

  /// Calls visit(faces, probe) for the faces still wanted that hang together without passing a side with the stamp.
  template <typename Visit>
  void for_regions(int stamp, const Visit& visit) {
    std::vector<char> seen_before(cut_.faces().size(), 0);
    std::vector<int> region;
    for (std::size_t first = 0; first < cut_.faces().size(); ++first) {
      if (!cut_.faces()[first].alive || seen_before[first]) continue;
      region.assign(1, static_cast<int>(first));
      seen_before[first] = 1;
      std::size_t largest = first;
      for (std::size_t n = 0; n < region.size(); ++n) {
        const auto face = static_cast<std::size_t>(region[n]);
        const CutPlane::Face& f = cut_.faces()[face];
        if (area(f) > area(cut_.faces()[largest])) largest = face;
        for (std::size_t k = 0; k < 3; ++k) {
          const int beyond = f.neighbour[k];
          if (beyond < 0 || (stamp >= 0 && f.stamp[k] == stamp)) continue;
          if (!cut_.faces()[static_cast<std::size_t>(beyond)].alive || seen_before[static_cast<std::size_t>(beyond)]) continue;
          seen_before[static_cast<std::size_t>(beyond)] = 1;
          region.push_back(beyond);
        }
      }
      const auto point = [&](std::size_t k) -> const ExactPoint& {
        return cut_.points()[static_cast<std::size_t>(cut_.faces()[largest].vertex[k])];
      };
      visit(region, Probe(point(0), point(1), point(2), axis_));
    }
  }

  /// The condition on operand k, whose segments have been put in.
  void settle(int k) {
    for_regions(stamp_, [&](const std::vector<int>& region, const Probe& probe) {
      const Beside beside = all_.windings.beside(k, probe, group_);
      const bool below = all_.rule.holds(k, beside.below);
      const bool above = all_.rule.holds(k, beside.below + beside.step);
      for (const int n : region) {
        CutPlane::Face& f = cut_.faces()[static_cast<std::size_t>(n)];
        f.below = f.below && below;
        f.above = f.above && above;
        f.alive = f.below || f.above;
      }
    });
  }

  /// Which triangles of the group lie on which faces; those on which none does are given up.
  void find_covered(const std::vector<int>& covering) {
    if (members_.size() == 1) {
      covers_.push_back(members_);
      return;
    }
    ++stamp_;
    for (const int t : members_) put_sides(t);
    for_regions(stamp_, [&](const std::vector<int>& region, const Probe& probe) {
      std::vector<int> on;
      for (const int k : covering) {
        const Beside beside = all_.windings.beside(k, probe, group_);
        on.insert(on.end(), beside.on.begin(), beside.on.end());
      }
      for (const int n : region) {
        CutPlane::Face& f = cut_.faces()[static_cast<std::size_t>(n)];
        f.cover = static_cast<int>(covers_.size());
        f.alive = !on.empty();
      }
      covers_.push_back(std::move(on));
    });
  }

  /// The conditions on operands that the group does not meet.
  void settle_others(const std::vector<int>& met) {
    for_regions(-1, [&](const std::vector<int>& region, const Probe& probe) {
      if (all_.others_hold(probe, met)) return;
      for (const int n : region) cut_.faces()[static_cast<std::size_t>(n)].alive = false;
    });
  }

  /// The triangle that a face is taken from: the first that faces the same way, or else the first.
  struct Source {
    int triangle = -1;
    bool turned = true;
  };
  Source source(const CutPlane::Face& f, bool up) const {
    Source found;
    for (const int t : covers_[static_cast<std::size_t>(f.cover)]) {
      const bool turned = (all_.windings.facing(t, axis_) > 0) != up;
      if (found.triangle < 0 || turned < found.turned || (turned == found.turned && t < found.triangle)) found = {t, turned};
    }
    return found;
  }

  /// How many faces a triangle has, and how many of them are taken from it one way and the other.
  struct Share {
    int faces = 0, kept = 0, turned = 0;
  };

  BoundaryPart result() {
    cut_.improve();
    BoundaryPart part;
    std::vector<int> number(cut_.points().size(), -1);
    std::map<int, Share> shares;
    for (const CutPlane::Face& f : cut_.faces()) {
      for (const int t : covers_[static_cast<std::size_t>(f.cover)]) ++shares[t].faces;
      if (!f.alive) continue;
      const bool up = all_.rule.solid(f.below);
      const Source from = source(f, up);
      ++(from.turned ? shares[from.triangle].turned : shares[from.triangle].kept);
      BoundaryPart::Triangle triangle{f.vertex, from.triangle};
      if (!up) std::swap(triangle.point[1], triangle.point[2]);
      for (int& v : triangle.point) {
        int& n = number[static_cast<std::size_t>(v)];
        if (n < 0) {
          n = static_cast<int>(part.points.size());
          part.points.push_back(cut_.points()[static_cast<std::size_t>(v)].near);
        }
        v = n;
      }
      part.triangles.push_back(triangle);
    }
    for (const auto& [triangle, share] : shares)
      if (share.kept == share.faces || share.turned == share.faces) part.whole.push_back({triangle, share.turned > 0});
    return part;
  }

  const Arrangement& all_;
  const std::vector<int>& members_;
  int group_;
  int axis_;
  ExactPlane plane_;
  std::vector<Line> lines_;
  CutPlane cut_;
  std::map<PointKey, int> numbers_;
  std::map<int, ExactPlane> planes_;
  int stamp_ = 0;
  Eigen::AlignedBox3d alive_{Vector3d::Constant(-std::numeric_limits<double>::infinity()),
                             Vector3d::Constant(std::numeric_limits<double>::infinity())};  ///< what is still wanted lies in it
  std::vector<std::vector<int>> covers_;  ///< sets of triangles that lie on the same faces
};

}  // namespace

bool Arrangement::others_hold(const Probe& probe, const std::vector<int>& known) const {
  int wanted = 0;  // operands that the point has to lie in
  for (int k = 0; k < all.count && rule.wants_inside(k); ++k)
    if (!std::binary_search(known.begin(), known.end(), k)) ++wanted;
  bool hold = true;
  windings.for_others(probe, known, [&](int k, int winding) {
    hold = rule.holds(k, winding);
    if (rule.wants_inside(k)) --wanted;
    return hold;
  });
  return hold && wanted == 0;
}

BoundaryPart cut_group(const Arrangement& arrangement, const std::vector<int>& members) {
  return CutGroup(arrangement, members).run();
}

}  // namespace rayrep
