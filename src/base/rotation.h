#pragma once

#include <Eigen/Geometry>
#include <vector>

namespace rayrep {

/// The smallest rotation that takes the direction of `from` to that of `to`; for opposite directions one of those by pi. Neither
/// needs unit length. Compiled once: Eigen decides between those by a singular value decomposition.
Eigen::Quaterniond rotation_between(const Eigen::Vector3d& from, const Eigen::Vector3d& to);

/// Between two directions, rad; neither needs unit length.
double angle_between(const Eigen::Vector3d& a, const Eigen::Vector3d& b);

/// Two unit vectors across `up`.
Eigen::Matrix<double, 3, 2> across(const Eigen::Vector3d& up);

/// To the middles of the 6 faces, 12 edges and 8 corners of a cube: entries of -1, 0 and 1, not of unit length.
std::vector<Eigen::Vector3d> cube_directions();

/// `up` tilted by |tilt| rad towards across(up) * tilt.
Eigen::Vector3d tilt_by(const Eigen::Vector3d& up, const Eigen::Vector2d& tilt);

}  // namespace rayrep
