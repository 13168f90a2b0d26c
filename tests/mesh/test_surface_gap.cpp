#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numeric>
#include <random>
#include <string>
#include <vector>

#include "mesh/predicates.h"
#include "mesh/surface_gap.h"
#include "solids.h"

namespace rayrep {
namespace {

using Eigen::Vector3d;

double to_triangle(const Vector3d& p, const Corners3& t) { return point_triangle_distance(p, t[0], t[1], t[2]); }

// Points of both triangles that far apart, and planes upright on the line between them with a triangle beyond each: then no other
// two points are nearer. Or one common point.
void expect_nearest(const Corners3& p, const Corners3& q) {
  const NearestPair pair = triangle_distance(p, q);
  const double tolerance = 1e-12 * 30;
  EXPECT_LT(to_triangle(pair.on_first, p), tolerance);
  EXPECT_LT(to_triangle(pair.on_second, q), tolerance);
  EXPECT_NEAR((pair.on_first - pair.on_second).norm(), pair.distance_mm, tolerance);
  const Vector3d across = pair.on_second - pair.on_first;
  for (std::size_t k = 0; k < 3; ++k) {
    EXPECT_LT(across.dot(p[k] - pair.on_first), 100 * tolerance);
    EXPECT_GT(across.dot(q[k] - pair.on_second), -100 * tolerance);
  }
  EXPECT_NEAR(triangle_distance(q, p).distance_mm, pair.distance_mm, tolerance);
}

// By going from each triangle to the nearest point of the other, again and again.
double by_projections(const Corners3& p, const Corners3& q) {
  Vector3d at = (p[0] + p[1] + p[2]) / 3;
  double distance = 0;
  for (int n = 0; n < 3000; ++n) {
    Vector3d there;
    point_triangle_distance(at, q[0], q[1], q[2], &there);
    distance = point_triangle_distance(there, p[0], p[1], p[2], &at);
  }
  return distance;
}

struct Random {
  std::mt19937 engine{7};
  double number() { return std::uniform_real_distribution<double>(-1, 1)(engine); }
  Vector3d point() { return {number(), number(), number()}; }
  Corners3 triangle() { return {point(), point(), point()}; }
};

TEST(TriangleDistance, OfRandomPairsIsProvenByPlanesAndEqualsItsTwin) {
  Random random;
  int crossing = 0;
  for (int n = 0; n < 2000; ++n) {
    const Corners3 p = random.triangle();
    Corners3 q = random.triangle();
    const Vector3d shift = 1.5 * random.number() * random.point();
    for (Vector3d& corner : q) corner += shift;
    expect_nearest(p, q);
    const double distance = triangle_distance(p, q).distance_mm;
    const Vector3d a[3] = {p[0], p[1], p[2]};
    const Vector3d b[3] = {q[0], q[1], q[2]};
    EXPECT_EQ(distance == 0, triangles_intersect(a, {0, 1, 2}, b, {3, 4, 5}));
    crossing += distance == 0;
    if (n % 10 == 0) {
      EXPECT_NEAR(by_projections(p, q), distance, 5e-3);
    }
  }
  EXPECT_GT(crossing, 100);
  EXPECT_LT(crossing, 1900);
}

TEST(TriangleDistance, OfParallelFlatAndDegenerateOnes) {
  Random random;
  for (int n = 0; n < 500; ++n) {
    Corners3 p = random.triangle();
    Corners3 q = random.triangle();
    for (Vector3d& corner : p) corner.z() = 0;  // parallel
    for (Vector3d& corner : q) corner.z() = n % 3 == 0 ? 0.25 : 0;
    if (n % 3 == 1)
      for (Vector3d& corner : q) corner.x() += 2.5;  // in one plane, apart
    if (n % 3 != 2) expect_nearest(p, q);
    if (n % 3 == 0) {
      EXPECT_GE(triangle_distance(p, q).distance_mm, 0.25);
    }
    q[2] = 0.3 * q[0] + 0.7 * q[1];  // a segment
    q[0].z() += 0.5;
    expect_nearest(p, {q[0], q[1], 0.5 * (q[0] + q[1])});
    expect_nearest(p, {q[0], q[0], q[0]});  // a point
    expect_nearest({p[1], p[1], p[1]}, {q[0], q[0], q[0]});
  }
}

TEST(TriangleDistance, IsZeroOnlyWhereOnePassesThroughTheOther) {
  const Corners3 face{Vector3d(0, 0, 0), Vector3d(4, 0, 0), Vector3d(0, 4, 0)};
  // A needle through the middle whose corners are all a unit away.
  const Corners3 needle{Vector3d(1, 1, -1), Vector3d(1, 1, 1), Vector3d(1.1, 1, 1)};
  EXPECT_EQ(triangle_distance(face, needle).distance_mm, 0);
  EXPECT_EQ(triangle_distance(needle, face).distance_mm, 0);
  EXPECT_LT((triangle_distance(face, needle).on_first - Vector3d(1, 1, 0)).norm(), 0.2);
  const Corners3 beside{Vector3d(-1, 1, -1), Vector3d(-1, 1, 1), Vector3d(-1.1, 1, 1)};
  EXPECT_NEAR(triangle_distance(face, beside).distance_mm, 1, 1e-15);
  // Edge to edge, at the middle of both.
  const Corners3 roof{Vector3d(2, -3, 1), Vector3d(2, 3, 1), Vector3d(2, 0, 5)};
  const Corners3 ridge{Vector3d(-1, 0, 0.25), Vector3d(5, 0, 0.25), Vector3d(2, 0, -5)};
  EXPECT_NEAR(triangle_distance(roof, ridge).distance_mm, 0.75, 1e-15);
}

struct Pair {
  Mesh mesh;
  Mesh surface;
};

std::vector<Pair> pairs() {
  Mesh dented = test::icosphere(10, 3);
  for (auto& v : dented.vertices)
    if (v.z() > 9) v.z() -= 6;
  Mesh ring = test::rotated(test::torus(5, 1, 24, 12), test::random_rotation(3));
  Mesh far = test::moved(ring, {1e5, -1e5, 1e5});
  return {{test::icosphere(8, 2), test::icosphere(10, 3)},
          {test::subdivided(test::box({-2, -2, -2}, {2, 2, 2}), 1), dented},
          {ring, test::box({-7, -7, -7}, {7, 7, 8})},
          {test::box({-5, -5, -6}, {5, 5, 5}), test::moved(test::icosphere(1, 3), {1, 0.5, 8})},  // the middle of a large face
          {far, test::moved(test::icosphere(9, 3), {1e5, -1e5, 1e5})},
          {test::icosphere(10, 2), ring}};  // cross
}

TEST(SurfaceGap, TheSmallestIsThatOfAllPairs) {
  for (const Pair& pair : pairs()) {
    double expected = HUGE_VAL;
    for (std::size_t s = 0; s < pair.mesh.triangles.size(); ++s)
      for (std::size_t t = 0; t < pair.surface.triangles.size(); ++t)
        expected = std::min(
            expected, triangle_distance(corners_of(pair.mesh, static_cast<int>(s)), corners_of(pair.surface, static_cast<int>(t)))
                          .distance_mm);
    EXPECT_NEAR(smallest_gap(pair.mesh, SurfaceQuery(pair.surface)), expected, 2e-9 * expected);
  }
  const Mesh ball = test::icosphere(1, 1);
  EXPECT_EQ(smallest_gap({}, SurfaceQuery(ball)), HUGE_VAL);
  EXPECT_EQ(smallest_gap(ball, SurfaceQuery(Mesh())), HUGE_VAL);
}

/// @param by_mm  the second half of each surface is taken to be so much farther away
void expect_gaps_are_those_of_all_pairs(double by_mm) {
  for (const Pair& pair : pairs()) {
    const auto half = static_cast<int>(pair.surface.triangles.size() / 2);
    const SurfaceQuery surface(pair.surface, {half, by_mm});
    const double limit = 1.02 * smallest_gap(pair.mesh, surface) + 0.05;
    std::vector<int> chosen;
    for (std::size_t s = 0; s < pair.mesh.triangles.size(); ++s)
      if (s % 3 != 1) chosen.push_back(static_cast<int>(s));
    std::vector<int> expected;
    std::vector<double> distances;
    for (const int s : chosen) {
      double nearest = HUGE_VAL;
      for (std::size_t t = 0; t < pair.surface.triangles.size(); ++t)
        nearest = std::min(nearest,
                           triangle_distance(corners_of(pair.mesh, s), corners_of(pair.surface, static_cast<int>(t))).distance_mm +
                               (static_cast<int>(t) < half ? 0 : by_mm));
      if (nearest >= limit) continue;
      expected.push_back(s);
      distances.push_back(nearest);
    }
    const std::vector<Gap> gaps = gaps_below(pair.mesh, chosen, surface, limit);
    ASSERT_EQ(gaps.size(), expected.size());
    EXPECT_FALSE(gaps.empty());
    for (std::size_t n = 0; n < gaps.size(); ++n) {
      EXPECT_EQ(gaps[n].triangle, expected[n]);
      EXPECT_NEAR(gaps[n].nearest.distance_mm, distances[n], 1e-9);
      EXPECT_NEAR((gaps[n].nearest.on_first - gaps[n].nearest.on_second).norm(), distances[n], 1e-9);
    }
  }
}

TEST(SurfaceGap, ThoseBelowALimitAreThoseOfAllPairs) {
  expect_gaps_are_those_of_all_pairs(0);
  expect_gaps_are_those_of_all_pairs(0.04);
}

}  // namespace
}  // namespace rayrep
