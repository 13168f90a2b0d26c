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
  /// Hessian of mu.c(s); zero, as for linear constraints, unless overridden.
  virtual Eigen::Matrix<double, 10, 10> constraint_hessian(const Moments& s, const Eigen::VectorXd& mu) const;
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

private:
  double volume_;
  double length_;
  Eigen::Vector2d centre_;
};

/// Spin stably about the z axis through the origin, the contact point of a top or the centre of a yo-yo. With m = s_1,
/// I~xx = s_yy + s_zz - s_z^2/m, I~yy = s_xx + s_zz - s_z^2/m, I~xy = -s_xy, Izz = s_xx + s_yy:
///
///     minimise   lambda c_z / L + gamma_c (s_z / (V L))^2 + gamma_i R
///     subject to s_x = s_y = 0, s_xz = s_yz = 0, and for a yo-yo s_z = 0
///
/// with R = (I~xx^2 + I~yy^2 + 2 I~xy^2) / Izz^2 when Izz shall be the largest moment, its inverse when the smallest. gamma_c = 0
/// is the ray-reps paper (Eq. 7-9); lambda = 0 is Spin-It's Eq. 3 (top), and with s_z = 0 its Eq. 5 (yo-yo). theory.md (26).
class SpinGoal final : public Goal {
public:
  struct Weights {
    double lambda = 0.1;  ///< of the height of the centre of mass, over L
    double gamma_c = 0;   ///< of its static moment squared, over (V L)^2
    double gamma_i = 1;   ///< of the inertia term
  };
  /// @param volume_mm3 V and @param length_mm L only scale
  SpinGoal(const Weights& weights, bool largest, bool yoyo, double volume_mm3, double length_mm);

  int constraints() const override { return yoyo_ ? 5 : 4; }
  bool affine() const override { return false; }
  double objective(const Moments& s) const override;
  Moments gradient(const Moments& s) const override;
  Eigen::Matrix<double, 10, 10> hessian(const Moments& s) const override;
  Eigen::VectorXd constraint_values(const Moments& s) const override;
  Eigen::Matrix<double, Eigen::Dynamic, 10> constraint_jacobian(const Moments& s) const override;

  /// R, the inertia term alone.
  double inertia_ratio(const Moments& s) const;

private:
  Weights weights_;
  bool largest_;
  bool yoyo_;
  double volume_;
  double length_;
};

/// Stand (ray-reps paper, Sec. 3.2, without a prescribed mass): the lowest centre of mass whose plan is a target point:
///
///     minimise s_z / (L s_1)   subject to   (s_x - t_x s_1) / (V L) = 0,  (s_y - t_y s_1) / (V L) = 0.   theory.md (27)
class StandGoal final : public Goal {
public:
  /// @param target_mm t, and @param volume_mm3 V and @param length_mm L, which only scale
  StandGoal(const Eigen::Vector2d& target_mm, double volume_mm3, double length_mm);

  int constraints() const override { return 2; }
  bool affine() const override { return false; }
  double objective(const Moments& s) const override;
  Moments gradient(const Moments& s) const override;
  Eigen::Matrix<double, 10, 10> hessian(const Moments& s) const override;
  Eigen::VectorXd constraint_values(const Moments& s) const override;
  Eigen::Matrix<double, Eigen::Dynamic, 10> constraint_jacobian(const Moments& s) const override;

private:
  Eigen::Vector2d target_;
  double volume_;
  double length_;
};

}  // namespace rayrep
