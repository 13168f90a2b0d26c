#pragma once

#include <Eigen/Core>
#include <algorithm>

namespace rayrep {

/// By x, then y, then z: an order that does not depend on how the vertices are numbered.
inline bool comes_first(const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
  return std::lexicographical_compare(a.begin(), a.end(), b.begin(), b.end());
}

}  // namespace rayrep
