#pragma once

#include <Eigen/Core>

#include "rayrep/base/progress.h"
#include "rayrep/mesh/mesh.h"

namespace rayrep {

/// How a body comes to rest on level ground.
struct GroundRest {
  Eigen::Vector3d up = Eigen::Vector3d::UnitZ();  ///< direction of world up in the body's frame
  bool rests = false;                             ///< false: it still rolled when its steps were used up
  double height_mm = 0;                           ///< of the centre of mass above the ground
  /// The smallest angle by which it must be tilted from there to roll on: 0 on a face that its centre of mass is above the edge of.
  double holds_rad = 0;
};

/// Follows a body that is let go with `up` up and rolls and topples without sliding or bouncing, its centre of mass going down:
/// about the corner or edge of what touches the ground that is nearest to the vertical through the centre of mass, until a further
/// corner touches; it rests once that vertical meets the ground within them. Only the convex hull of the mesh touches. theory.md
/// (69)
/// @param up         need not be a unit vector. On a corner or an edge that it is balanced on it does not stay.
/// @param shake_rad  what holds it by no more than this does not keep it, if it can be lower beyond
GroundRest ground_rest(const Mesh& mesh, const Eigen::Vector3d& centre_of_mass_mm, const Eigen::Vector3d& up, double shake_rad = 0);

/// How a body ends that is let go in 26 directions all around, those to the middles of faces, edges and corners of a cube, and
/// shaken by 3 degrees: the facets of a round mesh do not hold it.
struct Righted {
  bool rests = true;                              ///< each of them comes to rest
  double tilt_rad = 0;                            ///< the largest off `up` of those that do
  Eigen::Vector3d up = Eigen::Vector3d::UnitZ();  ///< of that one
};
/// @throws Error{interrupted}
Righted righted(const Mesh& mesh, const Eigen::Vector3d& centre_of_mass_mm, const Eigen::Vector3d& up,
                const Progress& progress = {});

}  // namespace rayrep
