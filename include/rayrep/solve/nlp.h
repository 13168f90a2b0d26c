#pragma once

#include <Eigen/Core>
#include <utility>
#include <vector>

#include "rayrep/rays/interior.h"
#include "rayrep/solve/goals.h"

namespace rayrep {

/// A sparse nonlinear programme: minimise f(x) subject to 0 <= c_i(x) <= constraint_upper_bounds()_i and lower <= x <= upper. All
/// functions are twice continuously differentiable and cheap to evaluate again at the same x.
class Nlp {
public:
  using Pattern = std::vector<std::pair<int, int>>;  ///< (row, column) of each stored entry

  virtual ~Nlp() = default;

  virtual Eigen::Index variables() const = 0;
  virtual Eigen::Index constraints() const = 0;
  virtual Eigen::VectorXd lower_bounds() const = 0;
  virtual Eigen::VectorXd upper_bounds() const = 0;
  virtual Eigen::VectorXd constraint_upper_bounds() const = 0;  ///< 0 for an equation, infinity for an inequality
  virtual Eigen::VectorXd start() const = 0;

  virtual double objective(const Eigen::VectorXd& x) const = 0;
  virtual Eigen::VectorXd gradient(const Eigen::VectorXd& x) const = 0;
  virtual Eigen::VectorXd constraint_values(const Eigen::VectorXd& x) const = 0;

  virtual Pattern jacobian_pattern() const = 0;
  virtual Eigen::VectorXd jacobian_values(const Eigen::VectorXd& x) const = 0;
  /// Lower triangle of the Hessian of f + mu.c, or of an approximation that is exact near a solution.
  virtual Pattern hessian_pattern() const = 0;
  virtual Eigen::VectorXd hessian_values(const Eigen::VectorXd& x, double objective_factor, const Eigen::VectorXd& mu) const = 0;

  /// True when c is affine and f quadratic, so that Jacobian and Hessian are constant.
  virtual bool quadratic() const = 0;
  /// True when f and c are defined strictly within the bounds of x only, so that a solver must not relax them.
  virtual bool strictly_within_bounds() const { return false; }
};

/// A goal over an interior, sparse although every variable enters every moment. The moments s that the goal needs become variables
/// themselves, and their sums over the interior's variables are taken along a chain of chunks:
///
///     sum_c = sum_{c-1} + contribution of chunk c,   sum_0 = constant,   s = sum_last,
///
/// so that no row is dense and factorising costs time proportional to the number of variables. theory.md (25).
/// Variables: the interior's in units of `Interior::variable_unit`; then, chunk by chunk, the sums of the moments that take part,
/// over V L^degree / n (V the volume scale, n the number of interior variables), which makes derivatives of order 1. f is n times
/// the sum of the goal's objective and the interior's couplings, and the constraints are n times the goal's. An affine goal keeps
/// its objective on the interior's variables: with affine constraints the programme is then a convex or concave quadratic one.
/// Constraints: the chain, chunk by chunk; the goal's; 2 x_v - (x_2k + x_2k+1)^2 / L_k >= 0 for both variables v of each pair of
/// the interior, L_k its length in their unit.
/// Hessian: where w.S is concave in a variable, or in a pair, its second derivatives count as 0. All but as many of those variables
/// as there are constraints end at a bound, where it makes no difference; on the way there Ipopt would stiffen every variable on
/// their account (measured: 20 to 30 iterations instead of 50 to more than 1000 with SegmentBounds::paper).
class InteriorNlp final : public Nlp {
public:
  struct Scale {
    double volume_mm3 = 1;
    double length_mm = 1;
  };

  /// Keeps references to `goal` and `interior`.
  /// @param constant  moments of the rest of the body, unit density
  /// @param fill      where to start, see Interior::start
  InteriorNlp(const Goal& goal, const Interior& interior, const Moments& constant, const Scale& scale, double fill = 0.5);

  Eigen::Index variables() const override;
  Eigen::Index constraints() const override;
  Eigen::VectorXd lower_bounds() const override;
  Eigen::VectorXd upper_bounds() const override;
  Eigen::VectorXd constraint_upper_bounds() const override;
  Eigen::VectorXd start() const override;
  double objective(const Eigen::VectorXd& x) const override;
  Eigen::VectorXd gradient(const Eigen::VectorXd& x) const override;
  Eigen::VectorXd constraint_values(const Eigen::VectorXd& x) const override;
  Pattern jacobian_pattern() const override;
  Eigen::VectorXd jacobian_values(const Eigen::VectorXd& x) const override;
  Pattern hessian_pattern() const override;
  Eigen::VectorXd hessian_values(const Eigen::VectorXd& x, double objective_factor, const Eigen::VectorXd& mu) const override;
  bool quadratic() const override { return goal_.affine && chained_are_linear_ && pair_lengths_.size() == 0; }
  bool strictly_within_bounds() const override { return pair_lengths_.size() > 0; }

  /// The interior's own variables.
  Eigen::VectorXd interior_variables(const Eigen::VectorXd& x) const;
  /// Moments of the whole body from the interior's variables (not from the sums).
  Moments body(const Eigen::VectorXd& x) const;
  /// The switching function at a solution: material is where q.phi < 0 (theory.md (15)), up to a positive factor.
  Moments switching(const Eigen::VectorXd& mu) const;

private:
  Eigen::Index chunks() const;
  Eigen::Index chained() const { return static_cast<Eigen::Index>(chained_.size()); }
  Moments last_sum(const Eigen::VectorXd& x) const;

  const Goal& goal_;
  const Interior& interior_;
  Moments constant_;
  double variable_unit_;
  double fill_;
  double n_;                  ///< number of interior variables
  Moments unit_;              ///< of each sum
  std::vector<int> chained_;  ///< which moments take part
  bool chained_are_linear_;
  Eigen::VectorXd pair_lengths_;  ///< in the unit of the variables
  Eigen::Index chunk_;            ///< interior variables per link of the chain
  std::vector<Coupling> couplings_;
};

}  // namespace rayrep
