#include "motion/proximity.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <optional>
#include <queue>

namespace rayrep {
namespace {

using Eigen::AlignedBox3d;
using Eigen::Vector3d;

/// The second body's tree as it is seen from the first.
class PairDescent {
public:
  PairDescent(const SolidBody& first, const SolidBody& second, const Eigen::Isometry3d& pose)
      : first_(first), second_(second), pose_(pose), spread_(pose.linear().cwiseAbs()) {}

  /// Calls leaf(triangle of first, triangle of second) for pairs whose boxes are nearer than limit(), nearest nodes first.
  template <typename Limit, typename Leaf>
  void visit(const Limit& limit, const Leaf& leaf) const {
    visit(0, 0, apart(0, 0), limit, leaf);
  }

  /// A bound from below of the distance of what is in two boxes: by a box around the turned one, and by balls.
  double apart(const AlignedBox3d& a, const AlignedBox3d& b) const {
    const Vector3d half_a = a.sizes() / 2, half_b = b.sizes() / 2;
    const Vector3d between = pose_ * b.center() - a.center();
    const Vector3d gap = (between.cwiseAbs() - half_a - spread_ * half_b).cwiseMax(0);
    return std::max(gap.norm(), between.norm() - half_a.norm() - half_b.norm());
  }

  Corners3 moved(int triangle) const {
    Corners3 corners = corners_of(second_.mesh(), triangle);
    for (Vector3d& c : corners) c = pose_ * c;
    return corners;
  }

private:
  double apart(int a, int b) const { return apart(first_.tree().node(a).box, second_.tree().node(b).box); }

  template <typename Limit, typename Leaf>
  void visit(int a, int b, double near, const Limit& limit, const Leaf& leaf) const {
    if (near >= limit()) return;
    const BoxTree::Node& na = first_.tree().node(a);
    const BoxTree::Node& nb = second_.tree().node(b);
    if (na.is_leaf() && nb.is_leaf()) {
      for (std::size_t i = na.begin; i < na.end; ++i)
        for (std::size_t j = nb.begin; j < nb.end; ++j) {
          const int s = first_.tree().member(i), t = second_.tree().member(j);
          if (apart(first_.tree().box_of(s), second_.tree().box_of(t)) < limit()) leaf(s, t);
        }
      return;
    }
    const bool split_a = nb.is_leaf() || (!na.is_leaf() && na.box.sizes().squaredNorm() > nb.box.sizes().squaredNorm());
    const std::array<int, 2> as = split_a ? std::array{a + 1, na.right} : std::array{a, a};
    const std::array<int, 2> bs = split_a ? std::array{b, b} : std::array{b + 1, nb.right};
    const double one = apart(as[0], bs[0]), other = apart(as[1], bs[1]);
    const std::size_t nearer = other < one ? 1 : 0;
    visit(as[nearer], bs[nearer], std::min(one, other), limit, leaf);
    visit(as[1 - nearer], bs[1 - nearer], std::max(one, other), limit, leaf);
  }

  const SolidBody& first_;
  const SolidBody& second_;
  const Eigen::Isometry3d& pose_;
  Eigen::Matrix3d spread_;
};

/// Two bodies of which the second is moved without being turned: by slabs between them that are as wide all the time.
class SlabSearch {
public:
  SlabSearch(const SolidBody& first, const SolidBody& second, const Eigen::Isometry3d& pose,
             const std::vector<Vector3d>& offsets_mm, double gap_mm)
      : first_(first), second_(second), pose_(pose), spread_(pose.linear().cwiseAbs()), offsets_(offsets_mm), gap_(gap_mm) {
    for (const Vector3d& offset : offsets_) reach_.extend(offset);
  }

  bool apart(int a, int b) {
    const BoxTree::Node& na = first_.tree().node(a);
    const BoxTree::Node& nb = second_.tree().node(b);
    if (apart(na.box, nb.box)) return true;
    if (++looked_at_ > kMost) return false;
    if (na.is_leaf() && nb.is_leaf()) return leaves_apart(na, nb);
    const bool split_a = nb.is_leaf() || (!na.is_leaf() && na.box.sizes().squaredNorm() > nb.box.sizes().squaredNorm());
    if (split_a) return apart(a + 1, b) && apart(na.right, b);
    return apart(a, b + 1) && apart(a, nb.right);
  }

private:
  static constexpr int kMost = 100'000;  // pairs that are looked at

