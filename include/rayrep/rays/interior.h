#pragma once

#include <Eigen/Core>
#include <vector>

#include "rayrep/physics/moments.h"

namespace rayrep {

/// A pull between two variables of an interior: weight (x_i - x_j)^2 / 2.
struct Coupling {
  int i = 0;
  int j = 0;  ///< not i
  double weight = 0;
};

/// The seam between discretisations and goals. An interior maps its design variables x, each between two bounds,
/// to the ten moments of the material it describes, with unit density. Each variable enters on its own:
///
///     S(x) = constant + sum over i of s_i(x_i),
///
/// so the Jacobian is a dense 10 x n matrix and the Hessian of any w.S is diagonal. Or all variables come in pairs (x_2k, x_2k+1),
/// each pair enters on its own, and the Hessian consists of blocks of 2 x 2, each positive or negative semidefinite. Goals never
/// see an interior.
class Interior {
public:
  virtual ~Interior() = default;

  virtual Eigen::Index variables() const = 0;
  virtual Eigen::VectorXd lower_bounds() const = 0;
  virtual Eigen::VectorXd upper_bounds() const = 0;

  /// Empty unless variables come in pairs. Then each pair has a length L_k > 0, in the unit of the variables, and must keep
  ///
  ///     2 L_k x_2k >= (x_2k + x_2k+1)^2,   2 L_k x_2k+1 >= (x_2k + x_2k+1)^2.
  virtual Eigen::VectorXd pair_lengths() const { return {}; }
  /// Where a solver may start: 0 all void, 1 all solid, in between partly filled; within the bounds and what pairs must keep.
  virtual Eigen::VectorXd start(double fill) const = 0;

  /// s_i(x_i), one column per variable, 10 x n; mm^3, mm^4, mm^5. That of a pair is in its first column, its second one is 0.
  virtual Eigen::Matrix<double, 10, Eigen::Dynamic> contributions(const Eigen::VectorXd& x) const = 0;
  /// S(x) - constant, the sum of the contributions.
  Moments moments(const Eigen::VectorXd& x) const { return contributions(x).rowwise().sum(); }
  /// dS/dx, 10 x n.
  virtual Eigen::Matrix<double, 10, Eigen::Dynamic> jacobian(const Eigen::VectorXd& x) const = 0;
  /// Diagonal of the Hessian of w.S(x) for the variables first ... first + count - 1.
  virtual Eigen::VectorXd hessian_diagonal(const Eigen::VectorXd& x, const Moments& w, Eigen::Index first,
                                           Eigen::Index count) const = 0;
  /// d2(w.S)/(dx_v dx_v+1) for the pairs v = first, first + 2 ... < first + count, both even. Empty without pairs.
  virtual Eigen::VectorXd hessian_of_pairs(const Eigen::VectorXd& /*x*/, const Moments& /*w*/, Eigen::Index /*first*/,
                                           Eigen::Index /*count*/) const {
    return {};
  }

  /// What a solver that counts lengths in units of `length_mm` should count a variable in: `length_mm` unless overridden, since
  /// most variables are lengths. Only scales.
  virtual double variable_unit(double length_mm) const { return length_mm; }
  /// A regulariser: the sum of these is added to the goal's objective while solving. Empty unless overridden. One entry per pair.
  virtual std::vector<Coupling> couplings() const { return {}; }
};

}  // namespace rayrep
