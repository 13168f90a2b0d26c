#include <gtest/gtest.h>

#include <cmath>

#include "rayrep/physics/ground_rest.h"
#include "solids.h"

namespace rayrep {
namespace {

using namespace test;

const Eigen::Vector3d kZ = Eigen::Vector3d::UnitZ();

/// Up of a body that stands with z up and is tilted by so many degrees towards x, so that its foot at -x rises.
Eigen::Vector3d tilted(double degrees) {
  const double t = degrees * kPi / 180;
  return {-std::sin(t), 0, std::cos(t)};
}

double off(const Eigen::Vector3d& a, const Eigen::Vector3d& b) { return std::atan2(a.cross(b).norm(), a.dot(b)); }

TEST(GroundRest, ABoxFallsOverPastItsTippingAngle) {
  const Mesh solid = box({0, 0, 0}, {20, 24, 40});
  const Eigen::Vector3d centre(10, 12, 20);
  const double tips = std::atan2(10, 20) * 180 / kPi;
  const GroundRest upright = ground_rest(solid, centre, kZ);
  EXPECT_TRUE(upright.rests);
  EXPECT_NEAR(upright.height_mm, 20, 1e-12);
  EXPECT_NEAR(upright.holds_rad, std::atan2(10, 20), 1e-12);
  const GroundRest back = ground_rest(solid, centre, tilted(tips - 0.01));
  EXPECT_LT(off(back.up, kZ), 1e-9);
  const GroundRest over = ground_rest(solid, centre, tilted(tips + 0.01));
  EXPECT_LT(off(over.up, -Eigen::Vector3d::UnitX()), 1e-9);
  EXPECT_NEAR(over.height_mm, 10, 1e-9);
  // With its centre lower it comes back from farther.
  EXPECT_LT(off(ground_rest(solid, {10, 12, 10}, tilted(44)).up, kZ), 1e-9);
}

TEST(GroundRest, RestsOnAFaceLowerThanItWas) {
  Random random(70);
  for (int n = 0; n < 200; ++n) {
    const Eigen::Matrix3d turn = random_rotation(static_cast<std::uint64_t>(n));
    const Mesh solid = rotated(subdivided(box({-5, -8, -10}, {7, 9, 14}), 2), turn);
    const Eigen::Vector3d centre = turn * random.in_box(4);
    const Eigen::Vector3d up = random.direction();
    double lowest = 1e9;
    for (const auto& v : solid.vertices) lowest = std::min(lowest, up.dot(v));
    const GroundRest rest = ground_rest(solid, centre, up);
    ASSERT_TRUE(rest.rests);
    EXPECT_LE(rest.height_mm, up.dot(centre) - lowest + 1e-9);
    // A face of the box: along one of its axes.
    EXPECT_NEAR((turn.transpose() * rest.up).cwiseAbs().maxCoeff(), 1, 1e-9);
    EXPECT_GE(rest.holds_rad, 0);
  }
}

TEST(GroundRest, DoesNotStayBalancedOnAnEdgeOrACorner) {
  const Mesh solid = box({-1, -1, -1}, {1, 1, 1});
  for (const Eigen::Vector3d& up : {Eigen::Vector3d(1, 1, 1), Eigen::Vector3d(0, 1, 1), Eigen::Vector3d(-1, 0, 1)}) {
    const GroundRest rest = ground_rest(solid, {0, 0, 0}, up);
    EXPECT_TRUE(rest.rests);
    EXPECT_NEAR(rest.up.cwiseAbs().maxCoeff(), 1, 1e-9);
    EXPECT_NEAR(rest.holds_rad, kPi / 4, 1e-9);
  }
}

TEST(GroundRest, FacetsDoNotHoldWhatIsShaken) {
  const Mesh ball = icosphere(20, 3);
  const Eigen::Vector3d centre(0, 0, -5);
  // On its head a facet holds it.
  const GroundRest held = ground_rest(ball, centre, -kZ);
  EXPECT_GT(off(held.up, kZ), 3);
  EXPECT_GT(held.holds_rad, 0);
  EXPECT_LT(held.holds_rad, 6 * kPi / 180);
  const GroundRest shaken = ground_rest(ball, centre, -kZ, 6 * kPi / 180);
  EXPECT_TRUE(shaken.rests);
  EXPECT_LT(off(shaken.up, kZ), 6 * kPi / 180);
  EXPECT_LT(shaken.height_mm, held.height_mm);
  // What holds it by more than it is shaken does.
  EXPECT_LT(off(ground_rest(box({-1, -1, -1}, {1, 1, 1}), {0, 0, 0.5}, -kZ, 30 * kPi / 180).up, -kZ), 1e-9);
}

TEST(Righted, ABallWithALowCentreIsARolyPolyAndABoxIsNone) {
  const Mesh ball = icosphere(20, 4);
  const Righted low = righted(ball, {0, 0, -4}, kZ);
  EXPECT_TRUE(low.rests);
  EXPECT_LT(low.tilt_rad, 3 * kPi / 180);
  EXPECT_GT(righted(ball, {4, 0, 0}, kZ).tilt_rad, 80 * kPi / 180);
  EXPECT_GT(righted(ball, {0, 0, 4}, kZ).tilt_rad, 170 * kPi / 180);
  EXPECT_GT(righted(box({-1, -1, -1}, {1, 1, 1}), {0, 0, -0.8}, kZ).tilt_rad, 80 * kPi / 180);
  // Turned with its up it is the same.
  const Eigen::Matrix3d turn = random_rotation(3);
  EXPECT_LT(righted(rotated(ball, turn), turn * Eigen::Vector3d(0, 0, -4), turn * kZ).tilt_rad, 3 * kPi / 180);
}

}  // namespace
}  // namespace rayrep