  /// By the slabs along the axes.
  bool apart(const AlignedBox3d& a, const AlignedBox3d& b) const {
    const Vector3d half = a.sizes() / 2 + spread_ * b.sizes() / 2;
    const Vector3d between = pose_ * b.center() - a.center();
    const Vector3d above = between + reach_.min() - half, below = -between - reach_.max() - half;
    return above.maxCoeff() > gap_ || below.maxCoeff() > gap_;
  }

  bool leaves_apart(const BoxTree::Node& na, const BoxTree::Node& nb) {
    for (std::size_t i = na.begin; i < na.end; ++i)
      for (std::size_t j = nb.begin; j < nb.end; ++j) {
        const int s = first_.tree().member(i), t = second_.tree().member(j);
        if (!apart(first_.tree().box_of(s), second_.tree().box_of(t)) && !triangles_apart(s, t)) return false;
      }
    return true;
  }

  /// By slabs across both triangles, and across from one to the other where they are nearest.
  bool triangles_apart(int s, int t) {
    ++looked_at_;
    const Corners3 p = corners_of(first_.mesh(), s);
    Corners3 q = corners_of(second_.mesh(), t);
    for (Vector3d& c : q) c = pose_ * c;
    for (const Vector3d& normal : {(p[1] - p[0]).cross(p[2] - p[0]), (q[1] - q[0]).cross(q[2] - q[0])})
      if (apart_across(p, q, normal) || apart_across(p, q, -normal)) return true;
    const NearestPair pair = triangle_distance(p, q);
    return apart_across(p, q, pair.on_second - pair.on_first);
  }

  bool apart_across(const Corners3& p, const Corners3& q, const Vector3d& across) const {
    const double length = across.norm();
    if (!(length > 0)) return false;
    const auto least = [&across](const auto& points) {
      double value = std::numeric_limits<double>::infinity();
      for (const Vector3d& point : points) value = std::min(value, across.dot(point));
      return value;
    };
    const double most = std::max({across.dot(p[0]), across.dot(p[1]), across.dot(p[2])});
    return least(q) - most + least(offsets_) > length * gap_;
  }

  const SolidBody& first_;
  const SolidBody& second_;
  const Eigen::Isometry3d& pose_;
  Eigen::Matrix3d spread_;
  const std::vector<Vector3d>& offsets_;
  AlignedBox3d reach_;
  double gap_;
  int looked_at_ = 0;
};

// ----------------------------------------------------------------------------------------------------------------------- depth

/// A part of the surface of a body in which the deepest point is looked for: a node of its tree, or a piece of a triangle.
struct Region {
  double at_most = 0;
  int node = -1;
  Corners3 corners;
};
bool operator<(const Region& a, const Region& b) { return a.at_most < b.at_most; }

/// The deepest point of the surface of `guest` in `host`, by descent: the depth of a point is 1-Lipschitz.
class DepthSearch {
public:
  DepthSearch(const SolidBody& host, const SolidBody& guest, const Eigen::Isometry3d& guest_in_host, Depth& best)
      : host_(host), guest_(guest), pose_(guest_in_host), best_(best) {}

  void run(const DepthWanted& wanted) {
    add_node(0);
    for (const Vector3d& p : guest_.inner_points()) look_at(pose_ * p);
    while (!open_.empty() && best_.at_least_mm < wanted.enough_mm && looked_at_ < wanted.points) {
      if (open_.top().at_most <= std::max(wanted.factor * best_.at_least_mm, wanted.least_mm)) break;
      const Region region = open_.top();
      open_.pop();
      split(region);
    }
  }

private:
  double look_at(const Vector3d& p) {
    ++looked_at_;
    const double depth = host_.depth_mm(p, best_.at_least_mm);
    if (depth > best_.at_least_mm) best_.at_least_mm = depth, best_.place_mm = p;
    return depth;
  }

  void add_node(int number) {
    const AlignedBox3d& box = guest_.tree().node(number).box;
    const double radius = box.diagonal().norm() / 2;
    const Vector3d centre = pose_ * box.center();
    ++looked_at_;
    // The middle of a box is no point of the body: it bounds, and is not taken.
    const double at_most = host_.depth_mm(centre, 0) + radius;
    if (at_most > best_.at_least_mm) open_.push({at_most, number, {}});
  }

  void add_piece(const Corners3& corners) {
    const Vector3d middle = (corners[0] + corners[1] + corners[2]) / 3;
    double radius = 0;
    for (const Vector3d& c : corners) radius = std::max(radius, (c - middle).norm());
    const double at_most = look_at(middle) + radius;
    if (at_most > best_.at_least_mm) open_.push({at_most, -1, corners});
  }

