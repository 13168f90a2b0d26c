#include "mesh/part.h"

namespace rayrep {

Mesh part(const Mesh& mesh, const std::vector<int>& triangles) {
  std::vector<int> number(mesh.vertices.size(), -1);
  for (const int t : triangles)
    for (const int v : mesh.triangles[t]) number[v] = 0;
  Mesh result;
  for (std::size_t v = 0; v < number.size(); ++v)
    if (number[v] == 0) {
      number[v] = static_cast<int>(result.vertices.size());
      result.vertices.push_back(mesh.vertices[v]);
    }
  result.triangles.reserve(triangles.size());
  for (const int t : triangles) {
    const Eigen::Vector3i& v = mesh.triangles[t];
    result.triangles.emplace_back(number[v[0]], number[v[1]], number[v[2]]);
  }
  return result;
}

}  // namespace rayrep
