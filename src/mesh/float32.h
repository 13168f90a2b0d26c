#pragma once

#include "rayrep/mesh/mesh.h"

namespace rayrep {

/// A coordinate as a file of 32-bit numbers keeps it. By way of memory: gcc 12 with -O2 takes two such roundings side by side for
/// nothing and leaves the numbers as they are.
inline double as_float32(double coordinate) {
  const volatile float stored = static_cast<float>(coordinate);
  return stored;
}

inline Eigen::Vector3d as_float32(const Eigen::Vector3d& p) {
  return p.unaryExpr([](double x) { return as_float32(x); });
}

inline Mesh as_float32(Mesh mesh) {
  for (Eigen::Vector3d& v : mesh.vertices) v = as_float32(v);
  return mesh;
}

}  // namespace rayrep
