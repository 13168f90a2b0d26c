#pragma once

#include <Eigen/Core>

#include "rayrep/physics/hydrostatics.h"

namespace rayrep::detail {

/// A body that is let go in a fluid.
struct LetGo {
  const PreparedHull& hull;  ///< up = z
  double fluid_g_cm3 = 1.0;
  double mass_g = 0;
  Eigen::Vector3d centre_mm = Eigen::Vector3d::Zero();  ///< of mass
};

/// Whether it comes back to within `rest_rad` of upright, dry, when it is let go tilted by 10 degrees in so many directions.
bool comes_back(const LetGo& body, int directions, double rest_rad);

}  // namespace rayrep::detail
