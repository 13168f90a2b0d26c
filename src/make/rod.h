#pragma once

#include <Eigen/Core>

#include "rayrep/mesh/mesh.h"

namespace rayrep::detail {

/// A round bar: a pillar from its foot to its neck, or what a drill takes out.
struct Rod {
  Eigen::Vector3d from_mm = Eigen::Vector3d::Zero();
  Eigen::Vector3d to_mm = Eigen::Vector3d::Zero();
  double radius_mm = 0;
};

/// So far are the two apart: the distance of their axes less their radii; negative where they overlap. theory.md (142)
double gap_mm(const Rod& a, const Rod& b);

/// So far is a hole to be from each pillar, over its own radius and the pillar's.
constexpr double kClearOfPillars_mm = 0.2;

/// What a carrier's cone stands on.
/// @param bone          of Carriers::bones, in any frame
/// @param clearance_mm  around the bone: Carrying::clearance_mm
Rod pillar_of(const Mesh& bone, double clearance_mm);

}  // namespace rayrep::detail
