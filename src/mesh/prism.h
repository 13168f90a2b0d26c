#pragma once

#include <Eigen/Geometry>

#include "rayrep/mesh/mesh.h"

namespace rayrep {

/// A right prism over a regular polygon.
struct Prism {
  Eigen::Vector3d middle = Eigen::Vector3d::Zero();  ///< of the polygon, at height 0
  Eigen::Vector3d axis = Eigen::Vector3d::UnitZ();   ///< a unit vector
  double radius_mm = 1;                              ///< of the circle
  double lo_mm = 0, hi_mm = 1;                       ///< heights of its ends along the axis
  int sides = 96;
  /// How the polygon lies to the circle.
  enum class Fit { around, same_area } fit = Fit::around;
};

/// Its surface, facing outward.
Mesh surface_of(const Prism& prism);

}  // namespace rayrep
