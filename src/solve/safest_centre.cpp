#include "solve/safest_centre.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "base/linear_algebra.h"
#include "base/nonnegative.h"

namespace rayrep::detail {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kMet = 1e-9;  ///< misses below it, over the size, count as none
constexpr double kSteepest = 1e3;

/// A row for (m, m c) over their units.
Eigen::Vector4d scaled(const CentreProblem::Row& row, double length_mm) { return {row[0] / length_mm, row[1], row[2], row[3]}; }

}  // namespace

double CentreProblem::smallest_ratio(const Eigen::Vector3d& centre_mm) const {
  Eigen::Vector4d s;
  s << 1, centre_mm;
  double smallest = kInfinity;
  for (const Ratio& r : ratios) smallest = std::min(smallest, r.rise.dot(s) / r.run.dot(s));
  return smallest;
}

/// A problem at a ratio, or without its ratios, as misses that shall not be positive (at_most) or not differ from 0 (level).
struct CentreSearch::Rows {
  Eigen::MatrixXd at_most;  ///< the ratios first
  Eigen::MatrixXd level;
  Eigen::VectorXd level_0;
  Eigen::MatrixXd rise, run;  ///< of the ratios, over the length of (1, ratio)

  static Rows at(const CentreProblem& problem, const std::optional<double>& ratio, double length_mm, double unit_mm3) {
    const auto ratios = static_cast<Eigen::Index>(ratio ? problem.ratios.size() : 0);
    const double size = std::hypot(1, ratio.value_or(0));
    Rows rows;
    rows.rise.resize(ratios, 4);
    rows.run.resize(ratios, 4);
    for (Eigen::Index k = 0; k < ratios; ++k) {
      const CentreProblem::Ratio& r = problem.ratios[static_cast<std::size_t>(k)];
      rows.rise.row(k) = scaled(r.rise, length_mm).transpose() / size;
      rows.run.row(k) = scaled(r.run, length_mm).transpose() / size;
    }
    rows.at_most.resize(ratios + static_cast<Eigen::Index>(problem.at_most.size()), 4);
    rows.at_most.topRows(ratios) = ratio.value_or(0) * rows.run - rows.rise;
    for (std::size_t k = 0; k < problem.at_most.size(); ++k)
      rows.at_most.row(ratios + static_cast<Eigen::Index>(k)) = scaled(problem.at_most[k], length_mm).transpose();
    const auto levels = static_cast<Eigen::Index>(problem.level.size());
    rows.level = Eigen::MatrixXd::Zero(levels + (problem.volume_mm3 ? 1 : 0), 4);
    rows.level_0 = Eigen::VectorXd::Zero(rows.level.rows());
    for (Eigen::Index k = 0; k < levels; ++k)
      rows.level.row(k) = scaled(problem.level[static_cast<std::size_t>(k)], length_mm).transpose();
    if (problem.volume_mm3) {
      rows.level(levels, 0) = unit_mm3 / *problem.volume_mm3;
      rows.level_0[levels] = -1;
    }
    return rows;
  }
};

/// The mixture of interiors that misses least, and its misses, which are the multipliers of a plane.
struct CentreSearch::Nearest {
  Eigen::Vector4d s = Eigen::Vector4d::Zero();
  Eigen::VectorXd at_most;  ///< no smaller than 0
  Eigen::VectorXd level;
  Eigen::Vector4d q = Eigen::Vector4d::Zero();
  double distance = 0;
  bool separates = false;
  Eigen::Vector4d below = Eigen::Vector4d::Zero();  ///< the interior below the plane
  double margin = 0;                                ///< of its misses, weighted by the multipliers

  double weighted(const Eigen::Vector4d& x, const Rows& rows) const { return q.dot(x) + level.dot(rows.level_0); }
};

