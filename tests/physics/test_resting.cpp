#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "rayrep/mesh/mesh.h"
#include "rayrep/physics/moments.h"
#include "rayrep/physics/resting.h"
#include "solids.h"

namespace rayrep::test {
namespace {

using Eigen::Vector3d;

/// Height of the centre above the ground.
double height(const std::vector<Vector3d>& points, const Vector3d& centre, const Vector3d& up) {
  double lowest = std::numeric_limits<double>::infinity();
  for (const Vector3d& p : points) lowest = std::min(lowest, up.dot(p));
  return up.dot(centre) - lowest;
}

TEST(Resting, ABoxFallsOnTheFaceItLeansTo) {
  const Mesh body = box({0, 0, 0}, {10, 20, 40});
  const Vector3d centre(5, 10, 20);
  // Within the stable cone of each face it comes back to it.
  for (int axis = 0; axis < 3; ++axis)
    for (const double sign : {1.0, -1.0})
      for (std::uint64_t seed = 0; seed < 20; ++seed) {
        const Vector3d up = sign * Vector3d::Unit(axis);
        const Vector3d aside = up.cross(random_rotation(seed).col(0)).normalized();
        const double least = std::atan2(0.5 * std::min(axis == 0 ? 20 : 10, axis == 2 ? 20 : 40), axis == 0   ? 5
                                                                                                  : axis == 1 ? 10
                                                                                                              : 20);
        const double tilt = 0.9 * least;
        const auto rest = rest_attitude(body.vertices, centre, std::cos(tilt) * up + std::sin(tilt) * aside);
        ASSERT_TRUE(rest);
        EXPECT_NEAR((*rest - up).norm(), 0, 1e-12) << axis << " " << sign << " " << seed;
      }
  // Past it, it falls on the next.
  const double tilt = std::atan2(5.0, 20.0) + 0.01;
  const auto rest = rest_attitude(body.vertices, centre, Vector3d(std::sin(tilt), 1e-3, std::cos(tilt)).normalized());
  ASSERT_TRUE(rest);
  EXPECT_NEAR((*rest - Vector3d::UnitX()).norm(), 0, 1e-12);
}

TEST(Resting, EndsWhereNoSmallTurnLowersIt) {
  const Mesh bodies[] = {icosphere(10, 2), torus(10, 3, 24, 12), staircase(5, 3), cone(8, 12, 17), uv_ellipsoid(10, 12, 15, 12)};
  for (const Mesh& body : bodies) {
    const Vector3d centre = mesh_moments(body).segment<3>(MX) / mesh_moments(body)[M1];
    for (std::uint64_t seed = 0; seed < 40; ++seed) {
      const Vector3d start = random_rotation(seed).col(1);
      const Vector3d off = centre + 0.2 * random_rotation(seed + 1000).col(0);
      const auto rest = rest_attitude(body.vertices, off, start);
      ASSERT_TRUE(rest) << seed;
      const double there = height(body.vertices, off, *rest);
      EXPECT_LE(there, height(body.vertices, off, start) + 1e-9);
      for (std::uint64_t k = 0; k < 12; ++k) {
        const Vector3d near = (*rest + 1e-5 * random_rotation(k).col(2)).normalized();
        EXPECT_GE(height(body.vertices, off, near), there - 1e-9);
      }
    }
  }
}

TEST(Resting, ABallWithAHeavySideIsARolyPoly) {
  const Mesh body = icosphere(10, 4);
  for (std::uint64_t seed = 0; seed < 50; ++seed) {
    const Vector3d down = random_rotation(seed + 500).col(2);
    const auto rest = rest_attitude(body.vertices, 3 * down, random_rotation(seed).col(0));
    ASSERT_TRUE(rest);
    // As near to upright as its facets let it: with h = 3 of 10 a facet of half-angle a holds it up to 10 a / 3.
    EXPECT_LT((*rest + down).norm(), 0.15);
  }
}

}  // namespace
}  // namespace rayrep::test
