#pragma once

#include <Eigen/Core>
#include <vector>

#include "rayrep/mesh/mesh.h"

namespace rayrep::detail {

/// A surface of revolution about z through (radius, height), from its lowest point on the axis to its highest one there, with so
/// many corners around. Facing outward.
Mesh revolved(const std::vector<Eigen::Vector2d>& profile, int segments);

}  // namespace rayrep::detail
