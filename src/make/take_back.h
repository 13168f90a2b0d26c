#pragma once

#include <algorithm>
#include <cstddef>

#include "rayrep/mesh/mesh.h"

namespace rayrep::detail {

/// Takes back moves of vertices where they have spoilt triangles, of each triangle the farthest first, until none is spoilt or
/// moved.
/// @param spoilt  of a triangle's number, as the mesh is then
template <typename Spoilt>
void take_back_where(const Spoilt& spoilt, const Mesh& before, Mesh& mesh) {
  const auto moved = [&](int n) { return (mesh.vertices[n] - before.vertices[n]).squaredNorm(); };
  for (bool changed = true; changed;) {
    changed = false;
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
      const Eigen::Vector3i& v = mesh.triangles[t];
      const int farthest = *std::max_element(v.begin(), v.end(), [&](int m, int n) { return moved(m) < moved(n); });
      if (mesh.vertices[farthest] == before.vertices[farthest] || !spoilt(t)) continue;
      mesh.vertices[farthest] = before.vertices[farthest];
      changed = true;
    }
  }
}

/// The normal of a triangle, twice its area long.
inline Eigen::Vector3d twice_area(const Mesh& mesh, std::size_t t) {
  return (mesh.corner(t, 1) - mesh.corner(t, 0)).cross(mesh.corner(t, 2) - mesh.corner(t, 0));
}

}  // namespace rayrep::detail
