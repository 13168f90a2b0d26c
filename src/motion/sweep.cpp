#include "motion/sweep.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <set>
#include <vector>

#include "mesh/triangle_distance.h"

namespace rayrep {
namespace {

using Eigen::AlignedBox3d;
using Eigen::Isometry3d;
using Eigen::Vector3d;

/// Of a point to a segment.
double distance_to(const Vector3d& p, const Vector3d& a, const Vector3d& b) {
  const Vector3d along = b - a;
  const double length2 = along.squaredNorm();
  const double share = length2 > 0 ? std::clamp(along.dot(p - a) / length2, 0.0, 1.0) : 0;
  return (a + share * along - p).norm();
}

/// Between two segments.
double distance_of(const Vector3d& a, const Vector3d& b, const Vector3d& c, const Vector3d& d) {
  const Vector3d u = b - a, v = d - c, w = a - c;
  const double uu = u.squaredNorm(), uv = u.dot(v), vv = v.squaredNorm(), uw = u.dot(w), vw = v.dot(w);
  const double determinant = uu * vv - uv * uv;
  double best = std::min({distance_to(a, c, d), distance_to(b, c, d), distance_to(c, a, b), distance_to(d, a, b)});
  if (determinant > 1e-14 * uu * vv) {
    const double s = (uv * vw - vv * uw) / determinant, t = (uu * vw - uv * uw) / determinant;
    if (s > 0 && s < 1 && t > 0 && t < 1) best = std::min(best, (w + s * u - t * v).norm());
  }
  return best;
}

/// Between a segment and a triangle.
double distance_of(const Vector3d& a, const Vector3d& b, const Corners3& t) {
  const Vector3d normal = (t[1] - t[0]).cross(t[2] - t[0]);
  const double from = normal.dot(a - t[0]), to = normal.dot(b - t[0]);
  if ((from > 0) != (to > 0)) {
    const Vector3d p = a + from / (from - to) * (b - a);
    bool inside = normal.squaredNorm() > 0;
    for (std::size_t k = 0; k < 3 && inside; ++k) inside = (t[(k + 1) % 3] - t[k]).cross(p - t[k]).dot(normal) >= 0;
    if (inside) return 0;
  }
  double best = std::min(point_triangle_distance(a, t[0], t[1], t[2]), point_triangle_distance(b, t[0], t[1], t[2]));
  for (std::size_t k = 0; k < 3; ++k) best = std::min(best, distance_of(a, b, t[k], t[(k + 1) % 3]));
  return best;
}

/// Of a segment from the surface of a body, by descent of its tree; `cap_mm` where it is further.
class SegmentDescent {
public:
  SegmentDescent(const SolidBody& body, const Vector3d& a, const Vector3d& b, double cap_mm)
      : body_(body), a_(a), b_(b), box_(a), best_(cap_mm) {
    box_.extend(b);
    visit(0, apart(0));
  }
  double distance_mm() const { return best_; }

private:
  double apart(int node) const { return apart(body_.tree().node(node).box); }
  double apart(const AlignedBox3d& box) const {
    return std::max(std::sqrt(box.squaredExteriorDistance(box_)), distance_to(box.center(), a_, b_) - box.diagonal().norm() / 2);
  }

  void visit(int number, double near) {
    if (near >= best_) return;
    const BoxTree::Node& node = body_.tree().node(number);
    if (node.is_leaf()) {
      for (std::size_t n = node.begin; n < node.end; ++n) {
        const int t = body_.tree().member(n);
        if (apart(body_.tree().box_of(t)) < best_) best_ = std::min(best_, distance_of(a_, b_, corners_of(body_.mesh(), t)));
      }
      return;
    }
    const std::array<int, 2> children = {number + 1, node.right};
    const std::array<double, 2> at = {apart(children[0]), apart(children[1])};
    const std::size_t nearer = at[1] < at[0] ? 1 : 0;
    visit(children[nearer], at[nearer]);
    visit(children[1 - nearer], at[1 - nearer]);
  }

