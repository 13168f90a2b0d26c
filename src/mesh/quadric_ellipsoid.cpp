#include "mesh/quadric_ellipsoid.h"

#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <optional>
#include <vector>

#include "rayrep/mesh/surface_query.h"

namespace rayrep {
namespace {

using Eigen::Vector3d;

/// p = centre + from_ball * u, u of unit length.
struct Ellipsoid {
  Vector3d centre_mm;
  Eigen::Matrix3d from_ball;
};

std::optional<Ellipsoid> ellipsoid_of(const Quadric& f) {
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(f.hessian);
  const Vector3d bends = solver.eigenvalues();
  if (!(bends.minCoeff() > 0 || bends.maxCoeff() < 0)) return std::nullopt;
  const Vector3d centre = -solver.eigenvectors() * (solver.eigenvectors().transpose() * f.slope).cwiseQuotient(bends);
  const Vector3d radius2 = -2 * f.value(centre) * bends.cwiseInverse();
  if (!(radius2.minCoeff() > 0) || !radius2.allFinite()) return std::nullopt;
  return Ellipsoid{centre, solver.eigenvectors() * radius2.cwiseSqrt().asDiagonal()};
}

/// The faces of an octahedron in n^2 triangles each, with their corners on the unit ball, facing outward.
Mesh ball_of(int n) {
  Mesh mesh;
  std::map<std::array<int, 3>, int> number;
  const auto corner = [&](const Eigen::Vector3i& at) {
    const auto [place, is_new] = number.try_emplace({at.x(), at.y(), at.z()}, static_cast<int>(mesh.vertices.size()));
    if (is_new) mesh.vertices.push_back(at.cast<double>().normalized());
    return place->second;
  };
  for (int octant = 0; octant < 8; ++octant) {
    const Eigen::Vector3i sign(octant & 1 ? -1 : 1, octant & 2 ? -1 : 1, octant & 4 ? -1 : 1);
    const auto at = [&](int i, int j) { return corner(sign.cwiseProduct(Eigen::Vector3i(i, j, n - i - j))); };
    const auto add = [&](int a, int b, int c) {
      sign.prod() > 0 ? mesh.triangles.emplace_back(a, b, c) : mesh.triangles.emplace_back(a, c, b);
    };
    for (int i = 0; i < n; ++i)
      for (int j = 0; i + j < n; ++j) {
        add(at(i, j), at(i + 1, j), at(i, j + 1));
        if (i + j + 1 < n) add(at(i + 1, j), at(i + 1, j + 1), at(i, j + 1));
      }
  }
  return mesh;
}

}  // namespace

bool holds_ellipsoid(const Mesh& mesh, const Quadric& f) {
  const std::optional<Ellipsoid> ellipsoid = ellipsoid_of(f);
  if (!ellipsoid) return false;
  const Vector3d p = ellipsoid->centre_mm + ellipsoid->from_ball.col(0);
  std::vector<LineHit> hits;
  line_hits_brute_force(mesh, p.head<2>(), hits);
  return winding_below(hits, p.z()) > 0;
}

void append_ellipsoid(const Quadric& f, double error_mm, Mesh& mesh) {
  constexpr int kMost = 200;
  const std::optional<Ellipsoid> ellipsoid = ellipsoid_of(f);
  if (!ellipsoid) return;
  // The largest triangles are in the middle of an octant: of sides sqrt(6) / n, 1 / n^2 below the ball.
  const double longest = ellipsoid->from_ball.colwise().norm().maxCoeff();
  Mesh shell = ball_of(std::clamp(static_cast<int>(std::ceil(std::sqrt(longest / error_mm))), 2, kMost));
  for (Vector3d& v : shell.vertices) v = ellipsoid->centre_mm + ellipsoid->from_ball * v;
  if ((ellipsoid->from_ball.determinant() < 0) == (f.hessian.trace() < 0)) flip(shell);
  append(mesh, shell);
}

}  // namespace rayrep
