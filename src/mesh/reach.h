#pragma once

#include <algorithm>

#include "rayrep/mesh/mesh.h"

namespace rayrep {

/// How far the farthest vertex is from a point.
inline double reach_mm(const Mesh& mesh, const Eigen::Vector3d& p) {
  double reach = 0;
  for (const Eigen::Vector3d& v : mesh.vertices) reach = std::max(reach, (v - p).norm());
  return reach;
}

}  // namespace rayrep