  const SolidBody& body_;
  const Vector3d a_, b_;
  AlignedBox3d box_;
  double best_;
};

/// Bounds of a part's motion over a stretch of time without keys.
struct Rates {
  double speed = 0, acceleration = 0;  ///< of its translation
  double turning = 0;                  ///< rad
};

Rates rates_of(const Motion& motion, double from, double to) {
  Rates rates;
  const double middle = (from + to) / 2;
  for (std::size_t n = 0; n + 1 < motion.translation.size(); ++n) {
    const TranslationKey &a = motion.translation[n], &b = motion.translation[n + 1];
    if (middle < a.time || middle > b.time) continue;
    const double length = b.time - a.time;
    const std::array<Vector3d, 3> d = {3 * (a.out_mm - a.at_mm), 3 * (b.in_mm - a.out_mm), 3 * (b.at_mm - b.in_mm)};
    rates.speed = std::max({d[0].norm(), d[1].norm(), d[2].norm()}) / length;
    rates.acceleration = 2 * std::max((d[1] - d[0]).norm(), (d[2] - d[1]).norm()) / (length * length);
  }
  for (std::size_t n = 0; n + 1 < motion.rotation.size(); ++n) {
    const RotationKey &a = motion.rotation[n], &b = motion.rotation[n + 1];
    if (middle >= a.time && middle <= b.time) rates.turning = a.rotation.angularDistance(b.rotation) / (b.time - a.time);
  }
  return rates;
}

double farthest(const AlignedBox3d& box, const Vector3d& from) {
  double most = 0;
  for (int k = 0; k < 8; ++k) most = std::max(most, (box.corner(static_cast<AlignedBox3d::CornerType>(k)) - from).norm());
  return most;
}

std::vector<double> key_times(const Motion& a, const Motion& b) {
  std::set<double> times = {0, 1};
  for (const Motion* motion : {&a, &b}) {
    for (const TranslationKey& k : motion->translation) times.insert(k.time);
    for (const RotationKey& k : motion->rotation) times.insert(k.time);
  }
  return {times.begin(), times.end()};
}

}  // namespace

Sweep::Sweep(const Scene& scene, std::size_t part, std::size_t by, const AlignedBox3d& seen_in, double accuracy_mm)
    : body_(scene.parts[by].mesh), seen_in_(seen_in), accuracy_mm_(accuracy_mm) {
  body_.prepare();
  for (const Transition& transition : scene.transitions) add_transition(scene, transition, part, by);
  for (const SceneState& state : scene.states) {
    const Isometry3d seen =
        state.poses[by].about(scene.parts[by].pivot_mm).inverse() * state.poses[part].about(scene.parts[part].pivot_mm);
    pieces_.push_back({seen, seen});
  }
}

void Sweep::add_transition(const Scene& scene, const Transition& transition, std::size_t part, std::size_t by) {
  const Motion &host = transition.motions[part], &guest = transition.motions[by];
  const Vector3d &host_pivot = scene.parts[part].pivot_mm, &guest_pivot = scene.parts[by].pivot_mm;
  const double host_reach = farthest(seen_in_, host_pivot);
  const std::vector<double> times = key_times(host, guest);
  for (std::size_t n = 0; n + 1 < times.size(); ++n) {
    const double from = times[n], length = times[n + 1] - times[n];
    const Rates a = rates_of(host, from, times[n + 1]), b = rates_of(guest, from, times[n + 1]);
    // q = R_b^T w + c_b with w = X_a p - c_b - x_b: bounds of w and its derivatives, and so of q''.
    const Vector3d apart = host.at(from).about(host_pivot) * host_pivot - guest_pivot - guest.at(from).translation_mm;
    const double first = a.turning * host_reach + a.speed + b.speed;
    const double second = a.turning * a.turning * host_reach + a.acceleration + b.acceleration;
    const double size = apart.norm() + host_reach + first * length;
    const double bend = b.turning * b.turning * size + 2 * b.turning * first + second;
    const double step = std::sqrt(8 * accuracy_mm_ / std::max(bend, 1e-12));
    const int count = std::max(1, static_cast<int>(std::ceil(length / step)));
    const auto seen = [&](int k) {
      const double t = from + length * k / count;
      return guest.at(t).about(guest_pivot).inverse() * host.at(t).about(host_pivot);
    };
    for (int k = 0; k < count; ++k) pieces_.push_back({seen(k), seen(k + 1)});
  }
}

double Sweep::piece_distance(const Piece& piece, const Vector3d& p, double cap_mm, double deep_mm) const {
  const Vector3d a = piece.from * p, b = piece.to * p;
  AlignedBox3d way(a);
  way.extend(b);
  if (body_.box().squaredExteriorDistance(way) >= cap_mm * cap_mm) return cap_mm;
  const double distance = SegmentDescent(body_, a, b, std::max(cap_mm, deep_mm)).distance_mm();
  return distance > 0 && body_.contains(a) ? -distance : std::min(distance, cap_mm);
}

double Sweep::distance_mm(const Vector3d& p, double enough_mm, double cap_mm, std::size_t& hint) const {
  double best = cap_mm;
  const std::size_t first = hint;
  const auto look = [&](std::size_t n) {
    const double distance = piece_distance(pieces_[n], p, best, -enough_mm);
    if (distance >= best) return;
    best = distance;
    hint = n;
  };
  if (first < pieces_.size()) look(first);
  for (std::size_t n = 0; n < pieces_.size() && best > enough_mm; ++n)
    if (n != first) look(n);
  return best;
}

}  // namespace rayrep
