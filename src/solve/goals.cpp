#include "rayrep/solve/goals.h"

#include <algorithm>
#include <cassert>

namespace rayrep {

Eigen::Matrix<double, 10, 10> Goal::constraint_hessian(const Moments&, const Eigen::VectorXd&) const {
  return Eigen::Matrix<double, 10, 10>::Zero();
}

double MappedGoal::objective(const Moments& s) const { return goal_.objective(T_ * s); }

Moments MappedGoal::gradient(const Moments& s) const { return T_.transpose() * goal_.gradient(T_ * s); }

Eigen::Matrix<double, 10, 10> MappedGoal::hessian(const Moments& s) const { return T_.transpose() * goal_.hessian(T_ * s) * T_; }

Eigen::VectorXd MappedGoal::constraint_values(const Moments& s) const { return goal_.constraint_values(T_ * s); }

Eigen::Matrix<double, Eigen::Dynamic, 10> MappedGoal::constraint_jacobian(const Moments& s) const {
  return goal_.constraint_jacobian(T_ * s) * T_;
}

Eigen::Matrix<double, 10, 10> MappedGoal::constraint_hessian(const Moments& s, const Eigen::VectorXd& mu) const {
  return T_.transpose() * goal_.constraint_hessian(T_ * s, mu) * T_;
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

namespace {

/// u.M v, with the matrix M of second moments, as a linear function of s.
Moments second_moment(const Eigen::Vector3d& u, const Eigen::Vector3d& v) {
  Moments a = Moments::Zero();
  a.segment<3>(MXX) = u.cwiseProduct(v);
  a[MXY] = u.x() * v.y() + u.y() * v.x();
  a[MYZ] = u.y() * v.z() + u.z() * v.y();
  a[MXZ] = u.x() * v.z() + u.z() * v.x();
  return a;
}

/// The trace of M.
Moments trace() {
  Moments a = Moments::Zero();
  a.segment<3>(MXX).setOnes();
  return a;
}

/// Volume, static moment or entry of the inertia tensor about the origin along the given axes, unit density.
Moments inertial_functional(MomentIndex number, const Eigen::Matrix3d& axes) {
  Moments a = Moments::Zero();
  if (number == M1)
    a[M1] = 1;
  else if (number <= MZ)
    a.segment<3>(MX) = axes.col(number - MX);
  else if (number <= MZZ)
    a = trace() - second_moment(axes.col(number - MXX), axes.col(number - MXX));
  else
    a = -second_moment(axes.col(number == MYZ ? 1 : 0), axes.col(number == MXY ? 1 : 2));
  return a;
}

}  // namespace

TargetGoal::TargetGoal(const Setup& setup) {
  const double V = setup.volume_mm3;
  const double L = setup.length_mm;
  const double rho = setup.density_g_cm3 * 1e-3;
  assert(rho > 0 && V > 0 && L > 0 && setup.weight > 0);
  Moments unit;
  unit << V, Eigen::Vector3d::Constant(V * L), Eigen::Matrix<double, 6, 1>::Constant(V * L * L);

  std::vector<Moments> given;  // orthonormal, in these units
  const auto free_part = [&](Moments a) {
    a = a.cwiseProduct(unit);
    const double size = a.norm();
    for (int twice = 0; twice < 2; ++twice)
      for (const Moments& g : given) a -= g.dot(a) * g;
    return Moments(a / size);
  };
  std::vector<double> offsets;
  jacobian_.resize(static_cast<Eigen::Index>(
                       std::count_if(setup.wanted.begin(), setup.wanted.end(), [](const auto& w) { return w.has_value(); })),
                   10);
  for (int k = M1; k <= MXZ; ++k) {
    const std::optional<double>& wanted = setup.wanted[static_cast<std::size_t>(k)];
    if (!wanted) continue;
    const Moments a = inertial_functional(static_cast<MomentIndex>(k), setup.axes);
    given.push_back(free_part(a).normalized());
    const bool to_itself = k == M1 || (k >= MXX && k <= MZZ);
    const double scale = to_itself ? rho / *wanted : 1 / unit[k];
    jacobian_.row(static_cast<Eigen::Index>(offsets.size())) = scale * a.transpose();
    offsets.push_back(k >= MX && k <= MZ ? 0 : -scale * *wanted / rho);
  }
  offset_ = Eigen::Map<const Eigen::VectorXd>(offsets.data(), static_cast<Eigen::Index>(offsets.size()));

  const auto choose = [&](const std::optional<Wish>& wish, const Moments& a) {
    if (chosen_.size() == 3 || free_part(a).norm() < 1e-6) return;
    chosen_.push_back({wish, a});
  };
  const auto choose_number = [&](const Wish& wish) {
    choose(wish, (wish.largest ? -1 : 1) / unit[wish.number] * inertial_functional(wish.number, setup.axes));
  };
  for (const Wish& wish : setup.order) choose_number(wish);
  choose_number({M1});
  Moments height = Moments::Zero();
  height.segment<3>(MX) = setup.up / unit[MZ];
  choose(setup.axes.col(2) == setup.up ? std::optional(Wish{MZ}) : std::nullopt, height);
  choose(std::nullopt, 2 / unit[MXX] * trace());
  for (int k = M1; k <= MXZ; ++k) choose_number({static_cast<MomentIndex>(k)});
  double weight = 1;
  for (const Chosen& chosen : chosen_) {
    gradient_ += weight * chosen.gradient;
    weight *= setup.weight;
  }
}

}  // namespace rayrep
