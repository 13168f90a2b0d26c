#include "mesh/revolved.h"

#include <cmath>
#include <numbers>

namespace rayrep::detail {

Mesh revolved(const std::vector<Eigen::Vector2d>& profile, int segments) {
  Mesh mesh;
  mesh.vertices.emplace_back(0, 0, profile.front().y());
  const int rings = static_cast<int>(profile.size()) - 2;
  for (int r = 1; r <= rings; ++r)
    for (int k = 0; k < segments; ++k) {
      const double angle = 2 * std::numbers::pi * k / segments;
      const Eigen::Vector2d& p = profile[static_cast<std::size_t>(r)];
      mesh.vertices.emplace_back(p.x() * std::cos(angle), p.x() * std::sin(angle), p.y());
    }
  mesh.vertices.emplace_back(0, 0, profile.back().y());
  const int top = static_cast<int>(mesh.vertices.size()) - 1;
  const auto at = [segments](int ring, int k) { return 1 + ring * segments + k % segments; };
  for (int k = 0; k < segments; ++k) {
    mesh.triangles.emplace_back(0, at(0, k + 1), at(0, k));
    for (int r = 0; r + 1 < rings; ++r) {
      mesh.triangles.emplace_back(at(r, k), at(r, k + 1), at(r + 1, k + 1));
      mesh.triangles.emplace_back(at(r, k), at(r + 1, k + 1), at(r + 1, k));
    }
    mesh.triangles.emplace_back(top, at(rings - 1, k), at(rings - 1, k + 1));
  }
  return mesh;
}

}  // namespace rayrep::detail
