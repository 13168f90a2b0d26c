#include "base/rotation.h"

namespace rayrep {

Eigen::Quaterniond rotation_between(const Eigen::Vector3d& from, const Eigen::Vector3d& to) {
  return Eigen::Quaterniond::FromTwoVectors(from, to);
}

Eigen::Matrix<double, 3, 2> across(const Eigen::Vector3d& up) {
  Eigen::Matrix<double, 3, 2> basis;
  basis.col(0) = up.unitOrthogonal();
  basis.col(1) = up.cross(basis.col(0));
  return basis;
}

Eigen::Vector3d tilt_by(const Eigen::Vector3d& up, const Eigen::Vector2d& tilt) {
  const double angle = tilt.norm();
  if (angle == 0) return up;
  return std::cos(angle) * up + std::sin(angle) * (across(up) * tilt / angle);
}

}  // namespace rayrep
