#include "rayrep/solve/goals.h"

#include <algorithm>
#include <cassert>

#include "base/linear_algebra.h"
#include "base/rotation.h"

namespace rayrep {

namespace {

/// a.s + 0, under no constraints yet.
Goal linear(const Moments& a) {
  Goal goal;
  goal.affine = true;
  goal.f = [a](const Moments& s) { return Derivatives{a.dot(s), a, Matrix10::Zero()}; };
  return goal;
}

void set_constraints(Goal& goal, Eigen::Index count) {
  goal.J = Eigen::Matrix<double, Eigen::Dynamic, 10>::Zero(count, 10);
  goal.c_0 = Eigen::VectorXd::Zero(count);
}

}  // namespace

Goal with_at_most(Goal goal, const Moments& a, double a_0) {
  const Eigen::Index rows = goal.J.rows();
  goal.J.conservativeResize(rows + 1, 10);
  goal.J.row(rows) = a.transpose();
  goal.c_0.conservativeResize(rows + 1);
  goal.c_0[rows] = a_0;
  ++goal.at_most;
  return goal;
}

Goal with_equation(Goal goal, const Moments& a, double a_0) {
  const Eigen::Index rows = goal.J.rows();
  const Eigen::Index equations = rows - goal.at_most;
  goal.J.conservativeResize(rows + 1, 10);
  goal.c_0.conservativeResize(rows + 1);
  for (Eigen::Index k = rows; k > equations; --k) {
    goal.J.row(k) = goal.J.row(k - 1).eval();
    goal.c_0[k] = goal.c_0[k - 1];
  }
  goal.J.row(equations) = a.transpose();
  goal.c_0[equations] = a_0;
  return goal;
}

Goal with_cuts(Goal goal, const std::vector<Moments>& cuts) {
  goal.cone.reset();
  for (const Moments& a : cuts) goal = with_at_most(std::move(goal), a, 0);
  return goal;
}

Goal linear_goal(const Moments& q, const Goal& other) {
  Goal goal = linear(q);
  goal.J = other.J;
  goal.c_0 = other.c_0;
  goal.at_most = other.at_most;
  goal.cone = other.cone;
  return goal;
}

Goal mapped(const Goal& goal, const Matrix10& T) {
  Goal result;
  result.J = product(goal.J, T);
  result.c_0 = goal.c_0;
  result.at_most = goal.at_most;
  result.affine = goal.affine;
  result.f = [f = goal.f, T](const Moments& s) {
    const Derivatives d = f(T * s);
    return Derivatives{d.value, T.transpose() * d.gradient, restricted(d.hessian, T)};
  };
  if (goal.cone) {
    const Goal::Cone& c = *goal.cone;
    result.cone = {T.transpose() * c.xx, T.transpose() * c.yy, T.transpose() * c.xy};
  }
  return result;
}

Goal float_goal(double material_mm3, const Eigen::Vector2d& centre_of_buoyancy_mm, double length_mm) {
  assert(material_mm3 > 0 && length_mm > 0);
  const Moments unit = moment_units(material_mm3, length_mm);
  Goal goal;
  goal.affine = true;
  goal.f = [unit_z = unit[MZ]](const Moments& s) {
    return Derivatives{s[MZ] / unit_z, Moments::Unit(MZ) / unit_z, Matrix10::Zero()};
  };
  set_constraints(goal, 3);
  goal.J(0, M1) = 1 / unit[M1];
  for (int k = 0; k < 2; ++k) {
    goal.J(1 + k, MX + k) = 1 / unit[MX];
    goal.J(1 + k, M1) = -centre_of_buoyancy_mm[k] / unit[MX];
  }
  goal.c_0[0] = -1;
  return goal;
}

namespace {

/// s_z^2 / m.
Derivatives steiner(const Moments& s) {
  const double m = s[M1];
  const double z = s[MZ];
  Derivatives t;
  t.value = z * z / m;
  t.gradient[M1] = -z * z / (m * m);
  t.gradient[MZ] = 2 * z / m;
  t.hessian(M1, M1) = 2 * z * z / (m * m * m);
  t.hessian(M1, MZ) = t.hessian(MZ, M1) = -2 * z / (m * m);
  t.hessian(MZ, MZ) = 2 / m;
  return t;
}

/// R = (I~xx^2 + I~yy^2 + 2 I~xy^2) / Izz^2.
Derivatives inertia_term(const Moments& s) {
  const Derivatives w = steiner(s);
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

  Derivatives t;
  t.value = numerator / d2;
  t.gradient = du.transpose() * dR;
  const Eigen::Matrix<double, 10, 4> half = du.transpose() * ddR;
  t.hessian = product(half, du) - (dR[0] + dR[1]) * w.hessian;
  return t;
}

Derivatives inverse(const Derivatives& a) {
  const double v = a.value;
  return {1 / v, -a.gradient / (v * v), -a.hessian / (v * v) + (2 / (v * v * v)) * (a.gradient * a.gradient.transpose())};
}

/// lambda c_z / L + gamma_c (s_z / (V L))^2 + gamma_i (R or 1 / R).
Derivatives spin_objective(const Moments& s, const SpinWeights& weights, bool largest, double volume, double length) {
  const Derivatives R = largest ? inertia_term(s) : inverse(inertia_term(s));
  const double m = s[M1];
  const double z = s[MZ];
  Derivatives t{weights.gamma_i * R.value, weights.gamma_i * R.gradient, weights.gamma_i * R.hessian};
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

Goal spin_goal(const SpinWeights& weights, bool largest, bool yoyo, double volume_mm3, double length_mm) {
  assert(volume_mm3 > 0 && length_mm > 0);
  Goal goal;
  goal.f = [=](const Moments& s) { return spin_objective(s, weights, largest, volume_mm3, length_mm); };
  set_constraints(goal, yoyo ? 5 : 4);
  goal.J(0, MX) = goal.J(1, MY) = 1 / (volume_mm3 * length_mm);
  goal.J(2, MXZ) = goal.J(3, MYZ) = 1 / (volume_mm3 * length_mm * length_mm);
  if (yoyo) goal.J(4, MZ) = 1 / (volume_mm3 * length_mm);
  return goal;
}

double inertia_ratio(const Moments& s) { return inertia_term(s).value; }

Goal stand_goal(const Eigen::Vector2d& target_mm, double volume_mm3, double length_mm) {
  assert(volume_mm3 > 0 && length_mm > 0);
  const Moments unit = moment_units(volume_mm3, length_mm);
  Goal goal;
  goal.f = [L = length_mm](const Moments& s) {
    const double m = s[M1];
    Derivatives d;
    d.value = s[MZ] / (L * m);
    d.gradient[M1] = -s[MZ] / (L * m * m);
    d.gradient[MZ] = 1 / (L * m);
    d.hessian(M1, M1) = 2 * s[MZ] / (L * m * m * m);
    d.hessian(M1, MZ) = d.hessian(MZ, M1) = -1 / (L * m * m);
    return d;
  };
  set_constraints(goal, 2);
  for (int k = 0; k < 2; ++k) {
    goal.J(k, MX + k) = 1 / unit[MX];
    goal.J(k, M1) = -target_mm[k] / unit[MX];
  }
  return goal;
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

/// Volume, static moment or entry of the inertia tensor about the origin along the given axes, unit density. theory.md (34a)
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

/// The moment of inertia about u through the origin, unit density.
Moments moment_about(const Eigen::Vector3d& u) { return trace() - second_moment(u, u); }

/// r J_l - Izz 1 has no positive eigenvalue, J_l the lateral 2 x 2 tensor about the origin. theory.md (76)
/// @param up  a unit vector
Goal::Cone spin_cone(const Eigen::Vector3d& up, double ratio, double unit) {
  const Eigen::Matrix<double, 3, 2> plane = across(up);
  const Moments axial = moment_about(up);
  return {(ratio * moment_about(plane.col(0)) - axial) / unit, (ratio * moment_about(plane.col(1)) - axial) / unit,
          -ratio / unit * second_moment(plane.col(0), plane.col(1))};
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
  set_constraints(*this, std::count_if(setup.wanted.begin(), setup.wanted.end(), [](const auto& w) { return w.has_value(); }));
  Eigen::Index row = 0;
  const auto scale_of = [&](int k, double value) {
    const bool to_itself = k == M1 || (k >= MXX && k <= MZZ);
    return to_itself ? rho / value : 1 / unit[k];
  };
  for (int k = M1; k <= MXZ; ++k) {
    const std::optional<double>& wanted = setup.wanted[static_cast<std::size_t>(k)];
    if (!wanted) continue;
    const Moments a = inertial_functional(static_cast<MomentIndex>(k), setup.axes);
    given.push_back(free_part(a).normalized());
    const double scale = scale_of(k, *wanted);
    J.row(row) = scale * a.transpose();
    c_0[row++] = k >= MX && k <= MZ ? 0 : -scale * *wanted / rho;
  }
  const auto bound = [&](int k, double value, double sign) {
    const Moments a = inertial_functional(static_cast<MomentIndex>(k), setup.axes);
    const double scale = sign * scale_of(k, value);
    const bool place = k >= MX && k <= MZ;
    static_cast<Goal&>(*this) =
        with_at_most(*this, scale * (a - (place ? value : 0) * Moments(Moments::Unit(M1))), place ? 0 : -scale * value / rho);
  };
  for (int k = M1; k <= MXZ; ++k) {
    if (const auto& most = setup.at_most[static_cast<std::size_t>(k)]) bound(k, *most, 1);
    if (const auto& least = setup.at_least[static_cast<std::size_t>(k)]) bound(k, *least, -1);
  }

  if (setup.least_spin_ratio) cone = spin_cone(setup.up, *setup.least_spin_ratio, unit[MXX]);

  const auto choose = [&](const std::optional<Wish>& wish, const Moments& a) {
    if (chosen.size() == 3 || free_part(a).norm() < 1e-6) return;
    chosen.push_back({wish, a});
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
  Moments gradient = Moments::Zero();
  double weight = 1;
  for (const Chosen& one : chosen) {
    gradient += weight * one.gradient;
    weight *= setup.weight;
  }
  affine = true;
  f = linear(gradient).f;
}

}  // namespace rayrep
