#include "motion/travel.h"

#include <algorithm>
#include <array>
#include <cmath>

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

}  // namespace

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
