#pragma once

#include <Eigen/Core>

#include "rayrep/moments.h"

namespace rayrep {

/// The seam between discretisations and goals (DESIGN section 1). An interior maps its design variables x, each between two bounds,
/// to the ten moments of the material it describes, with unit density. Each variable enters on its own:
///
///     S(x) = constant + sum over i of s_i(x_i),
///
/// so the Jacobian is a dense 10 x n matrix and the Hessian of any w.S is diagonal. Goals never see an interior.
class Interior {
public:
  virtual ~Interior() = default;

  virtual Eigen::Index variables() const = 0;
  virtual Eigen::VectorXd lower_bounds() const = 0;
  virtual Eigen::VectorXd upper_bounds() const = 0;

  /// S(x), mm^3, mm^4, mm^5.
  virtual Moments moments(const Eigen::VectorXd& x) const = 0;
  /// dS/dx, 10 x n.
  virtual Eigen::Matrix<double, 10, Eigen::Dynamic> jacobian(const Eigen::VectorXd& x) const = 0;
  /// Diagonal of the Hessian of w.S(x).
  virtual Eigen::VectorXd hessian_diagonal(const Eigen::VectorXd& x, const Moments& w) const = 0;
};

}  // namespace rayrep
