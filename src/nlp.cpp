#include "rayrep/nlp.h"

#include <cassert>

namespace rayrep {

AffineGoalNlp::AffineGoalNlp(const Goal& goal, const Interior& interior, const Moments& constant, double length_mm, double start_at)
    : goal_(goal),
      interior_(interior),
      constant_(constant),
      length_(length_mm),
      start_at_(start_at),
      scale_(static_cast<double>(interior.variables())) {
  assert(goal.affine());
}

Eigen::VectorXd AffineGoalNlp::lower_bounds() const { return interior_.lower_bounds() / length_; }

Eigen::VectorXd AffineGoalNlp::upper_bounds() const { return interior_.upper_bounds() / length_; }

Eigen::VectorXd AffineGoalNlp::start() const { return (1 - start_at_) * lower_bounds() + start_at_ * upper_bounds(); }

Moments AffineGoalNlp::body(const Eigen::VectorXd& x) const { return constant_ + interior_.moments(length_ * x); }

double AffineGoalNlp::objective(const Eigen::VectorXd& x) const { return scale_ * goal_.objective(body(x)); }

Eigen::VectorXd AffineGoalNlp::gradient(const Eigen::VectorXd& x) const {
  return (scale_ * length_) * (interior_.jacobian(length_ * x).transpose() * goal_.gradient(constant_));
}

Eigen::VectorXd AffineGoalNlp::constraint_values(const Eigen::VectorXd& x) const {
  return scale_ * goal_.constraint_values(body(x));
}

Nlp::Pattern AffineGoalNlp::jacobian_pattern() const {
  Pattern pattern;
  for (int row = 0; row < goal_.constraints(); ++row)
    for (int n = 0; n < static_cast<int>(variables()); ++n) pattern.emplace_back(row, n);
  return pattern;
}

Eigen::VectorXd AffineGoalNlp::jacobian_values(const Eigen::VectorXd& x) const {
  const Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor> J =
      (scale_ * length_) * (goal_.constraint_jacobian(constant_) * interior_.jacobian(length_ * x));
  return Eigen::Map<const Eigen::VectorXd>(J.data(), J.size());
}

Nlp::Pattern AffineGoalNlp::hessian_pattern() const {
  Pattern pattern;
  for (int n = 0; n < static_cast<int>(variables()); ++n) pattern.emplace_back(n, n);
  return pattern;
}

Eigen::VectorXd AffineGoalNlp::hessian_values(const Eigen::VectorXd& x, double objective_factor, const Eigen::VectorXd& mu) const {
  const Moments w = objective_factor * goal_.gradient(constant_) + goal_.constraint_jacobian(constant_).transpose() * mu;
  return (scale_ * length_ * length_) * interior_.hessian_diagonal(length_ * x, w);
}

Moments AffineGoalNlp::switching(const Eigen::VectorXd&, const Eigen::VectorXd& mu) const {
  return goal_.gradient(constant_) + goal_.constraint_jacobian(constant_).transpose() * mu;
}

}  // namespace rayrep
