#include "motion/travel.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "motion/keys.h"

namespace rayrep {
namespace {

using Eigen::Vector3d;

/// Pieces of a stretch between two keys of which each has a bound of its own for the speed.
constexpr int kPieces = 8;

/// For rounding, in times and speeds.
constexpr double kMore = 1 + 1e-9;

/// Largest speed on a part of a Bezier curve, per its whole parameter: a control point of its derivative there.
double fastest(const TranslationKey& a, const TranslationKey& b, double from, double to) {
  const std::array<Vector3d, 3> d = {3 * (a.out_mm - a.at_mm), 3 * (b.in_mm - a.out_mm), 3 * (b.at_mm - b.in_mm)};
  const auto blossom = [&d](double s, double t) -> Vector3d {
    return (1 - s) * ((1 - t) * d[0] + t * d[1]) + s * ((1 - t) * d[1] + t * d[2]);
  };
  return std::max({blossom(from, from).norm(), blossom(from, to).norm(), blossom(to, to).norm()});
}

using Curve = std::array<Vector3d, 4>;

/// The control points of what a cubic Bezier curve is from `from` to `to` of its parameter.
Curve restricted(const Curve& curve, double from, double to) {
  const auto blossom = [&curve](double r, double s, double t) {
    Curve p = curve;
    std::size_t left = 3;
    for (const double at : {r, s, t}) {
      for (std::size_t k = 0; k < left; ++k) p[k] = (1 - at) * p[k] + at * p[k + 1];
      --left;
    }
    return p[0];
  };
  return {blossom(from, from, from), blossom(from, from, to), blossom(from, to, to), blossom(to, to, to)};
}

/// The way of a body during a stretch of time without keys in it.
Curve curve_of(const std::vector<TranslationKey>& keys, double from, double to) {
  if (keys.size() < 2) {
    const Vector3d at = keys.empty() ? Vector3d::Zero() : keys.front().at_mm;
    return {at, at, at, at};
  }
  const std::size_t n = piece_at(keys, (from + to) / 2).first;
  const TranslationKey& a = keys[n];
  const TranslationKey& b = keys[n + 1];
  const double length = b.time - a.time;
  return restricted({a.at_mm, a.out_mm, b.in_mm, b.at_mm}, (from - a.time) / length, (to - a.time) / length);
}

/// Of a body during a stretch of time without keys in it, per unit of time.
Vector3d angular_velocity(const std::vector<RotationKey>& keys, double from, double to) {
  if (keys.size() < 2) return Vector3d::Zero();
  const std::size_t n = piece_at(keys, (from + to) / 2).first;
  const Eigen::Quaterniond turn = keys[n + 1].rotation * keys[n].rotation.conjugate();
  // The way that slerp goes, of two that are as long, too.
  const double sign = keys[n].rotation.dot(keys[n + 1].rotation) < 0 ? -1 : 1;
  const double sine = turn.vec().norm();
  if (!(sine > 0)) return Vector3d::Zero();
  const double angle = 2 * std::atan2(sine, std::max(sign * turn.w(), 0.0));
  return sign * angle / (keys[n + 1].time - keys[n].time) / sine * turn.vec();
}

/// Largest length of w' - angular velocity x w, on a stretch of time: a control point of that cubic.
double fastest_seen(const Curve& w, const Vector3d& angular, double length) {
  const std::array<Vector3d, 3> d = {3 * (w[1] - w[0]) / length, 3 * (w[2] - w[1]) / length, 3 * (w[3] - w[2]) / length};
  const Curve velocity = {d[0], (d[0] + 2 * d[1]) / 3, (2 * d[1] + d[2]) / 3, d[2]};
  double most = 0;
  for (std::size_t k = 0; k < w.size(); ++k) most = std::max(most, (velocity[k] - angular.cross(w[k])).norm());
  return most;
}

std::vector<double> times_of(const Motion& a, const Motion& b) {
  std::vector<double> times = {0, 1};
  for (const Motion* motion : {&a, &b}) {
    for (const TranslationKey& key : motion->translation) times.push_back(key.time);
    for (const RotationKey& key : motion->rotation) times.push_back(key.time);
  }
  std::sort(times.begin(), times.end());
  times.erase(std::unique(times.begin(), times.end()), times.end());
  return times;
}

}  // namespace

Travel Travel::seen_from(const Motion& other, const Motion& motion, const Vector3d& between_mm) {
  Travel seen;
  seen.times_ = {0};
  seen.lengths_ = {0};
  const std::vector<double> times = times_of(other, motion);
  for (std::size_t n = 0; n + 1 < times.size(); ++n)
    for (int k = 0; k < kPieces; ++k) {
      const double length = (times[n + 1] - times[n]) / kPieces;
      const double from = times[n] + k * length, to = k + 1 < kPieces ? from + length : times[n + 1];
      const Curve a = curve_of(other.translation, from, to);
      Curve w = curve_of(motion.translation, from, to);
      for (std::size_t c = 0; c < w.size(); ++c) w[c] += between_mm - a[c];
      seen.times_.push_back(to);
      seen.lengths_.push_back(seen.lengths_.back() +
                              kMore * length * fastest_seen(w, angular_velocity(motion.rotation, from, to), length));
    }
  return seen;
}

std::vector<Vector3d> hull_of_way(const Motion& other, const Motion& motion, double from, double to) {
  std::vector<double> times = times_of(other, motion);
  std::erase_if(times, [&](double time) { return time <= from || time >= to; });
  times.insert(times.begin(), from);
  times.push_back(to);
  std::vector<Vector3d> points;
  for (std::size_t n = 0; n + 1 < times.size(); ++n) {
    const Curve a = curve_of(other.translation, times[n], times[n + 1]), b = curve_of(motion.translation, times[n], times[n + 1]);
    for (std::size_t c = 0; c < a.size(); ++c) points.push_back(b[c] - a[c]);
  }
  return points;
}

Travel::Travel(const Motion& motion, double reach_mm) : Travel() {
  Travel moved, turned;
  if (motion.translation.size() > 1) {
    moved.times_ = {0};
    moved.lengths_ = {0};
  }
  for (std::size_t n = 0; n + 1 < motion.translation.size(); ++n) {
    const TranslationKey& a = motion.translation[n];
    const TranslationKey& b = motion.translation[n + 1];
    for (int k = 0; k < kPieces; ++k) {
      const double from = static_cast<double>(k) / kPieces, to = static_cast<double>(k + 1) / kPieces;
      moved.times_.push_back(a.time + to * (b.time - a.time));
      moved.lengths_.push_back(moved.lengths_.back() + kMore * fastest(a, b, from, to) / kPieces);
    }
  }
  if (motion.rotation.size() > 1) {
    turned.times_ = {0};
    turned.lengths_ = {0};
  }
  for (std::size_t n = 0; n + 1 < motion.rotation.size(); ++n) {
    const double angle = motion.rotation[n].rotation.angularDistance(motion.rotation[n + 1].rotation);
    turned.times_.push_back(motion.rotation[n + 1].time);
    turned.lengths_.push_back(turned.lengths_.back() + kMore * angle * reach_mm);
  }
  *this = of_both(moved, turned);
}

Travel Travel::of_both(const Travel& a, const Travel& b) {
  Travel both;
  both.times_.clear();
  std::set_union(a.times_.begin(), a.times_.end(), b.times_.begin(), b.times_.end(), std::back_inserter(both.times_));
  both.times_.erase(std::unique(both.times_.begin(), both.times_.end()), both.times_.end());
  both.lengths_.clear();
  for (const double t : both.times_) both.lengths_.push_back(a.at(t) + b.at(t));
  return both;
}

double Travel::at(double time) const {
  if (time <= times_.front()) return lengths_.front();
  if (time >= times_.back()) return lengths_.back();
  const auto n = static_cast<std::size_t>(std::upper_bound(times_.begin(), times_.end(), time) - times_.begin());
  const double share = (time - times_[n - 1]) / (times_[n] - times_[n - 1]);
  return lengths_[n - 1] + share * (lengths_[n] - lengths_[n - 1]);
}

double Travel::middle(double from, double to) const {
  const double begin = at(from), end = at(to);
  if (!(end > begin)) return (from + to) / 2;
  const double middle = later(from, (end - begin) / 2, to);
  // Never at an end, where a long rest may put it.
  return std::clamp(middle, from + (to - from) / 64, to - (to - from) / 64);
}

double Travel::later(double time, double length, double limit) const {
  const double wanted = at(time) + length;
  const auto n = static_cast<std::size_t>(std::lower_bound(lengths_.begin(), lengths_.end(), wanted) - lengths_.begin());
  if (n == lengths_.size()) return limit;
  if (n == 0) return std::clamp(times_.front(), time, limit);
  const double share = (wanted - lengths_[n - 1]) / (lengths_[n] - lengths_[n - 1]);
  return std::clamp(times_[n - 1] + share * (times_[n] - times_[n - 1]), time, limit);
}

double Travel::earlier(double time, double length, double limit) const {
  const double wanted = at(time) - length;
  const auto n = static_cast<std::size_t>(std::upper_bound(lengths_.begin(), lengths_.end(), wanted) - lengths_.begin());
  if (n == 0) return limit;
  if (n == lengths_.size()) return std::clamp(times_.back(), limit, time);
  const double share = (wanted - lengths_[n - 1]) / (lengths_[n] - lengths_[n - 1]);
  return std::clamp(times_[n - 1] + share * (times_[n] - times_[n - 1]), limit, time);
}

}  // namespace rayrep
