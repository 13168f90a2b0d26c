#include <gtest/gtest.h>
#include <tbb/parallel_for.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <thread>
#include <vector>

#include "mesh/surface_distance.h"
#include "solids.h"

namespace rayrep {
namespace {

using Eigen::Vector3d;

constexpr double kInfinity = std::numeric_limits<double>::infinity();

double largest(const Mesh& from, const Mesh& to) { return largest_distance(from, SurfaceQuery(to), 0, {1e-3, 1e-9}, {}); }

/// The largest distance of the points of a grid on each triangle.
double largest_by_sampling(const Mesh& from, const Mesh& to, int n) {
  const SurfaceQuery surface(to);
  double result = 0;
  for (std::size_t t = 0; t < from.triangles.size(); ++t)
    for (int i = 0; i <= n; ++i)
      for (int j = 0; i + j <= n; ++j) {
        const Vector3d p =
            (i * from.corner(t, 0) + j * from.corner(t, 1) + (n - i - j) * from.corner(t, 2)) / static_cast<double>(n);
        result = std::max(result, surface.closest(p, 1e3).distance_mm);
      }
  return result;
}

TEST(LargestDistance, IsThatOfThePointFarthestAwayInsideTrianglesToo) {
  // Of a plate between two parallel ones only the middle line is 1 away, and no corner or centre lies there.
  const Mesh plate{{{0, 0, 0}, {30, 0, 0}, {0, 40, 0}}, {{0, 1, 2}}};
  const Mesh rails{{{-50, 0, 0}, {50, 0, 0}, {0, -1, 0}, {-50, 40, 0}, {50, 40, 0}, {0, 41, 0}}, {{0, 1, 2}, {3, 4, 5}}};
  EXPECT_NEAR(largest(plate, rails), 20, 20e-3);
  // A hole leaves its corners: the inscribed circle's radius.
  const double legs = 30 + 40 - 50;
  const Mesh frame{{{0, 0, 0}, {30, 0, 0}, {0, 40, 0}, {15, 0, -9}, {15, 20, -9}, {0, 20, -9}}, {{0, 1, 3}, {1, 2, 4}, {2, 0, 5}}};
  EXPECT_NEAR(largest(plate, frame), legs / 2, 1e-3 * legs);
}

TEST(LargestDistance, OfAFaceCutOtherwiseIsNothing) {
  const Mesh cube = test::box({0, 0, 0}, {20, 20, 20});
  Mesh other = cube;  // the other diagonals
  other.triangles.clear();
  for (std::size_t n = 0; n < cube.triangles.size(); n += 2) {
    const auto& s = cube.triangles[n];
    const auto& t = cube.triangles[n + 1];
    // s = (a b c), t = (a c d) -> (a b d), (b c d)
    other.triangles.emplace_back(s[0], s[1], t[2]);
    other.triangles.emplace_back(s[1], s[2], t[2]);
  }
  for (int seed = 0; seed < 3; ++seed) {
    const Eigen::Matrix3d R = seed == 0 ? Eigen::Matrix3d::Identity() : test::random_rotation(seed);
    for (int fine = 0; fine < 4; ++fine) {
      EXPECT_LT(largest(test::rotated(test::subdivided(cube, fine), R), test::rotated(other, R)), 1e-8);
      EXPECT_LT(largest(test::rotated(other, R), test::rotated(test::subdivided(cube, fine), R)), 1e-8);
    }
  }
}

TEST(LargestDistance, IsNeverBelowWhatSamplesFindAndNotFarAbove) {
  for (std::uint64_t seed = 1; seed <= 6; ++seed) {
    test::Random random(seed);
    Mesh a = test::rotated(test::icosphere(10, 2), test::random_rotation(seed));
    Mesh b = seed % 2 ? test::uv_ellipsoid(10, 9, 11, 9) : test::box({-9, -8, -7}, {8, 9, 10});
    for (auto& v : a.vertices) v += random.in_box(0.5);
    for (auto& v : b.vertices) v += random.in_box(0.3);
    for (const auto& [from, to] : {std::pair{a, b}, std::pair{b, a}}) {
      const double found = largest(from, to);
      const double coarse = largest_by_sampling(from, to, 5);
      const double fine = largest_by_sampling(from, to, 40);
      EXPECT_LE(fine, (1 + 1.001e-3) * found);
      EXPECT_GE(fine, coarse);
      EXPECT_GE(fine, 0.97 * found) << seed;
    }
  }
}

TEST(LargestDistance, OfNothingAndFromNothing) {
  const Mesh cube = test::box({0, 0, 0}, {1, 1, 1});
  EXPECT_EQ(largest(Mesh(), cube), 0);
  EXPECT_EQ(largest(cube, Mesh()), kInfinity);
  EXPECT_EQ(largest_distance(cube, SurfaceQuery(cube), 0.25, {}, {}), 0.25);
}

/// Loops of a thread that begins with one must count with denormal numbers, as those of any other thread do.
TEST(SurfaceQueries, LeaveTheArithmeticOfLoopsAsItIs) {
  std::vector<double> halves(64, 0.0);
  std::thread([&] {
    const SurfaceQuery surface(test::icosphere(1, 3));
    volatile double least = std::numeric_limits<double>::min();
    tbb::parallel_for(std::size_t{0}, halves.size(), [&](std::size_t n) { halves[n] = least / 2; });
  }).join();
  for (const double half : halves) EXPECT_GT(half, 0);
}

}  // namespace
}  // namespace rayrep
