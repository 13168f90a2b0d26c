#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "physics/clipped_hull.h"

namespace rayrep {

/// A floating body at one attitude: its potential energy over its weight, as a function of the direction of up, with gradient and
/// Hessian on the sphere of directions. theory.md (9).
struct Attitude {
  Eigen::Vector3d up;
  Frame frame;
  double offset = 0;         ///< of the waterplane, from the hull's centre
  double energy = 0;         ///< (c - b).n, mm
  Eigen::Vector2d gradient;  ///< horizontal part of c - b: the righting arm, mm
  Eigen::Matrix2d hessian;   ///< J / V - (c - b).n, mm per rad: the metacentric heights
  Eigen::Vector3d centre_of_flotation;
  std::vector<int> dry_points;  ///< of the hull, below the water
};

/// @param volume          displaced
/// @param centre_of_mass  from the hull's centre, as all points here
/// @param guess           of the offset; NaN: none
/// @return none if the body sinks
std::optional<Attitude> attitude(ClippedHull& hull, double volume, const Eigen::Vector3d& centre_of_mass, const Eigen::Vector3d& up,
                                 double guess);

}  // namespace rayrep
