#pragma once

#include <Eigen/Core>
#include <optional>

#include "make/body.h"
#include "rayrep/solve/goals.h"

namespace rayrep::detail {

/// On this centre of mass, void around it and material where it is far from it. theory.md (68)
/// @param centre_mm   in the working frame
/// @param volume_mm3  of material, where it is given
Goal centred_goal(const Eigen::Vector3d& centre_mm, std::optional<double> volume_mm3, const Body& body, double density_g_cm3);

}  // namespace rayrep::detail
