#pragma once

// Shapes that tests and fuzz targets share, exactly closed and facing outward.

#include <Eigen/Core>
#include <algorithm>
#include <map>
#include <utility>
#include <vector>

#include "rayrep/mesh/mesh.h"

namespace rayrep::test {

inline Mesh box(const Eigen::Vector3d& min, const Eigen::Vector3d& max) {
  Mesh mesh;
  for (int k = 0; k < 8; ++k)
    mesh.vertices.emplace_back(k & 1 ? max.x() : min.x(), k & 2 ? max.y() : min.y(), k & 4 ? max.z() : min.z());
  mesh.triangles = {{0, 2, 3}, {0, 3, 1}, {4, 5, 7}, {4, 7, 6}, {0, 1, 5}, {0, 5, 4},
                    {2, 6, 7}, {2, 7, 3}, {0, 4, 6}, {0, 6, 2}, {1, 3, 7}, {1, 7, 5}};
  return mesh;
}

/// Boundary of the union of unit cells of a grid, scaled by `size`; neighbouring cells share no inner walls.
inline Mesh polycubes(const std::vector<Eigen::Vector3i>& cells, double size = 1) {
  const auto less = [](const Eigen::Vector3i& a, const Eigen::Vector3i& b) {
    return std::lexicographical_compare(a.data(), a.data() + 3, b.data(), b.data() + 3);
  };
  std::map<Eigen::Vector3i, int, decltype(less)> numbers(less);
  Mesh mesh;
  const auto vertex = [&](const Eigen::Vector3i& p) {
    const auto [it, added] = numbers.try_emplace(p, static_cast<int>(mesh.vertices.size()));
    if (added) mesh.vertices.emplace_back(size * p.cast<double>());
    return it->second;
  };
  for (const auto& cell : cells)
    for (int axis = 0; axis < 3; ++axis)
      for (int side = 0; side < 2; ++side) {
        Eigen::Vector3i neighbour = cell;
        neighbour[axis] += side ? 1 : -1;
        if (std::find(cells.begin(), cells.end(), neighbour) != cells.end()) continue;
        Eigen::Vector3i u = Eigen::Vector3i::Zero();
        Eigen::Vector3i v = Eigen::Vector3i::Zero();
        u[(axis + 1) % 3] = 1;
        v[(axis + 2) % 3] = 1;
        if (!side) std::swap(u, v);
        Eigen::Vector3i corner = cell;
        corner[axis] += side;
        const int a = vertex(corner);
        const int b = vertex(corner + u);
        const int c = vertex(corner + u + v);
        const int d = vertex(corner + v);
        mesh.triangles.emplace_back(a, b, c);
        mesh.triangles.emplace_back(a, c, d);
      }
  return mesh;
}

}  // namespace rayrep::test
