#pragma once

#include <Eigen/Core>
#include <functional>
#include <optional>
#include <vector>

#include "rayrep/physics/inertial.h"
#include "rayrep/physics/moments.h"

namespace rayrep {

/// A function of the ten moments with its derivatives, at one place.
struct Derivatives {
  double value = 0;
  Moments gradient = Moments::Zero();
  Matrix10 hessian = Matrix10::Zero();
};

/// What is wanted of the ten moments s (unit density) of a whole body: minimise f(s) subject to c(s) = J s + c_0 = 0. Scaled so
/// that values near 1 matter: a constraint of 1e-8 is met to 1e-8 relative. Goals never see how the body is discretised.
struct Goal {
  Eigen::Matrix<double, Eigen::Dynamic, 10> J;  ///< a row for each constraint
  Eigen::VectorXd c_0;
  Eigen::Index at_most = 0;  ///< so many of the rows, the last ones, say c(s) <= 0 instead
  bool affine = false;       ///< f is: its second derivatives vanish
  std::function<Derivatives(const Moments&)> f;
  /// The matrix [[xx.s, xy.s], [xy.s, yy.s]] shall have no positive eigenvalue: a convex cone. Scaled like the constraints.
  struct Cone {
    Moments xx, yy, xy;
  };
  std::optional<Cone> cone;  ///< only solve_quadric, of affine goals, knows it

