#include "rayrep/goals.h"

#include <cassert>

namespace rayrep {

Eigen::Matrix<double, 10, 10> Goal::constraint_hessian(const Moments&, const Eigen::VectorXd&) const {
  return Eigen::Matrix<double, 10, 10>::Zero();
}

FloatGoal::FloatGoal(double material_mm3, const Eigen::Vector2d& centre_of_buoyancy_mm, double length_mm)
    : volume_(material_mm3), length_(length_mm), centre_(centre_of_buoyancy_mm) {
  assert(material_mm3 > 0 && length_mm > 0);
}

double FloatGoal::objective(const Moments& s) const { return s[MZ] / (volume_ * length_); }

Moments FloatGoal::gradient(const Moments&) const {
  Moments g = Moments::Zero();
  g[MZ] = 1 / (volume_ * length_);
  return g;
}

Eigen::Matrix<double, 10, 10> FloatGoal::hessian(const Moments&) const { return Eigen::Matrix<double, 10, 10>::Zero(); }

Eigen::VectorXd FloatGoal::constraint_values(const Moments& s) const {
  Eigen::Vector3d c = constraint_jacobian(s) * s;
  c[0] -= 1;
  return c;
}

Eigen::Matrix<double, Eigen::Dynamic, 10> FloatGoal::constraint_jacobian(const Moments&) const {
  Eigen::Matrix<double, Eigen::Dynamic, 10> J = Eigen::Matrix<double, Eigen::Dynamic, 10>::Zero(3, 10);
  J(0, M1) = 1 / volume_;
  for (int k = 0; k < 2; ++k) {
    J(1 + k, MX + k) = 1 / (volume_ * length_);
    J(1 + k, M1) = -centre_[k] / (volume_ * length_);
  }
  return J;
}

namespace {

using Matrix10 = Eigen::Matrix<double, 10, 10>;

/// A scalar function of the moments with its derivatives.
struct Term {
  double value = 0;
  Moments gradient = Moments::Zero();
  Matrix10 hessian = Matrix10::Zero();
};

/// s_z^2 / m.
Term steiner(const Moments& s) {
  const double m = s[M1];
  const double z = s[MZ];
  Term t;
  t.value = z * z / m;
  t.gradient[M1] = -z * z / (m * m);
  t.gradient[MZ] = 2 * z / m;
  t.hessian(M1, M1) = 2 * z * z / (m * m * m);
  t.hessian(M1, MZ) = t.hessian(MZ, M1) = -2 * z / (m * m);
  t.hessian(MZ, MZ) = 2 / m;
  return t;
}

/// R = (I~xx^2 + I~yy^2 + 2 I~xy^2) / Izz^2.
Term inertia_term(const Moments& s) {
  const Term w = steiner(s);
  // u = (I~xx, I~yy, s_xy, Izz); only the first two are curved.
  const Eigen::Vector4d u(s[MYY] + s[MZZ] - w.value, s[MXX] + s[MZZ] - w.value, s[MXY], s[MXX] + s[MYY]);
  Eigen::Matrix<double, 4, 10> du = Eigen::Matrix<double, 4, 10>::Zero();
  du(0, MYY) = du(0, MZZ) = du(1, MXX) = du(1, MZZ) = du(2, MXY) = du(3, MXX) = du(3, MYY) = 1;
  du.row(0) -= w.gradient.transpose();
  du.row(1) -= w.gradient.transpose();

  const double d2 = u[3] * u[3];
  const double numerator = u[0] * u[0] + u[1] * u[1] + 2 * u[2] * u[2];
  const Eigen::Vector4d dn(2 * u[0], 2 * u[1], 4 * u[2], 0);
  const Eigen::Vector4d d(0, 0, 0, 1);
  Eigen::Vector4d dR = dn / d2 - (2 * numerator / (d2 * u[3])) * d;
  Eigen::Matrix4d ddR = Eigen::Vector4d(2, 2, 4, 0).asDiagonal();
  ddR =
      ddR / d2 - (2 / (d2 * u[3])) * (dn * d.transpose() + d * dn.transpose()) + (6 * numerator / (d2 * d2)) * (d * d.transpose());

  Term t;
  t.value = numerator / d2;
  t.gradient = du.transpose() * dR;
  t.hessian = du.transpose() * ddR * du - (dR[0] + dR[1]) * w.hessian;
  return t;
}

Term inverse(const Term& a) {
  const double v = a.value;
  return {1 / v, -a.gradient / (v * v), -a.hessian / (v * v) + (2 / (v * v * v)) * (a.gradient * a.gradient.transpose())};
}

/// lambda c_z / L + gamma_c (s_z / (V L))^2 + gamma_i (R or 1 / R).
Term spin_objective(const Moments& s, const SpinGoal::Weights& weights, bool largest, double volume, double length) {
  const Term R = largest ? inertia_term(s) : inverse(inertia_term(s));
  const double m = s[M1];
  const double z = s[MZ];
  Term t{weights.gamma_i * R.value, weights.gamma_i * R.gradient, weights.gamma_i * R.hessian};
  const double l = weights.lambda / length;
  t.value += l * z / m;
  t.gradient[M1] -= l * z / (m * m);
  t.gradient[MZ] += l / m;
  t.hessian(M1, M1) += 2 * l * z / (m * m * m);
  t.hessian(M1, MZ) -= l / (m * m);
  t.hessian(MZ, M1) -= l / (m * m);
  const double g = weights.gamma_c / (volume * volume * length * length);
  t.value += g * z * z;
  t.gradient[MZ] += 2 * g * z;
  t.hessian(MZ, MZ) += 2 * g;
  return t;
}

}  // namespace

SpinGoal::SpinGoal(const Weights& weights, bool largest, bool yoyo, double volume_mm3, double length_mm)
    : weights_(weights), largest_(largest), yoyo_(yoyo), volume_(volume_mm3), length_(length_mm) {
  assert(volume_mm3 > 0 && length_mm > 0);
}

double SpinGoal::objective(const Moments& s) const { return spin_objective(s, weights_, largest_, volume_, length_).value; }

Moments SpinGoal::gradient(const Moments& s) const { return spin_objective(s, weights_, largest_, volume_, length_).gradient; }

Matrix10 SpinGoal::hessian(const Moments& s) const { return spin_objective(s, weights_, largest_, volume_, length_).hessian; }

Eigen::VectorXd SpinGoal::constraint_values(const Moments& s) const { return constraint_jacobian(s) * s; }

Eigen::Matrix<double, Eigen::Dynamic, 10> SpinGoal::constraint_jacobian(const Moments&) const {
  Eigen::Matrix<double, Eigen::Dynamic, 10> J = Eigen::Matrix<double, Eigen::Dynamic, 10>::Zero(constraints(), 10);
  J(0, MX) = J(1, MY) = 1 / (volume_ * length_);
  J(2, MXZ) = J(3, MYZ) = 1 / (volume_ * length_ * length_);
  if (yoyo_) J(4, MZ) = 1 / (volume_ * length_);
  return J;
}

double SpinGoal::inertia_ratio(const Moments& s) const { return inertia_term(s).value; }

StandGoal::StandGoal(const Eigen::Vector2d& target_mm, double volume_mm3, double length_mm)
    : target_(target_mm), volume_(volume_mm3), length_(length_mm) {
  assert(volume_mm3 > 0 && length_mm > 0);
}

double StandGoal::objective(const Moments& s) const { return s[MZ] / (length_ * s[M1]); }

Moments StandGoal::gradient(const Moments& s) const {
  Moments g = Moments::Zero();
  g[M1] = -s[MZ] / (length_ * s[M1] * s[M1]);
  g[MZ] = 1 / (length_ * s[M1]);
  return g;
}

Matrix10 StandGoal::hessian(const Moments& s) const {
  Matrix10 H = Matrix10::Zero();
  H(M1, M1) = 2 * s[MZ] / (length_ * s[M1] * s[M1] * s[M1]);
  H(M1, MZ) = H(MZ, M1) = -1 / (length_ * s[M1] * s[M1]);
  return H;
}

Eigen::VectorXd StandGoal::constraint_values(const Moments& s) const { return constraint_jacobian(s) * s; }

Eigen::Matrix<double, Eigen::Dynamic, 10> StandGoal::constraint_jacobian(const Moments&) const {
  Eigen::Matrix<double, Eigen::Dynamic, 10> J = Eigen::Matrix<double, Eigen::Dynamic, 10>::Zero(2, 10);
  for (int k = 0; k < 2; ++k) {
    J(k, MX + k) = 1 / (volume_ * length_);
    J(k, M1) = -target_[k] / (volume_ * length_);
  }
  return J;
}

}  // namespace rayrep
