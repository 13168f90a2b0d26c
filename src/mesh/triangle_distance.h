#pragma once

#include <Eigen/Core>
#include <array>
#include <limits>

#include "rayrep/mesh/mesh.h"

namespace rayrep {

using Corners3 = std::array<Eigen::Vector3d, 3>;

inline Corners3 corners_of(const Mesh& mesh, int triangle) {
  const auto t = static_cast<std::size_t>(triangle);
  return {mesh.corner(t, 0), mesh.corner(t, 1), mesh.corner(t, 2)};
}

/// The two points at which two triangles are nearest to each other.
struct NearestPair {
  double distance_mm = std::numeric_limits<double>::infinity();
  Eigen::Vector3d on_first = Eigen::Vector3d::Zero();
  Eigen::Vector3d on_second = Eigen::Vector3d::Zero();
};

/// Smallest distance of two closed triangles, degenerate ones too, in double; 0 when one passes through the other, which is decided
/// without rounding. theory.md (43)
NearestPair triangle_distance(const Corners3& p, const Corners3& q);

}  // namespace rayrep
