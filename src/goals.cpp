#include "rayrep/goals.h"

#include <cassert>

namespace rayrep {

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

Eigen::Matrix<double, 10, 10> FloatGoal::constraint_hessian(const Moments&, const Eigen::VectorXd&) const {
  return Eigen::Matrix<double, 10, 10>::Zero();
}

}  // namespace rayrep
