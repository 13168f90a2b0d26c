#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "mesh/shells.h"
#include "solids.h"

namespace rayrep {
namespace {

using Eigen::Vector3d;

/// Winding number of one shell at p by the solid angles of its triangles (van Oosterom and Strackee 1983).
double winding_by_angles(const Mesh& mesh, const Components& components, int shell, const Vector3d& p) {
  double sum = 0;
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    if (components.of_triangle[t] != shell) continue;
    const Vector3d a = mesh.corner(t, 0) - p, b = mesh.corner(t, 1) - p, c = mesh.corner(t, 2) - p;
    const double la = a.norm(), lb = b.norm(), lc = c.norm();
    sum += std::atan2(a.dot(b.cross(c)), la * lb * lc + a.dot(b) * lc + b.dot(c) * la + c.dot(a) * lb) / (2 * test::kPi);
  }
  return sum;
}

TEST(Shells, SurroundingsAreThoseOfSolidAngles) {
  const Mesh mesh = test::merged({test::icosphere(10, 2), test::flipped(test::icosphere(6, 2, {1, 0, 0})), test::icosphere(3, 2),
                                  test::icosphere(8, 2, {9, 0, 0}), test::box({20, 0, 0}, {24, 3, 2})});
  const Components components = connected_components(mesh);
  ASSERT_EQ(components.count, 5);
  ShellNesting nesting(mesh, components.of_triangle);
  Surroundings around;
  std::mt19937 random(7);
  std::uniform_real_distribution<double> x(-12, 25), y(-11, 11);
  for (int n = 0; n < 300; ++n) {  // beyond the first few, which are found without a tree
    const Vector3d p(x(random), y(random), y(random));
    const int self = n % 6 - 1;  // -1: of none
    nesting.around(p, self, around);
    EXPECT_TRUE(around.line_closes);
    std::vector<int> windings(5, 0);
    for (const auto& [shell, winding] : around.shells) windings[static_cast<std::size_t>(shell)] = winding;
    int sum = 0;
    for (int shell = 0; shell < 5; ++shell) {
      const int expected = shell == self ? 0 : static_cast<int>(std::lround(winding_by_angles(mesh, components, shell, p)));
      EXPECT_EQ(windings[static_cast<std::size_t>(shell)], expected) << p.transpose() << " in shell " << shell;
      sum += expected;
    }
    EXPECT_EQ(around.winding, sum);
  }
}

TEST(Shells, TouchedShellsAreNamed) {
  const Mesh mesh = test::merged({test::box({0, 0, 0}, {4, 4, 4}), test::box({1, 1, 4}, {3, 3, 6})});
  const Components components = connected_components(mesh);
  ShellNesting nesting(mesh, components.of_triangle);
  Surroundings around;
  nesting.around({2.1, 1.7, 4}, 1, around);
  EXPECT_EQ(around.touched, std::vector<int>{0});
  nesting.around({2.1, 1.7, 4.5}, 1, around);
  EXPECT_TRUE(around.touched.empty());
}

TEST(Shells, OfAnOpenMeshTheLineThroughTheHoleDoesNotClose) {
  Mesh mesh = test::box({0, 0, 0}, {4, 4, 4});
  std::erase_if(mesh.triangles, [&](const Eigen::Vector3i& t) {
    return mesh.vertices[t[0]].z() == 4 && mesh.vertices[t[1]].z() == 4 && mesh.vertices[t[2]].z() == 4;
  });
  const std::vector<int> of_triangle(mesh.triangles.size(), 0);
  ShellNesting nesting(mesh, of_triangle);
  Surroundings around;
  nesting.around({2.1, 1.7, 2}, -1, around);
  EXPECT_FALSE(around.line_closes);
  nesting.around({5, 1.7, 2}, -1, around);
  EXPECT_TRUE(around.line_closes);
}

TEST(Shells, VolumesAreSigned) {
  const Mesh mesh = test::hollow(test::box({100, 0, 0}, {104, 4, 4}), test::box({101, 1, 1}, {102, 2, 3}));
  const std::vector<double> volumes = shell_volumes(mesh, connected_components(mesh).of_triangle, 2);
  EXPECT_NEAR(volumes[0], 64, 1e-12);
  EXPECT_NEAR(volumes[1], -2, 1e-12);
}

TEST(Mesh, UpToZIsARotationAndExactAlongAxes) {
  for (int axis = 0; axis < 3; ++axis)
    for (const double sign : {-2.5, 1.0, 7.0}) {
      const Vector3d up = sign * Vector3d::Unit(axis);
      const Eigen::Matrix3d R = up_to_z(up);
      EXPECT_EQ(R * up, Vector3d(0, 0, std::abs(sign)));
      EXPECT_EQ(R * R.transpose(), Eigen::Matrix3d::Identity());
      EXPECT_EQ(R.determinant(), 1);
    }
  for (std::uint64_t seed = 0; seed < 20; ++seed) {
    const Vector3d up = 3 * test::random_rotation(seed).col(0);
    const Eigen::Matrix3d R = up_to_z(up);
    EXPECT_LT((R * up - Vector3d(0, 0, 3)).norm(), 1e-14);
    EXPECT_LT((R * R.transpose() - Eigen::Matrix3d::Identity()).norm(), 1e-14);
    EXPECT_GT(R.determinant(), 0);
  }
}

}  // namespace
}  // namespace rayrep
