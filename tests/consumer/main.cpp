#include <rayrep/pieces.h>

#include <array>
#include <cmath>
#include <iostream>

/// A box of 10 x 20 x 30 mm with one corner at the origin.
rayrep::Mesh box() {
  rayrep::Mesh mesh;
  for (int i = 0; i < 8; ++i) mesh.vertices.emplace_back(i & 1 ? 10 : 0, i & 2 ? 20 : 0, i & 4 ? 30 : 0);
  for (const auto& [a, b, c, d] : {std::array{0, 2, 3, 1}, std::array{4, 5, 7, 6}, std::array{0, 1, 5, 4}, std::array{2, 6, 7, 3},
                                   std::array{0, 4, 6, 2}, std::array{1, 3, 7, 5}}) {
    mesh.triangles.emplace_back(a, b, c);
    mesh.triangles.emplace_back(a, c, d);
  }
  return mesh;
}

int main() {
  // Solid checks, moments and the surface query: code that pulls in the third-party libraries at link time.
  const rayrep::CheckedMesh checked = rayrep::require_solid(box(), "box");
  const rayrep::MassProperties body = rayrep::mass_properties(rayrep::mesh_moments(checked.mesh), 1.24);
  const rayrep::SurfaceQuery surface(checked.mesh);
  const double depth = surface.closest({5, 10, 15}, 100).distance_mm;
  std::cout << "mass " << body.mass_g << " g, centre " << body.centre_of_mass_mm.transpose() << " mm, depth " << depth << " mm\n";

  const bool right = std::abs(body.mass_g - 7.44) < 1e-12 && (body.centre_of_mass_mm - Eigen::Vector3d(5, 10, 15)).norm() < 1e-12 &&
                     std::abs(depth - 5) < 1e-6;
  return right ? 0 : 1;
}