CentreSearch::CentreSearch(const RayIntegrals& rays, const Moments& constant) : rays_(rays), constant_(constant) {
  const Moments solid = constant + rays.full();
  const Eigen::Vector3d centre = solid.segment<3>(MX) / solid[M1];
  length_mm_ = std::sqrt(std::max(std::abs(solid.segment<3>(MXX).sum() / solid[M1]), centre.squaredNorm()));
  unit_ << solid[M1], Eigen::Vector3d::Constant(solid[M1] * length_mm_);
  found_.push_back((constant + 0.5 * rays.full()).head<4>().cwiseQuotient(unit_));
  // Half of a scarce core may be more than there is.
  if (0.5 * rays.full()[M1] > rays.grid().most_mm3) found_.front() = constant.head<4>().cwiseQuotient(unit_);
}

/// Where q.s is least of all interiors.
Eigen::Vector4d CentreSearch::minimiser(const Eigen::Vector4d& q) {
  ++evaluations_;
  Moments linear = Moments::Zero();
  linear.head<4>() = q.cwiseQuotient(unit_);
  RayIntegrals::Priced best = rays_.priced(linear, 0);
  const double most = rays_.grid().most_mm3;
  if (best.filled_mm3 > most) {
    // The price at which as much is taken as there is.
    double low = 0;
    double high = linear.head<4>().cwiseAbs().dot(Eigen::Vector4d(1, length_mm_, length_mm_, length_mm_));
    while (rays_.priced(linear, high).filled_mm3 > most) high *= 2;
    for (int n = 0; n < 50; ++n) {
      const double price = 0.5 * (low + high);
      (rays_.priced(linear, price).filled_mm3 > most ? low : high) = price;
    }
    evaluations_ += 50;
    best = rays_.priced(linear, high);
  }
  return (constant_ + best.pass.moments).head<4>().cwiseQuotient(unit_);
}

/// Misses least of all mixtures of what was found. Only rows that have been missed are looked at.
CentreSearch::Nearest CentreSearch::nearest(const Rows& rows, std::vector<Eigen::Index>& working) const {
  const auto n = static_cast<Eigen::Index>(found_.size());
  const Eigen::Index levels = rows.level.rows();
  Eigen::MatrixXd S(4, n);
  for (Eigen::Index k = 0; k < n; ++k) S.col(k) = found_[static_cast<std::size_t>(k)];
  Nearest point;
  for (;;) {
    const auto w = static_cast<Eigen::Index>(working.size());
    // min |misses + slack|^2 + (sum of weights - 1)^2: the mixture that misses least, after its weights are divided by their sum.
    Eigen::MatrixXd A = Eigen::MatrixXd::Zero(w + levels + 1, n + w);
    for (Eigen::Index k = 0; k < w; ++k) A.row(k).head(n) = product(rows.at_most.row(working[static_cast<std::size_t>(k)]), S);
    A.topRightCorner(w, w).setIdentity();
    if (levels > 0) A.middleRows(w, levels).leftCols(n) = product(rows.level, S).colwise() + rows.level_0;
    A.row(w + levels).head(n).setOnes();
    Eigen::VectorXd b = Eigen::VectorXd::Zero(A.rows());
    b[w + levels] = 1;
    const Eigen::VectorXd weights = nonnegative_least_squares(A, b).head(n);
    point.s = S * (weights / weights.sum());
    point.at_most = (rows.at_most * point.s).cwiseMax(0);
    const std::size_t before = working.size();
    Eigen::Index worst = 0;
    for (int added = 0; added < 4 && point.at_most.size() > 0; ++added) {
      Eigen::VectorXd others = point.at_most;
      for (const Eigen::Index k : working) others[k] = 0;
      if (!(others.maxCoeff(&worst) > 0)) break;
      working.push_back(worst);
    }
    if (working.size() == before) break;
  }
  point.level = rows.level * point.s + rows.level_0;
  point.q = rows.at_most.transpose() * point.at_most + rows.level.transpose() * point.level;
  point.distance = std::hypot(point.at_most.norm(), point.level.norm());
  return point;
}

