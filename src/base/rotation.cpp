#include "base/rotation.h"

#include <cmath>

namespace rayrep {

Eigen::Quaterniond rotation_between(const Eigen::Vector3d& from, const Eigen::Vector3d& to) {
  return Eigen::Quaterniond::FromTwoVectors(from, to);
}

double angle_between(const Eigen::Vector3d& a, const Eigen::Vector3d& b) { return std::atan2(a.cross(b).norm(), a.dot(b)); }

Eigen::Matrix<double, 3, 2> across(const Eigen::Vector3d& up) {
  Eigen::Matrix<double, 3, 2> basis;
  basis.col(0) = up.unitOrthogonal();
  basis.col(1) = up.cross(basis.col(0));
  return basis;
}

std::vector<Eigen::Vector3d> cube_directions() {
  std::vector<Eigen::Vector3d> directions;
  for (int x = -1; x <= 1; ++x)
    for (int y = -1; y <= 1; ++y)
      for (int z = -1; z <= 1; ++z)
        if (x != 0 || y != 0 || z != 0) directions.emplace_back(x, y, z);
  return directions;
}

Eigen::Vector3d tilt_by(const Eigen::Vector3d& up, const Eigen::Vector2d& tilt) {
  const double angle = tilt.norm();
  if (angle == 0) return up;
  return std::cos(angle) * up + std::sin(angle) * (across(up) * tilt / angle);
}

}  // namespace rayrep