  Eigen::Index constraints() const { return J.rows(); }
  Eigen::VectorXd constraint_values(const Moments& s) const { return J * s + c_0; }
  double objective(const Moments& s) const { return f(s).value; }
  Moments gradient(const Moments& s) const { return f(s).gradient; }
  Matrix10 hessian(const Moments& s) const { return f(s).hessian; }
};

/// The goal with a.s + a_0 <= 0 as one more of its constraints. Scaled like the others: see Goal.
Goal with_at_most(Goal goal, const Moments& a, double a_0);

/// The goal with a.s + a_0 = 0 as one more of its constraints, the last of its equations.
Goal with_equation(Goal goal, const Moments& a, double a_0);

/// The goal with cuts of its cone as inequalities a.s <= 0 in place of it.
Goal with_cuts(Goal goal, const std::vector<Moments>& cuts);

/// Minimise q.s under the constraints of `other`.
Goal linear_goal(const Moments& q, const Goal& other);

/// The goal for the moments T s: with T = moment_map(motion), for the body after a rigid motion.
Goal mapped(const Goal& goal, const Matrix10& T);

/// Float upright (ray-reps paper, Eq. 3-6): the lowest centre of mass such that the body weighs what it displaces and its centre of
/// mass lies on the vertical through the centre of buoyancy:
///
///     minimise s_z / (V L)   subject to   s_1 / V = 1,  (s_x - b_x s_1) / (V L) = 0,  (s_y - b_y s_1) / (V L) = 0
///
/// with V = target volume of material = displaced mass / density. theory.md (14).
/// @param material_mm3          V
/// @param centre_of_buoyancy_mm b, xy
/// @param length_mm             L, the size of the body; only scales
Goal float_goal(double material_mm3, const Eigen::Vector2d& centre_of_buoyancy_mm, double length_mm);

struct SpinWeights {
  double lambda = 0.1;  ///< of the height of the centre of mass, over L
  double gamma_c = 0;   ///< of its static moment squared, over (V L)^2
  double gamma_i = 1;   ///< of the inertia term
};

/// Spin stably about the z axis through the origin, the contact point of a top or the centre of a yo-yo. With m = s_1,
/// I~xx = s_yy + s_zz - s_z^2/m, I~yy = s_xx + s_zz - s_z^2/m, I~xy = -s_xy, Izz = s_xx + s_yy:
///
///     minimise   lambda c_z / L + gamma_c (s_z / (V L))^2 + gamma_i R
///     subject to s_x = s_y = 0, s_xz = s_yz = 0, and for a yo-yo s_z = 0
///
/// with R = (I~xx^2 + I~yy^2 + 2 I~xy^2) / Izz^2 when Izz shall be the largest moment, its inverse when the smallest. gamma_c = 0
/// is the ray-reps paper (Eq. 7-9); lambda = 0 is Spin-It's Eq. 3 (top), and with s_z = 0 its Eq. 5 (yo-yo). theory.md (26).
/// @param volume_mm3 V and @param length_mm L only scale
Goal spin_goal(const SpinWeights& weights, bool largest, bool yoyo, double volume_mm3, double length_mm);
/// R, the inertia term alone.
double inertia_ratio(const Moments& s);

/// Stand (ray-reps paper, Sec. 3.2, without a prescribed mass): the lowest centre of mass whose plan is a target point:
///
///     minimise s_z / (L s_1)   subject to   (s_x - t_x s_1) / (V L) = 0,  (s_y - t_y s_1) / (V L) = 0.   theory.md (27)
/// @param target_mm t, and @param volume_mm3 V and @param length_mm L, which only scale
Goal stand_goal(const Eigen::Vector2d& target_mm, double volume_mm3, double length_mm);

/// Have given numbers of a rigid body, and make others as small as they go, in a stated order. In a frame whose origin has the
/// wanted coordinates of the centre of mass, with a_x, a_y, a_z the directions of the mesh's axes, M the matrix of second moments
/// of s and density rho, all of it is linear:
///
///     minimise   f_0 + w f_1 + w^2 f_2   subject to, as far as wanted
///     s_1 rho / m = 1,   a_k.(s_x, s_y, s_z) / (V L) = 0,
///     rho (tr M - a_k.M a_k) / I_kk = 1,   (-rho a_j.M a_k - I_jk) / (rho V L^2) = 0         theory.md (34), (35)
///
/// f_0, f_1, f_2 are the first three of the order that what is given does not fix already: mass s_1 / V, static moments over V L,
/// moments of inertia about the origin over V L^2. The weights w keep the end of every ray a continuous function of the
/// multipliers: of the mass alone, or with a centre of mass in x and y, the switching function would not depend on z and whole rays
/// would switch at once.
struct TargetGoal : Goal {
  using Wish = InertialWish;
  struct Setup {
    InertialTargets wanted;
    InertialTargets at_least, at_most;  ///< bounds, of a coordinate of the centre of mass about the origin
    double density_g_cm3 = 1.24;
    /// Completed by: mass, height, the sum of the moments of inertia, and then each of the ten.
    std::vector<Wish> order;
    /// Of the moment of inertia about `up` over the larger lateral principal one, both about the origin: a cone, theory.md (76).
    std::optional<double> least_spin_ratio;
    double weight = 1e-2;                                ///< w
    Eigen::Vector3d up = Eigen::Vector3d::UnitZ();       ///< the direction of "height", a unit vector
    Eigen::Matrix3d axes = Eigen::Matrix3d::Identity();  ///< columns a_x, a_y, a_z: unit, orthogonal, right-handed
    double volume_mm3 = 1;                               ///< V and
    double length_mm = 1;                                ///< L, which only scale
  };

  /// Inertia is that about the centre of mass only if the coordinates of the centre that it depends on are given: y and z for Ixx,
  /// x or y for Ixy, and so on (not checked).
  /// Nothing to minimise is left when all ten are given: the objective is then constant, see `determined`.
  explicit TargetGoal(const Setup& setup);

  /// Everything in the order is fixed by what is given.
  bool determined() const { return chosen.empty(); }
  /// What of the order is minimised first; none: the height, or where that is given the sum of the moments of inertia.
  const std::optional<Wish>& first() const { return chosen.front().wish; }
  /// f_0 as a function of s, alone.
  const Moments& first_gradient() const { return chosen.front().gradient; }

  struct Chosen {
    std::optional<Wish> wish;
    Moments gradient;
  };
  std::vector<Chosen> chosen;  ///< f_0, f_1, f_2
};

}  // namespace rayrep