  void split(const Region& region) {
    if (region.node < 0) {
      const Corners3& c = region.corners;
      const Corners3 m = {(c[0] + c[1]) / 2, (c[1] + c[2]) / 2, (c[2] + c[0]) / 2};
      for (const Corners3& piece : {Corners3{c[0], m[0], m[2]}, {m[0], c[1], m[1]}, {m[2], m[1], c[2]}, m}) add_piece(piece);
      return;
    }
    const BoxTree::Node& node = guest_.tree().node(region.node);
    if (node.is_leaf()) {
      for (std::size_t n = node.begin; n < node.end; ++n) {
        Corners3 corners = corners_of(guest_.mesh(), guest_.tree().member(n));
        for (Vector3d& c : corners) c = pose_ * c;
        add_piece(corners);
      }
    } else {
      add_node(region.node + 1);
      add_node(node.right);
    }
  }

  const SolidBody& host_;
  const SolidBody& guest_;
  const Eigen::Isometry3d& pose_;
  Depth& best_;
  std::priority_queue<Region> open_;
  int looked_at_ = 0;
};

/// Points of the surface of the guest that are likely to be inside its host where the surfaces just cross: corners of the triangles
/// that do, and the middles of what crossings and corners divide their sides into. In the frame of the first body.
std::vector<Vector3d> likely_inside(const std::vector<ContourPiece>& pieces, const PairDescent& descent, const SolidBody& first,
                                    bool second_is_guest) {
  std::vector<Vector3d> points;
  std::map<std::pair<int, std::size_t>, std::vector<Vector3d>> on_side;
  for (const ContourPiece& piece : pieces) {
    const int triangle = second_is_guest ? piece.second : piece.first;
    const Corners3 corners = second_is_guest ? descent.moved(triangle) : corners_of(first.mesh(), triangle);
    points.insert(points.end(), corners.begin(), corners.end());
    for (const ContourPiece::End& end : piece.ends) {
      if (end.moved_side != second_is_guest) continue;
      const auto k = static_cast<std::size_t>(end.side);
      std::vector<Vector3d>& crossings = on_side[{triangle, k}];
      if (crossings.empty()) crossings = {corners[k], corners[(k + 1) % 3]};
      crossings.push_back(end.at_mm);
    }
  }
  for (auto& [side, crossings] : on_side) {
    const Vector3d from = crossings[0], along = crossings[1] - crossings[0];
    std::sort(crossings.begin(), crossings.end(),
              [&](const Vector3d& a, const Vector3d& b) { return along.dot(a - from) < along.dot(b - from); });
    for (std::size_t n = 1; n < crossings.size(); ++n) points.push_back((crossings[n - 1] + crossings[n]) / 2);
  }
  return points;
}

/// The same for bodies that are in each other by very little: by where their surfaces cross.
void look_at_contour(const SolidBody& first, const SolidBody& second, const Eigen::Isometry3d& pose, Depth& best) {
  constexpr std::size_t kMost = 64;
  const PairDescent descent(first, second, pose);
  const std::vector<ContourPiece> pieces = contour(first, second, pose, kMost);
  for (const Vector3d& p : likely_inside(pieces, descent, first, true)) {
    const double depth = first.depth_mm(p, best.at_least_mm);
    if (depth > best.at_least_mm) best.at_least_mm = depth, best.place_mm = p;
  }
  const Eigen::Isometry3d back = pose.inverse();
  for (const Vector3d& p : likely_inside(pieces, descent, first, false)) {
    const double depth = second.depth_mm(back * p, best.at_least_mm);
    if (depth > best.at_least_mm) best.at_least_mm = depth, best.place_mm = p;
  }
}

// --------------------------------------------------------------------------------------------------------------------- contour

/// Where sides of `sides` meet the plane of `plane`: two of them, for triangles that reach both sides of it.
struct Meeting {
  std::array<ContourPiece::End, 2> ends;
  std::array<double, 2> along;  ///< the line of both planes
};

std::optional<Meeting> meet(const Corners3& sides, const Vector3d& on_plane, const Vector3d& normal, const Vector3d& line) {
  std::array<double, 3> height;
  for (std::size_t k = 0; k < 3; ++k) height[k] = normal.dot(sides[k] - on_plane);
  Meeting meeting;
  std::size_t found = 0;
  for (std::size_t k = 0; k < 3 && found < 2; ++k) {
    const std::size_t l = (k + 1) % 3;
    if ((height[k] > 0) == (height[l] > 0)) continue;
    const Vector3d along = sides[l] - sides[k];
    meeting.ends[found] = {sides[k] + height[k] / (height[k] - height[l]) * along, along, normal, false, static_cast<int>(k)};
    meeting.along[found] = line.dot(meeting.ends[found].at_mm);
    ++found;
  }
  if (found < 2) return std::nullopt;
  if (meeting.along[0] > meeting.along[1]) {
    std::swap(meeting.ends[0], meeting.ends[1]);
    std::swap(meeting.along[0], meeting.along[1]);
  }
  return meeting;
}

std::optional<ContourPiece> crossing(const Corners3& p, const Corners3& q) {
  const Vector3d np = (p[1] - p[0]).cross(p[2] - p[0]);
  const Vector3d nq = (q[1] - q[0]).cross(q[2] - q[0]);
  const Vector3d line = np.cross(nq);
  const std::optional<Meeting> of_p = meet(p, q[0], nq, line);
  if (!of_p) return std::nullopt;
  const std::optional<Meeting> of_q = meet(q, p[0], np, line);
  if (!of_q) return std::nullopt;
  ContourPiece piece;
  const bool begins_in_q = of_q->along[0] > of_p->along[0], ends_in_q = of_q->along[1] < of_p->along[1];
  if (std::min(of_p->along[1], of_q->along[1]) <= std::max(of_p->along[0], of_q->along[0])) return std::nullopt;
  piece.ends[0] = begins_in_q ? of_q->ends[0] : of_p->ends[0];
  piece.ends[1] = ends_in_q ? of_q->ends[1] : of_p->ends[1];
  piece.ends[0].moved_side = begins_in_q;
  piece.ends[1].moved_side = ends_in_q;
  return piece;
}

}  // namespace

Nearness nearness(const SolidBody& first, const SolidBody& second, const Eigen::Isometry3d& pose, double cap_mm, double loose) {
  const PairDescent descent(first, second, pose);
  Nearness found;
  found.at_most_mm = std::numeric_limits<double>::infinity();
  double limit = cap_mm;
  descent.visit([&limit] { return limit; },
                [&](int s, int t) {
                  const NearestPair pair = triangle_distance(corners_of(first.mesh(), s), descent.moved(t));
                  if (pair.distance_mm >= found.at_most_mm) return;
                  found = {0, pair.distance_mm, pair, s, t};
                  limit = std::min(cap_mm, pair.distance_mm / loose);
                });
  found.at_least_mm = limit;
  return found;
}

double apart_by_boxes(const SolidBody& first, const SolidBody& second, const Eigen::Isometry3d& pose) {
  const double seen_from_first = PairDescent(first, second, pose).apart(first.box(), second.box());
  const Eigen::Isometry3d back = pose.inverse();
  return std::max(seen_from_first, PairDescent(second, first, back).apart(second.box(), first.box()));
}

bool keeps_apart(const SolidBody& first, const SolidBody& second, const Eigen::Isometry3d& pose,
                 const std::vector<Vector3d>& offsets_mm, double gap_mm) {
  return SlabSearch(first, second, pose, offsets_mm, gap_mm).apart(0, 0);
}

bool one_holds_other(const SolidBody& first, const SolidBody& second, const Eigen::Isometry3d& pose) {
  for (const Vector3d& p : second.corners())
    if (first.contains(pose * p)) return true;
  const Eigen::Isometry3d back = pose.inverse();
  for (const Vector3d& p : first.corners())
    if (second.contains(back * p)) return true;
  return false;
}

Depth depth_inside(const SolidBody& first, const SolidBody& second, const Eigen::Isometry3d& pose, const DepthWanted& wanted) {
  Depth best;
  DepthSearch(first, second, pose, best).run(wanted);
  if (best.at_least_mm >= wanted.enough_mm) return best;
  const double in_first = best.at_least_mm;
  const Eigen::Isometry3d back = pose.inverse();
  DepthSearch(second, first, back, best).run(wanted);
  if (best.at_least_mm > in_first) best.place_mm = pose * best.place_mm;
  if (best.at_least_mm <= 2 * wanted.least_mm || wanted.factor < 2) look_at_contour(first, second, pose, best);
  return best;
}

std::vector<ContourPiece> contour(const SolidBody& first, const SolidBody& second, const Eigen::Isometry3d& pose,
                                  std::size_t most) {
  const PairDescent descent(first, second, pose);
  std::vector<ContourPiece> pieces;
  // Boxes that touch count.
  descent.visit([&] { return pieces.size() < most ? std::numeric_limits<double>::min() : 0; },
                [&](int s, int t) {
                  auto piece = crossing(corners_of(first.mesh(), s), descent.moved(t));
                  if (!piece) return;
                  piece->first = s;
                  piece->second = t;
                  pieces.push_back(*piece);
                });
  return pieces;
}

}  // namespace rayrep
