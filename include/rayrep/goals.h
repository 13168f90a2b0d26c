#pragma once

#include <Eigen/Core>

#include "rayrep/moments.h"

namespace rayrep {

/// What is wanted of the ten moments s (unit density) of a whole body: minimise objective(s) subject to constraints(s) = 0. Scaled
/// so that values near 1 matter: a constraint of 1e-8 is met to 1e-8 relative. Goals never see how the body is discretised.
class Goal {
public:
  virtual ~Goal() = default;

  virtual int constraints() const = 0;
  /// True when objective and constraints are affine in s: then second derivatives vanish.
  virtual bool affine() const = 0;

  virtual double objective(const Moments& s) const = 0;
  virtual Moments gradient(const Moments& s) const = 0;
  virtual Eigen::Matrix<double, 10, 10> hessian(const Moments& s) const = 0;

  virtual Eigen::VectorXd constraint_values(const Moments& s) const = 0;
  virtual Eigen::Matrix<double, Eigen::Dynamic, 10> constraint_jacobian(const Moments& s) const = 0;
  /// Hessian of mu.c(s).
  virtual Eigen::Matrix<double, 10, 10> constraint_hessian(const Moments& s, const Eigen::VectorXd& mu) const = 0;
};

/// Float upright (ray-reps paper, Eq. 3-6): the lowest centre of mass such that the body weighs what it displaces and its centre of
/// mass lies on the vertical through the centre of buoyancy:
///
///     minimise s_z / (V L)   subject to   s_1 / V = 1,  (s_x - b_x s_1) / (V L) = 0,  (s_y - b_y s_1) / (V L) = 0
///
/// with V = target volume of material = displaced mass / density. theory.md (14).
class FloatGoal final : public Goal {
public:
  /// @param material_mm3          V
  /// @param centre_of_buoyancy_mm b, xy
  /// @param length_mm             L, the size of the body; only scales
  FloatGoal(double material_mm3, const Eigen::Vector2d& centre_of_buoyancy_mm, double length_mm);

  int constraints() const override { return 3; }
  bool affine() const override { return true; }
  double objective(const Moments& s) const override;
  Moments gradient(const Moments& s) const override;
  Eigen::Matrix<double, 10, 10> hessian(const Moments& s) const override;
  Eigen::VectorXd constraint_values(const Moments& s) const override;
  Eigen::Matrix<double, Eigen::Dynamic, 10> constraint_jacobian(const Moments& s) const override;
  Eigen::Matrix<double, 10, 10> constraint_hessian(const Moments& s, const Eigen::VectorXd& mu) const override;

private:
  double volume_;
  double length_;
  Eigen::Vector2d centre_;
};

}  // namespace rayrep
