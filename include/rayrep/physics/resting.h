#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

namespace rayrep {

/// How a rigid body that is put down on level ground comes to rest, rolling without momentum: about its lowest point towards where
/// its centre of mass lies, until a second point touches, about the edge through both, until a third does, and over the edges of
/// such faces until the foot of the centre of mass is in one. The height of the centre over the ground, a function of the
/// attitude with the faces of the convex hull at its corners, falls all the way. theory.md (52)
/// @param points             of the body, or of its hull; mm
/// @param centre_of_mass_mm  within their convex hull
/// @param up                 the attitude it is put down in, a unit vector of the body's frame
/// @return                   the attitude it rests in, a unit vector; none when it balances on a point or edge, or is flat
std::optional<Eigen::Vector3d> rest_attitude(const std::vector<Eigen::Vector3d>& points, const Eigen::Vector3d& centre_of_mass_mm,
                                             const Eigen::Vector3d& up);

}  // namespace rayrep