/// Until the rows are met, or a plane separates them from all interiors.
CentreSearch::Nearest CentreSearch::separated(const Rows& rows) {
  std::vector<Eigen::Index> working;
  Nearest point = nearest(rows, working);
  int idle = 0;
  for (const int last = evaluations_ + 300; point.distance > kMet && evaluations_ < last;) {
    point.below = minimiser(point.q);
    found_.push_back(point.below);
    point.margin = point.weighted(point.below, rows);
    point.separates = point.margin > 0.3 * point.distance * point.distance;
    if (point.separates) break;
    Nearest next = nearest(rows, working);
    // Rounding leaves no more.
    idle = next.distance > point.distance * (1 - 1e-9) ? idle + 1 : 0;
    if (idle > 3) {
      point.separates = point.margin > 0;
      break;
    }
    point = std::move(next);
  }
  return point;
}

/// The multipliers of `point` bound the ratio: by where the least of their weighted misses over all interiors, a concave and rising
/// function of the ratio, crosses 0. Newton's method comes to it from below; the chord to where it is positive stays above.
double CentreSearch::ratio_left_by(const Nearest& point, const Rows& rows, double ratio) {
  const Eigen::Index ratios = rows.rise.rows();
  const Eigen::VectorXd weights = point.at_most.head(ratios);
  const Eigen::Vector4d run = rows.run.transpose() * weights;
  if (!(weights.sum() > 0)) return -kInfinity;
  double above = ratio;
  double at_above = point.margin;
  Eigen::Vector4d s = point.below;
  double at = ratio;
  double value = point.margin;
  for (int n = 0; n < 4; ++n) {
    const double slope = run.dot(s);
    if (!(slope > 0)) break;
    at -= value / slope;
    s = minimiser(point.q + (at - ratio) * run);
    found_.push_back(s);
    value = point.weighted(s, rows) + (at - ratio) * run.dot(s);
    if (value >= 0) return std::min(at, above);
    const double chord = at - value * (above - at) / (at_above - value);
    if (chord - at < 1e-3 * (ratio - chord)) return chord;
    // The chord's end is above 0 only if it is looked at.
    const Eigen::Vector4d there = minimiser(point.q + (chord - ratio) * run);
    const double at_chord = point.weighted(there, rows) + (chord - ratio) * run.dot(there);
    if (at_chord <= 0) return chord;
    above = chord;
    at_above = at_chord;
  }
  return above;
}

SafestCentre CentreSearch::solve(const CentreProblem& problem) {
  const auto rows_at = [&](const std::optional<double>& ratio) { return Rows::at(problem, ratio, length_mm_, unit_[0]); };
  const auto keep = [&](const Nearest& point, SafestCentre& best) {
    best.centre_mm = length_mm_ * point.s.tail<3>() / point.s[0];
    best.ratio = problem.smallest_ratio(best.centre_mm);
  };
  // The last are those of the nearest problem; more make the mixtures slow to find.
  constexpr std::size_t kept = 40;
  if (found_.size() > kept) found_.erase(found_.begin(), found_.end() - kept);
  SafestCentre best;
  Nearest point = separated(rows_at(std::nullopt));
  keep(point, best);
  best.attainable = !(point.distance > kMet);
  best.bound = -kInfinity;
  if (!best.attainable) return best;
  double ratio = kSteepest;
  for (int step = 0; step < 60; ++step) {
    const Rows rows = rows_at(ratio);
    point = separated(rows);
    keep(point, best);
    best.bound = ratio;
    if (!(point.distance > kMet) || !point.separates) break;
    const Eigen::Index ratios = rows.rise.rows();
    const double steepest = point.at_most.head(ratios).dot(rows.at_most.topRows(ratios).rightCols(3).rowwise().norm());
    if (steepest > 0) best.slope = point.q.tail<3>() / steepest;
    const double next = ratio_left_by(point, rows, ratio);
    if (!(next < ratio - 1e-13 * (1 + std::abs(ratio)))) break;
    ratio = next;
  }
  return best;
}

}  // namespace rayrep::detail
