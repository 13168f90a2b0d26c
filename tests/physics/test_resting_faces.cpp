// Shares of resting faces: theory.md (71)

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numeric>

#include "rayrep/base/error.h"
#include "rayrep/physics/ground_rest.h"
#include "rayrep/physics/resting_faces.h"
#include "solids.h"

namespace rayrep {
namespace {

using namespace test;

const Eigen::Vector3d kZ = Eigen::Vector3d::UnitZ();

/// Of a hull only the corners matter.
Mesh corners(std::vector<Eigen::Vector3d> points) {
  Mesh mesh;
  mesh.vertices = std::move(points);
  mesh.triangles = {{0, 1, 2}};
  return mesh;
}

/// Of the face with that up; 0 if it does not rest so.
double share_of(const std::vector<RestingFace>& rests, const Eigen::Vector3d& up) {
  for (const RestingFace& face : rests)
    if ((face.up - up.normalized()).norm() < 1e-6) return face.share;
  return 0;
}

double sum(const std::vector<double>& shares) { return std::accumulate(shares.begin(), shares.end(), 0.0); }

/// A direction for each of `count` equal parts of the sphere.
Eigen::Vector3d spread_direction(int n, int count) {
  const double z = 1 - (2 * n + 1.0) / count;
  const double turn = 2 * kPi * n / std::numbers::phi;
  const double r = std::sqrt(1 - z * z);
  return {r * std::cos(turn), r * std::sin(turn), z};
}

Mesh random_body(Random& random, int points) {
  std::vector<Eigen::Vector3d> cloud;
  for (int k = 0; k < points; ++k) cloud.push_back(20 * random.direction() + random.in_box(5));
  return corners(std::move(cloud));
}

TEST(RestingFaces, OfABoxAreItsSolidAnglesFromTheMiddle) {
  for (const Eigen::Vector3d& half : {Eigen::Vector3d(1, 1, 1), Eigen::Vector3d(1, 2, 3), Eigen::Vector3d(5, 1, 8)}) {
    const Mesh solid = box(-half, half);
    const auto rests = Tumbler(solid).rests({0, 0, 0});
    ASSERT_EQ(rests.size(), 6u);
    for (int axis = 0; axis < 3; ++axis) {
      const double a = half[(axis + 1) % 3];
      const double b = half[(axis + 2) % 3];
      const double solid_angle = 4 * std::atan(a * b / (half[axis] * half.norm()));
      for (const double sign : {-1.0, 1.0})
        EXPECT_NEAR(share_of(rests, sign * Eigen::Vector3d::Unit(axis)), solid_angle / (4 * kPi), 1e-14);
    }
    EXPECT_NEAR(rests.front().height_mm, half.minCoeff(), 1e-12);
  }
}

TEST(RestingFaces, OfRegularSolidsAreEqual) {
  const double g = std::numbers::phi;
  std::vector<Eigen::Vector3d> dodecahedron;
  for (const double x : {-1.0, 1.0})
    for (const double y : {-1.0, 1.0}) {
      for (const double z : {-1.0, 1.0}) dodecahedron.emplace_back(x, y, z);
      dodecahedron.emplace_back(0, x / g, y * g);
      dodecahedron.emplace_back(x / g, y * g, 0);
      dodecahedron.emplace_back(x * g, 0, y / g);
    }
  const std::pair<std::size_t, Mesh> solids[] = {
      {4, corners({{1, 1, 1}, {1, -1, -1}, {-1, 1, -1}, {-1, -1, 1}})},
      {6, subdivided(box({-1, -1, -1}, {1, 1, 1}), 2)},
      {8, corners({{1, 0, 0}, {-1, 0, 0}, {0, 1, 0}, {0, -1, 0}, {0, 0, 1}, {0, 0, -1}})},
      {12, corners(dodecahedron)},
      {20, icosphere(1, 0)}};
  for (const auto& [faces, solid] : solids)
    for (std::uint64_t n = 0; n < 4; ++n) {
      const auto rests = Tumbler(rotated(solid, random_rotation(n))).rests({0, 0, 0});
      ASSERT_EQ(rests.size(), faces);
      for (const RestingFace& face : rests) EXPECT_NEAR(face.share, 1.0 / static_cast<double>(faces), 1e-9);
    }
}

TEST(RestingFaces, OfARegularPrismAreInClosedForm) {
  for (const int n : {3, 5, 6, 9})
    for (const double half_height : {0.4, 1.0, 4.0}) {
      std::vector<Eigen::Vector3d> points;
      const double r = 1;  // of the inscribed circle
      const double R = r / std::cos(kPi / n);
      for (int k = 0; k < n; ++k)
        for (const double z : {-half_height, half_height})
          points.emplace_back(R * std::cos(2 * kPi * k / n), R * std::sin(2 * kPi * k / n), z);
      const auto rests = Tumbler(corners(points)).rests({0, 0, 0});
      // The end seen from the middle is a regular spherical polygon with these angles.
      const double angle = 2 * std::acos(half_height / std::hypot(half_height, r) * std::sin(kPi / n));
      const double end = (n * angle - (n - 2) * kPi) / (4 * kPi);
      ASSERT_EQ(rests.size(), static_cast<std::size_t>(n + 2));
      EXPECT_NEAR(share_of(rests, kZ), end, 1e-12);
      EXPECT_NEAR(share_of(rests, -kZ), end, 1e-12);
      for (const RestingFace& face : rests) {
        const bool is_end = std::abs(face.up.z()) > 0.5;
        EXPECT_NEAR(face.share, is_end ? end : (1 - 2 * end) / n, 1e-12);
      }
    }
}

TEST(RestingFaces, AreWhereGroundRestEnds) {
  Random random(71);
  constexpr int kCount = 20000;
  for (int n = 0; n < 12; ++n) {
    const Mesh body = random_body(random, n < 6 ? 8 + n : 30);
    const Eigen::Vector3d centre = random.in_box(3);
    const auto rests = Tumbler(body, 0).rests(centre);
    std::vector<int> found(rests.size());
    for (int k = 0; k < kCount; ++k) {
      const GroundRest rest = ground_rest(body, centre, spread_direction(k, kCount));
      ASSERT_TRUE(rest.rests);
      std::size_t face = 0;
      while (face < rests.size() && (rests[face].up - rest.up).norm() > 1e-5) ++face;
      ASSERT_LT(face, rests.size()) << "body " << n << " rests on a face of no share";
      ++found[face];
      EXPECT_NEAR(rest.height_mm, rests[face].height_mm, 1e-4);
      EXPECT_NEAR(rest.holds_rad, rests[face].holds_rad, 1e-4);
    }
    for (std::size_t face = 0; face < rests.size(); ++face)
      EXPECT_NEAR(static_cast<double>(found[face]) / kCount, rests[face].share, 1.5e-3) << "body " << n;
  }
}

TEST(RestingFaces, TurnedMovedAndScaledAreTheSame) {
  Random random(72);
  for (std::uint64_t n = 0; n < 10; ++n) {
    const Mesh body = random_body(random, 25);
    const Eigen::Vector3d centre = random.in_box(4);
    const auto rests = Tumbler(body).rests(centre);
    Eigen::Affine3d motion = Eigen::Affine3d::Identity();
    motion.linear() = random_rotation(n);
    motion.translation() = random.in_box(100);
    for (const double scale : {0.01, 1.0, 37.0}) {
      const auto place = [&](const Eigen::Vector3d& p) { return Eigen::Vector3d(scale * (motion * p)); };
      Mesh other = body;
      for (auto& v : other.vertices) v = place(v);
      const auto again = Tumbler(other).rests(place(centre));
      ASSERT_EQ(again.size(), rests.size());
      for (std::size_t k = 0; k < rests.size(); ++k) {
        EXPECT_NEAR(share_of(again, motion.linear() * rests[k].up), rests[k].share, 1e-8);
        EXPECT_NEAR(again[k].holds_rad, rests[k].holds_rad, 1e-7);
      }
    }
  }
}

TEST(RestingFaces, SumUpToOneWhereverTheCentreIs) {
  Random random(73);
  const Tumbler ball(icosphere(10, 3), 0);
  const Tumbler shaken(icosphere(10, 3));
  for (int n = 0; n < 20; ++n) {
    const Eigen::Vector3d centre = random.in_box(5);
    EXPECT_NEAR(sum(ball.shares(centre)), 1, 1e-12);
    EXPECT_NEAR(sum(shaken.shares(centre)), 1, 1e-12);
    for (const double share : ball.shares(centre)) EXPECT_GE(share, 0);
    const Tumbler body(random_body(random, 40));
    EXPECT_NEAR(sum(body.shares(random.in_box(4))), 1, 1e-12);
  }
  EXPECT_NEAR(sum(ball.shares({0, 0, 0})), 1, 1e-12);  // nowhere it knows what to do
}

TEST(RestingFaces, AFaceNearerToTheCentreIsFallenOnMoreOften) {
  const Tumbler cube(box({-10, -10, -10}, {10, 10, 10}));
  double before = 0;
  for (double lower = 0; lower < 9.5; lower += 0.25) {
    const auto rests = cube.rests({0, 0, -lower});
    const double share = share_of(rests, kZ);
    EXPECT_GT(share, before);
    EXPECT_NEAR(share_of(rests, Eigen::Vector3d::UnitX()), share_of(rests, -Eigen::Vector3d::UnitY()), 1e-9);
    before = share;
  }
  EXPECT_GT(before, 0.45);
}

TEST(RestingFaces, ChamfersThatHardlyHoldItShareWithTheirNeighbours) {
  const auto chamfered = [](double b) {
    std::vector<Eigen::Vector3d> points;
    for (int n = 0; n < 8; ++n)
      for (int axis = 0; axis < 3; ++axis) {
        Eigen::Vector3d p(1 - b, 1 - b, 1 - b);
        p[axis] = 1;
        for (int k = 0; k < 3; ++k)
          if (n & (1 << k)) p[k] = -p[k];
        points.push_back(p);
      }
    return corners(points);
  };
  // It holds by atan(b / (2 - b)): 2.4 and 5.9 degrees.
  const auto fine = Tumbler(chamfered(0.08)).rests({0, 0, 0});
  ASSERT_EQ(fine.size(), 6u);
  for (const RestingFace& face : fine) EXPECT_NEAR(face.share, 1.0 / 6, 1e-9);
  const auto coarse = Tumbler(chamfered(0.19)).rests({0, 0, 0});
  EXPECT_EQ(coarse.size(), 18u);
  EXPECT_NEAR(share_of(coarse, {0, 1, 1}), share_of(coarse, {1, 0, -1}), 1e-9);
  const auto shaken = Tumbler(chamfered(0.19), 0.12).rests({0, 0, 0});
  EXPECT_EQ(shaken.size(), 6u);
  EXPECT_EQ(Tumbler(chamfered(0.08), 0).rests({0, 0, 0}).size(), 26u);
}

TEST(RestingFaces, WithinTenDegreesAnUpIsTheSame) {
  const auto rests = Tumbler(box({-1, -2, -3}, {1, 2, 3})).rests({0.1, 0.2, 0.3});
  const double degree = kPi / 180;
  const double share = share_of(rests, -kZ);
  EXPECT_GT(share, 0);
  EXPECT_EQ(share_with_up(rests, {0, 0, -2}), share);
  EXPECT_EQ(share_with_up(rests, {std::sin(9.9 * degree), 0, -std::cos(9.9 * degree)}), share);
  EXPECT_EQ(share_with_up(rests, {std::sin(10.1 * degree), 0, -std::cos(10.1 * degree)}), 0);
}

TEST(RestingFaces, ACentreOutsideOfTheHullIsRefused) {
  const Tumbler cube(box({-1, -1, -1}, {1, 1, 1}));
  EXPECT_THROW(cube.shares({0, 0, 1.01}), Error);
  EXPECT_THROW(cube.rests({0, 0, 1}), Error);
  EXPECT_NO_THROW(cube.shares({0.9, 0.9, 0.99}));
}

}  // namespace
}  // namespace rayrep
