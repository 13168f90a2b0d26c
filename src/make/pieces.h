#pragma once

#include <Eigen/Core>
#include <vector>

#include "rayrep/mesh/delivery.h"

namespace rayrep::detail {

/// Turns `up` of a piece to +z and puts its lowest point on the bed.
void lay_down(Part& piece, const Eigen::Vector3d& up);

/// Moves pieces that lie on the bed side by side, in rows.
void lay_side_by_side(std::vector<Part>& pieces);

}  // namespace rayrep::detail
