#pragma once

#include <Eigen/Core>
#include <vector>

#include "rayrep/mesh/mesh.h"
#include "rayrep/physics/moments.h"

namespace rayrep {

/// What stays in one hollow of a body that is held still and lets all run out that finds a way down.
struct Pool {
  Moments s = Moments::Zero();                          ///< unit density, in the frame of the body
  Eigen::Vector3d lowest_mm = Eigen::Vector3d::Zero();  ///< its deepest corner
  double surface_mm = 0;                                ///< its height along `up`; infinite in a sealed cavity
};

/// The pools of liquid that stay in a body held with `up` upward: all points that are not material and from which every way out
/// leads over a higher point. Sealed cavities are among them, and hollows of the outside. Exact but for rounding, theory.md (102).
/// @param body  closed; where bodies overlap, the boundary of their union
/// @param up    need not be a unit vector
/// @return      in the order of their first triangles
std::vector<Pool> pools_in(const Mesh& body, const Eigen::Vector3d& up);

/// The sum of their moments.
Moments total(const std::vector<Pool>& pools);

}  // namespace rayrep
