#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <vector>

#include "rayrep/physics/hydrostatics.h"

namespace rayrep {

/// A body afloat.
struct FloatingBody {
  PreparedHull hull;
  double volume_mm3;                  ///< that it displaces, whatever its heel: its mass over the fluid's density
  Eigen::Vector3d centre_of_mass_mm;  ///< in the hull's frame, as `up`
  Eigen::Vector3d up;                 ///< at no heel; need not be a unit vector
};

/// Righting arms (GZ) of a body that is heeled one way: with n = cos(heel) up - sin(heel) lowered the direction of the world's up
/// in the body,
///     GZ = (c - c_b).dn/dheel,
/// the horizontal distance between the verticals through centre of mass and centre of buoyancy, positive where the pair of weight
/// and buoyancy turns the body back. The body heaves until it displaces `volume_mm3`, and is held in trim: the axis of heel is
/// fixed in the body and horizontal. theory.md (56)-(57).
///
/// Pockets (see hydrostatics) are dry as long as their rims stay above the water, and stay wet once a heel has flooded them. Where
/// those of the body without heel could not hold 1/1000 of what it displaces, none counts as dry at any heel.
struct RightingCurve {
  enum class End {
    turns_over,   ///< the arm vanishes: from there on the body turns further
    takes_water,  ///< the rim of a pocket goes under that is dry, below the water, at no heel
    none,         ///< it rights itself from upside down, too
  };

  Eigen::Vector3d lowered = Eigen::Vector3d::UnitX();  ///< the side of the body that goes down: horizontal at no heel
  std::vector<double> heel_rad;                        ///< from 0 to pi
  std::vector<double> arm_mm;                          ///< at these; NaN where it has sunk
  double range_rad = 0;                                ///< the arm is positive and no water comes in from 0 to this heel
  End end = End::none;                                 ///< what happens there
  /// Under the arms from 0 to `range_rad`: the rise of the potential energy over the weight, and so the height by which the body
  /// would have to be lifted for as much work. mm rad
  double area_mm_rad = 0;
  std::size_t largest = 0;  ///< place of the largest arm within the range
};

struct RightingOptions {
  int steps = 18;      ///< between 0 and pi; where the arm is negative only between two of them is not seen
  int directions = 8;  ///< ways to heel that are looked at, evenly spread
  double tolerance_rad = 1e-6;
};

/// The arms when `lowered` goes down.
/// @param lowered  its part across `up` counts
/// @throws Error{goal} if the body sinks at no heel
RightingCurve righting_curve(const FloatingBody& body, const Eigen::Vector3d& lowered, const RightingOptions& options = {});

/// That of the direction with the smallest range: whichever way it is heeled by less the arm is positive, so that the tilt of a
/// body let go there falls. Directions are compared by few heels: quarters of half a turn over the side that the smallest
/// metacentric height is across, and of the others, in parallel, half of its range and 0.999 of it. Among equals the first.
/// @throws Error{goal} if the body sinks at no heel
RightingCurve weakest_righting_curve(const FloatingBody& body, const RightingOptions& options = {});

/// The arms of a body that is wholly under water: GZ = BG sin(heel), BG the depth of the centre of mass below the centre of
/// buoyancy, the same in all directions. theory.md (58).
/// @param depth_mm  BG; negative where the centre of mass is above: then the range is 0
RightingCurve submerged_righting_curve(double depth_mm, const RightingOptions& options = {});

}  // namespace rayrep
