#include "mesh/prism.h"

#include <cmath>
#include <numbers>

namespace rayrep {

Mesh surface_of(const Prism& prism) {
  const int n = prism.sides;
  const double half = std::numbers::pi / n;
  const double corner_mm =
      prism.radius_mm * (prism.fit == Prism::Fit::around ? 1 / std::cos(half) : std::sqrt(2 * half / std::sin(2 * half)));
  const Eigen::Vector3d x = prism.axis.unitOrthogonal();
  const Eigen::Vector3d y = prism.axis.cross(x);
  Mesh mesh;
  for (const double height : {prism.lo_mm, prism.hi_mm})
    for (int k = 0; k < n; ++k)
      mesh.vertices.push_back(prism.middle + height * prism.axis +
                              corner_mm * (std::cos(2 * half * k) * x + std::sin(2 * half * k) * y));
  for (int k = 0; k < n; ++k) {
    const int next = (k + 1) % n;
    mesh.triangles.emplace_back(k, next, n + next);
    mesh.triangles.emplace_back(k, n + next, n + k);
  }
  for (int k = 2; k < n; ++k) {
    mesh.triangles.emplace_back(0, k, k - 1);
    mesh.triangles.emplace_back(n, n + k - 1, n + k);
  }
  return mesh;
}

}  // namespace rayrep
