#pragma once

#include <Eigen/Core>
#include <utility>
#include <vector>

#include "rayrep/goals.h"
#include "rayrep/interior.h"

namespace rayrep {

/// A sparse nonlinear programme: minimise f(x) subject to c(x) = 0 and lower <= x <= upper. All functions are twice continuously
/// differentiable and cheap to evaluate again at the same x.
class Nlp {
public:
  using Pattern = std::vector<std::pair<int, int>>;  ///< (row, column) of each stored entry

  virtual ~Nlp() = default;

  virtual Eigen::Index variables() const = 0;
  virtual Eigen::Index constraints() const = 0;
  virtual Eigen::VectorXd lower_bounds() const = 0;
  virtual Eigen::VectorXd upper_bounds() const = 0;
  virtual Eigen::VectorXd start() const = 0;

  virtual double objective(const Eigen::VectorXd& x) const = 0;
  virtual Eigen::VectorXd gradient(const Eigen::VectorXd& x) const = 0;
  virtual Eigen::VectorXd constraint_values(const Eigen::VectorXd& x) const = 0;

  virtual Pattern jacobian_pattern() const = 0;
  virtual Eigen::VectorXd jacobian_values(const Eigen::VectorXd& x) const = 0;
  /// Lower triangle of the Hessian of f + mu.c.
  virtual Pattern hessian_pattern() const = 0;
  virtual Eigen::VectorXd hessian_values(const Eigen::VectorXd& x, double objective_factor, const Eigen::VectorXd& mu) const = 0;

  /// True when c is affine and f quadratic, so that Jacobian and Hessian are constant.
  virtual bool quadratic() const = 0;
};

/// An affine goal over an interior: f = n goal.objective, c = n goal.constraints of the body's moments constant + S(x), with n
/// the number of variables, so that the derivatives by one variable are of order 1, and x in units of `length_mm`.
/// Dense constraint rows, diagonal Hessian.
class AffineGoalNlp final : public Nlp {
public:
  /// Keeps references to `goal` and `interior`.
  /// @param constant  moments of the rest of the body, unit density
  /// @param start_at  where the solver starts between the bounds: 0 lower, 1 upper
  AffineGoalNlp(const Goal& goal, const Interior& interior, const Moments& constant, double length_mm, double start_at = 0.5);

  Eigen::Index variables() const override { return interior_.variables(); }
  Eigen::Index constraints() const override { return goal_.constraints(); }
  Eigen::VectorXd lower_bounds() const override;
  Eigen::VectorXd upper_bounds() const override;
  Eigen::VectorXd start() const override;
  double objective(const Eigen::VectorXd& x) const override;
  Eigen::VectorXd gradient(const Eigen::VectorXd& x) const override;
  Eigen::VectorXd constraint_values(const Eigen::VectorXd& x) const override;
  Pattern jacobian_pattern() const override;
  Eigen::VectorXd jacobian_values(const Eigen::VectorXd& x) const override;
  Pattern hessian_pattern() const override;
  Eigen::VectorXd hessian_values(const Eigen::VectorXd& x, double objective_factor, const Eigen::VectorXd& mu) const override;
  bool quadratic() const override { return true; }

  /// Moments of the whole body at x.
  Moments body(const Eigen::VectorXd& x) const;
  /// q = d(objective)/ds + A^T mu up to a positive factor: at an optimum material is where q.phi < 0 (DESIGN section 4).
  Moments switching(const Eigen::VectorXd& x, const Eigen::VectorXd& mu) const;

private:
  const Goal& goal_;
  const Interior& interior_;
  Moments constant_;
  double length_;
  double start_at_;
  double scale_;
};

}  // namespace rayrep
