#include <gtest/gtest.h>

#include <map>

#include "mesh/convex_hull.h"
#include "mesh/float32.h"
#include "mesh/predicates.h"
#include "rayrep/base/error.h"
#include "solids.h"

namespace rayrep {
namespace {

using namespace test;

/// Closed, flat to the tolerance and convex to it; no point lies outside.
void expect_hull_of(const std::vector<Eigen::Vector3d>& points, double tolerance) {
  const ConvexPolytope hull = convex_hull(points, tolerance);
  EXPECT_EQ(hull.vertices.size() + hull.faces.size(), hull.edges.size() + 2);  // Euler
  std::map<std::pair<int, int>, int> sides;
  for (const auto& face : hull.faces) {
    EXPECT_NEAR(face.normal.norm(), 1, 1e-12);
    EXPECT_GE(face.corners.size(), 3u);
    double height = -1e9;
    for (const int v : face.corners) height = std::max(height, face.normal.dot(hull.vertices[static_cast<std::size_t>(v)]));
    for (const Eigen::Vector3d& p : points) ASSERT_LE(face.normal.dot(p), height + 3 * tolerance + 1e-12);
    for (std::size_t k = 0; k < face.corners.size(); ++k) ++sides[{face.corners[k], face.corners[(k + 1) % face.corners.size()]}];
  }
  for (const auto& [side, count] : sides) {
    EXPECT_EQ(count, 1);
    EXPECT_TRUE(sides.contains({side.second, side.first}));
  }
  EXPECT_EQ(sides.size(), 2 * hull.edges.size());
}

TEST(ConvexHull, OfRandomPointsHoldsThemAll) {
  Random random(7);
  for (int n = 0; n < 60; ++n) {
    std::vector<Eigen::Vector3d> points;
    for (int k = 0; k < 5 + 10 * n; ++k)
      points.push_back(n % 2 == 0 ? random.in_box(10) : Eigen::Vector3d(10 * random.direction()));
    expect_hull_of(points, n % 3 == 0 ? 0 : 1e-4);
  }
}

TEST(ConvexHull, OfPointsOnAGridHasFlatFaces) {
  // Hundreds of points in a plane and on a line.
  std::vector<Eigen::Vector3d> points;
  for (int x = 0; x <= 6; ++x)
    for (int y = 0; y <= 6; ++y)
      for (int z = 0; z <= 6; ++z) points.emplace_back(x, y, 0.7 * z);
  for (int n = 0; n < 8; ++n) {
    std::vector<Eigen::Vector3d> turned;
    const Eigen::Matrix3d turn = n == 0 ? Eigen::Matrix3d::Identity() : random_rotation(static_cast<std::uint64_t>(n));
    for (const auto& p : points) turned.push_back(as_float32(turn * p));
    expect_hull_of(turned, 1e-4);
    const ConvexPolytope hull = convex_hull(turned, 1e-4);
    EXPECT_EQ(hull.faces.size(), 6u);
    EXPECT_LE(hull.vertices.size(), 12u);  // some stay on an edge
  }
}

TEST(ConvexHull, OfRegularSolidsAreTheirFaces) {
  EXPECT_EQ(convex_hull(icosphere(10, 0).vertices, 1e-4).faces.size(), 20u);
  EXPECT_EQ(convex_hull(subdivided(icosphere(10, 0), 3).vertices, 1e-4).faces.size(), 20u);
  EXPECT_EQ(convex_hull(icosphere(10, 3).vertices, 1e-4).faces.size(), 1280u);
  expect_hull_of(icosphere(10, 4).vertices, 1e-4);
  expect_hull_of(icosphere(10, 4).vertices, 0.05);
}

TEST(ConvexHull, WhatIsFlatHasNone) {
  std::vector<Eigen::Vector3d> points{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {1, 1, 0}};
  EXPECT_THROW(convex_hull(points, 1e-5), Error);
  EXPECT_THROW(convex_hull({}, 1e-5), Error);
  EXPECT_THROW(convex_hull({{0, 0, 0}, {0, 0, 0}}, 1e-5), Error);
  points.emplace_back(0, 0, 1e-6);
  EXPECT_THROW(convex_hull(points, 1e-5), Error);
  points.emplace_back(0, 0, 1e-3);
  EXPECT_EQ(convex_hull(points, 1e-5).faces.size(), 5u);
}

}  // namespace
}  // namespace rayrep
