#include "rayrep/solve/nlp.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>

namespace rayrep {
namespace {

// Interior variables per link of the chain; even, so that pairs stay together. Measured: with 32 fill fractions take three
// quarters of the time that they take with 64, and pairs a tenth more.
constexpr Eigen::Index kChunk = 32;
constexpr Eigen::Index kChunkOfPairs = 64;

/// True where moment k of a ray is linear in its ends.
bool linear_moment(int k) { return k == M1 || k == MX || k == MY || k == MXX || k == MYY || k == MXY; }

}  // namespace

InteriorNlp::InteriorNlp(const Goal& goal, const Interior& interior, const Moments& constant, const Scale& scale, double fill)
    : goal_(goal),
      interior_(interior),
      constant_(constant),
      variable_unit_(interior.variable_unit(scale.length_mm)),
      fill_(fill),
      n_(static_cast<double>(interior.variables())),
      pair_lengths_(interior.pair_lengths() / variable_unit_),
      chunk_(pair_lengths_.size() == 0 ? kChunk : kChunkOfPairs),
      couplings_(interior.couplings()) {
  assert(!goal.cone);
  unit_ = moment_units(scale.volume_mm3, scale.length_mm) / n_;
  // A moment takes part when a constraint or a curved objective depends on it. Dependence does not change with s.
  const Moments s = constant_ + interior_.moments(interior_.start(fill));
  Moments used = goal_.J.cwiseAbs().colwise().sum().transpose();
  if (!goal_.affine) used += goal_.hessian(s).cwiseAbs().rowwise().sum() + goal_.gradient(s).cwiseAbs();
  for (int k = 0; k < 10; ++k)
    if (used[k] > 0) chained_.push_back(k);
  chained_are_linear_ = std::all_of(chained_.begin(), chained_.end(), linear_moment);
}

Eigen::Index InteriorNlp::chunks() const { return (interior_.variables() + chunk_ - 1) / chunk_; }

Eigen::Index InteriorNlp::variables() const { return interior_.variables() + chunks() * chained(); }

Eigen::Index InteriorNlp::constraints() const { return chunks() * chained() + goal_.constraints() + 2 * pair_lengths_.size(); }

Eigen::VectorXd InteriorNlp::lower_bounds() const {
  Eigen::VectorXd lo = Eigen::VectorXd::Constant(variables(), -std::numeric_limits<double>::infinity());
  lo.head(interior_.variables()) = interior_.lower_bounds() / variable_unit_;
  return lo;
}

Eigen::VectorXd InteriorNlp::upper_bounds() const {
  Eigen::VectorXd hi = Eigen::VectorXd::Constant(variables(), std::numeric_limits<double>::infinity());
  hi.head(interior_.variables()) = interior_.upper_bounds() / variable_unit_;
  return hi;
}

Eigen::VectorXd InteriorNlp::constraint_upper_bounds() const {
  Eigen::VectorXd upper = Eigen::VectorXd::Zero(constraints());
  // Inequalities of the goal are turned round: constraints lie between 0 and an upper bound.
  upper.tail(goal_.at_most + 2 * pair_lengths_.size()).setConstant(std::numeric_limits<double>::infinity());
  return upper;
}

Eigen::VectorXd InteriorNlp::interior_variables(const Eigen::VectorXd& x) const {
  return variable_unit_ * x.head(interior_.variables());
}

Moments InteriorNlp::body(const Eigen::VectorXd& x) const { return constant_ + interior_.moments(interior_variables(x)); }

/// The goal's argument: the end of the chain where moments are chained, else from the interior.
Moments InteriorNlp::last_sum(const Eigen::VectorXd& x) const {
  Moments s = goal_.affine ? body(x) : constant_;
  for (Eigen::Index k = 0; k < chained(); ++k) {
    const int moment = chained_[static_cast<std::size_t>(k)];
    s[moment] = unit_[moment] * x[x.size() - chained() + k];
  }
  return s;
}

Eigen::VectorXd InteriorNlp::start() const {
  const Eigen::VectorXd z = interior_.start(fill_);
  Eigen::VectorXd x = Eigen::VectorXd::Zero(variables());
  x.head(z.size()) = z / variable_unit_;
  // Sums that satisfy the chain at z.
  const Eigen::VectorXd residual = constraint_values(x);
  for (Eigen::Index c = 0; c < chunks(); ++c)
    for (Eigen::Index k = 0; k < chained(); ++k) {
      const Eigen::Index at = c * chained() + k;
      x[z.size() + at] = (c > 0 ? x[z.size() + at - chained()] : 0) - residual[at];
    }
  return x;
}

double InteriorNlp::objective(const Eigen::VectorXd& x) const {
  double pulls = 0;
  for (const auto& [i, j, weight] : couplings_) pulls += 0.5 * weight * std::pow(variable_unit_ * (x[i] - x[j]), 2);
  return n_ * (goal_.objective(last_sum(x)) + pulls);
}

Eigen::VectorXd InteriorNlp::gradient(const Eigen::VectorXd& x) const {
  Eigen::VectorXd g = Eigen::VectorXd::Zero(variables());
  const Moments by_s = n_ * goal_.gradient(last_sum(x));
  if (goal_.affine) {
    Moments direct = by_s;
    for (const int moment : chained_) direct[moment] = 0;
    g.head(interior_.variables()) = variable_unit_ * (interior_.jacobian(interior_variables(x)).transpose() * direct);
  }
  for (Eigen::Index k = 0; k < chained(); ++k) {
    const int moment = chained_[static_cast<std::size_t>(k)];
    g[g.size() - chained() + k] = by_s[moment] * unit_[moment];
  }
  for (const auto& [i, j, weight] : couplings_) {
    const double pull = n_ * weight * variable_unit_ * variable_unit_ * (x[i] - x[j]);
    g[i] += pull;
    g[j] -= pull;
  }
  return g;
}

Eigen::VectorXd InteriorNlp::constraint_values(const Eigen::VectorXd& x) const {
  const Eigen::VectorXd z = interior_variables(x);
  const Eigen::Matrix<double, 10, Eigen::Dynamic> parts = interior_.contributions(z);
  Eigen::VectorXd c(constraints());
  for (Eigen::Index chunk = 0; chunk < chunks(); ++chunk) {
    const Eigen::Index first = chunk * chunk_;
    const Eigen::Index count = std::min(chunk_, z.size() - first);
    const Moments sum = parts.middleCols(first, count).rowwise().sum();
    for (Eigen::Index k = 0; k < chained(); ++k) {
      const int moment = chained_[static_cast<std::size_t>(k)];
      const Eigen::Index at = chunk * chained() + k;
      const double before = chunk > 0 ? x[z.size() + at - chained()] : constant_[moment] / unit_[moment];
      c[at] = x[z.size() + at] - before - sum[moment] / unit_[moment];
    }
  }
  c.segment(chunks() * chained(), goal_.constraints()) = n_ * goal_.constraint_values(last_sum(x));
  c.segment(chunks() * chained() + goal_.constraints() - goal_.at_most, goal_.at_most) *= -1;
  Eigen::Index row = chunks() * chained() + goal_.constraints();
  for (Eigen::Index k = 0; k < pair_lengths_.size(); ++k) {
    const double square = std::pow(x[2 * k] + x[2 * k + 1], 2) / pair_lengths_[k];
    c[row++] = 2 * x[2 * k] - square;
    c[row++] = 2 * x[2 * k + 1] - square;
  }
  return c;
}

Nlp::Pattern InteriorNlp::jacobian_pattern() const {
  Pattern pattern;
  const auto n = static_cast<int>(interior_.variables());
  const auto m = static_cast<int>(chained());
  for (int chunk = 0; chunk < static_cast<int>(chunks()); ++chunk)
    for (int k = 0; k < m; ++k) {
      const int row = chunk * m + k;
      pattern.emplace_back(row, n + row);
      if (chunk > 0) pattern.emplace_back(row, n + row - m);
      for (int v = chunk * static_cast<int>(chunk_); v < std::min(n, (chunk + 1) * static_cast<int>(chunk_)); ++v)
        pattern.emplace_back(row, v);
    }
  const int goal_row = static_cast<int>(chunks()) * m;
  const auto goal_rows = static_cast<int>(goal_.constraints());
  for (int row = 0; row < goal_rows; ++row)
    for (int k = 0; k < m; ++k) pattern.emplace_back(goal_row + row, n + goal_row - m + k);
  int row = goal_row + goal_rows;
  for (int v = 0; v < 2 * static_cast<int>(pair_lengths_.size()); ++v, ++row) {
    pattern.emplace_back(row, v - v % 2);
    pattern.emplace_back(row, v - v % 2 + 1);
  }
  return pattern;
}

Eigen::VectorXd InteriorNlp::jacobian_values(const Eigen::VectorXd& x) const {
  const Eigen::VectorXd z = interior_variables(x);
  const Eigen::Matrix<double, 10, Eigen::Dynamic> J = interior_.jacobian(z);
  std::vector<double> values;
  for (Eigen::Index chunk = 0; chunk < chunks(); ++chunk)
    for (const int moment : chained_) {
      values.push_back(1);
      if (chunk > 0) values.push_back(-1);
      for (Eigen::Index v = chunk * chunk_; v < std::min(z.size(), (chunk + 1) * chunk_); ++v)
        values.push_back(-variable_unit_ * J(moment, v) / unit_[moment]);
    }
  const auto& C = goal_.J;
  for (Eigen::Index row = 0; row < C.rows(); ++row)
    for (const int moment : chained_)
      values.push_back((row < C.rows() - goal_.at_most ? n_ : -n_) * C(row, moment) * unit_[moment]);
  for (Eigen::Index k = 0; k < pair_lengths_.size(); ++k) {
    const double slope = -2 * (x[2 * k] + x[2 * k + 1]) / pair_lengths_[k];
    values.insert(values.end(), {2 + slope, slope, slope, 2 + slope});
  }
  return Eigen::Map<const Eigen::VectorXd>(values.data(), static_cast<Eigen::Index>(values.size()));
}

Nlp::Pattern InteriorNlp::hessian_pattern() const {
  Pattern pattern;
  for (int v = 0; v < static_cast<int>(interior_.variables()); ++v) pattern.emplace_back(v, v);
  if (!goal_.affine) {
    const auto first = static_cast<int>(variables() - chained());
    for (int k = 0; k < static_cast<int>(chained()); ++k)
      for (int l = 0; l <= k; ++l) pattern.emplace_back(first + k, first + l);
  }
  for (const auto& [i, j, weight] : couplings_) pattern.emplace_back(std::max(i, j), std::min(i, j));
  for (int v = 0; v < 2 * static_cast<int>(pair_lengths_.size()); v += 2) pattern.emplace_back(v + 1, v);
  return pattern;
}

Eigen::VectorXd InteriorNlp::hessian_values(const Eigen::VectorXd& x, double objective_factor, const Eigen::VectorXd& mu) const {
  const Eigen::VectorXd z = interior_variables(x);
  const Moments s = last_sum(x);
  std::vector<double> values;
  std::vector<double> of_pairs;
  Moments direct = Moments::Zero();
  if (goal_.affine) {
    direct = objective_factor * n_ * goal_.gradient(s);
    for (const int moment : chained_) direct[moment] = 0;
  }
  for (Eigen::Index chunk = 0; chunk < chunks(); ++chunk) {
    Moments w = direct;
    for (Eigen::Index k = 0; k < chained(); ++k) {
      const int moment = chained_[static_cast<std::size_t>(k)];
      w[moment] -= mu[chunk * chained() + k] / unit_[moment];
    }
    const Eigen::Index first = chunk * chunk_;
    const Eigen::Index count = std::min(chunk_, z.size() - first);
    const double unit = variable_unit_ * variable_unit_;
    const Eigen::VectorXd diagonal = unit * interior_.hessian_diagonal(z, w, first, count);
    for (const double h : diagonal) values.push_back(std::max(h, 0.0));
    const Eigen::VectorXd mixed = unit * interior_.hessian_of_pairs(z, w, first, count);
    for (Eigen::Index n = 0; n < mixed.size(); ++n) of_pairs.push_back(diagonal[2 * n] > 0 ? mixed[n] : 0);
  }
  const Eigen::Index first_of_pairs = chunks() * chained() + goal_.constraints();
  for (Eigen::Index k = 0; k < pair_lengths_.size(); ++k) {
    const double h = -2 * (mu[first_of_pairs + 2 * k] + mu[first_of_pairs + 2 * k + 1]) / pair_lengths_[k];
    values[static_cast<std::size_t>(2 * k)] += h;
    values[static_cast<std::size_t>(2 * k + 1)] += h;
    of_pairs[static_cast<std::size_t>(k)] += h;
  }
  const double pull = objective_factor * n_ * variable_unit_ * variable_unit_;
  for (const auto& [i, j, weight] : couplings_) {
    values[static_cast<std::size_t>(i)] += pull * weight;
    values[static_cast<std::size_t>(j)] += pull * weight;
  }
  if (!goal_.affine) {
    const Matrix10 H = n_ * (objective_factor * goal_.hessian(s));
    for (std::size_t k = 0; k < chained_.size(); ++k)
      for (std::size_t l = 0; l <= k; ++l) values.push_back(H(chained_[k], chained_[l]) * unit_[chained_[k]] * unit_[chained_[l]]);
  }
  for (const auto& [i, j, weight] : couplings_) values.push_back(-pull * weight);
  values.insert(values.end(), of_pairs.begin(), of_pairs.end());
  return Eigen::Map<const Eigen::VectorXd>(values.data(), static_cast<Eigen::Index>(values.size()));
}

Moments InteriorNlp::switching(const Eigen::VectorXd& mu) const {
  // Along the chain all multipliers of a moment agree; take the last, next to the goal.
  Moments q = Moments::Zero();
  if (goal_.affine) q = n_ * goal_.gradient(constant_);
  for (Eigen::Index k = 0; k < chained(); ++k) {
    const int moment = chained_[static_cast<std::size_t>(k)];
    q[moment] = -mu[(chunks() - 1) * chained() + k] / unit_[moment];
  }
  return q;
}

}  // namespace rayrep
