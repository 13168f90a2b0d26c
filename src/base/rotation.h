#pragma once

#include <Eigen/Geometry>

namespace rayrep {

/// The smallest rotation that takes the direction of `from` to that of `to`; for opposite directions one of those by pi. Neither
/// needs unit length. Compiled once: Eigen decides between those by a singular value decomposition.
Eigen::Quaterniond rotation_between(const Eigen::Vector3d& from, const Eigen::Vector3d& to);

}  // namespace rayrep
