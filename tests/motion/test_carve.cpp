// Room for the way of one part through another: never too small, not much too large, and free afterwards.

#include <gtest/gtest.h>

#include <cmath>
#include <memory>

#include "motion/sweep.h"
#include "motion_scenes.h"
#include "rayrep/motion/carve.h"

namespace rayrep::test {
namespace {

using Eigen::Vector3d;

/// A ball of 10 mm that comes down into a block and stops in it.
Scene ball_into_block() {
  return fly_by(box({-20, -20, 0}, {20, 20, 40}), icosphere(10, 4), moved_by({0, 0, 60}), moved_by({0, 0, 20}));
}

/// The room of a ball with this radius: a hemisphere and a cylinder up to the block's top.
double room_of(double radius) { return 2.0 / 3 * kPi * std::pow(radius, 3) + kPi * radius * radius * 20; }

bool is_free(Scene scene, const Mesh& carved, double clearance_mm) {
  scene.parts[0].mesh = std::make_shared<const Mesh>(carved);
  MotionCheckOptions options;
  options.clearance_mm = clearance_mm;
  return MotionChecker().check(scene, options).free();
}

TEST(Carve, ABallLeavesRoomForItself) {
  const Scene scene = ball_into_block();
  double before = 1e9;
  for (const double tolerance : {2.0, 1.0}) {
    const Carving carving = carve(scene, 0, 1, {.clearance_mm = 0.5, .tolerance_mm = tolerance});
    EXPECT_TRUE(is_closed_solid(carving.left));
    EXPECT_GE(carving.at_least_mm, 0.5);
    EXPECT_LE(carving.at_most_mm, 0.5 + 1.1 * tolerance);
    EXPECT_GE(carving.removed_mm3, room_of(10.45));  // the facets of the ball are within 0.05 mm of it
    EXPECT_LE(carving.removed_mm3, room_of(10 + carving.at_most_mm));
    EXPECT_LT(carving.removed_mm3, before) << "a smaller tolerance takes less";
    EXPECT_EQ(carving.bodies, 1u);
    EXPECT_TRUE(is_free(scene, carving.left, 0.5));
    before = carving.removed_mm3;
    // What is far away keeps its corners.
    for (const Vector3d& corner : scene.parts[0].mesh->vertices)
      EXPECT_NE(std::find(carving.left.vertices.begin(), carving.left.vertices.end(), corner), carving.left.vertices.end());
  }
}

TEST(Carve, AWayRoundALittleCornerIsTakenAsItIsSeen) {
  // Both move and turn; the part that is carved is not at rest.
  Draw draw(11);
  Scene scene = fly_by(box({-15, -15, -5}, {15, 15, 5}), box({-4, -3, -2}, {4, 3, 2}), {}, {});
  scene.states.clear();
  scene.parts[1].pivot_mm = {6, 0, 0};
  scene.transitions[0].motions[0] =
      straight_motion({}, moved_by({5, 3, 1}, Eigen::Quaterniond(Eigen::AngleAxisd(0.5, Vector3d::UnitZ()))));
  scene.transitions[0].motions[1] = straight_motion(
      moved_by({-20, 0, 10}), moved_by({20, 2, -3}, Eigen::Quaterniond(Eigen::AngleAxisd(2, Vector3d(1, 2, 3).normalized()))));
  EXPECT_FALSE(is_free(scene, *scene.parts[0].mesh, 0));
  const Carving carving = carve(scene, 0, 1, {.clearance_mm = 0.3, .tolerance_mm = 1});
  EXPECT_TRUE(is_closed_solid(carving.left));
  EXPECT_TRUE(is_free(scene, carving.left, 0.3));
}

TEST(Carve, WithoutAClearanceTheyMayTouch) {
  const Scene scene = ball_into_block();
  const Carving carving = carve(scene, 0, 1, {.clearance_mm = 0, .tolerance_mm = 1.5});
  EXPECT_GE(carving.at_least_mm, 0);
  EXPECT_LE(carving.at_most_mm, 1.6);
  EXPECT_TRUE(is_free(scene, carving.left, 0));
}

TEST(Carve, WhatNeverComesNearTakesNothing) {
  Scene scene = fly_by(cylinder(5, 10, 24), icosphere(3, 2), moved_by({50, 0, 0}), moved_by({50, 0, 50}));
  const Carving carving = carve(scene, 0, 1);
  EXPECT_EQ(carving.removed_mm3, 0);
  EXPECT_EQ(carving.left.triangles.size(), scene.parts[0].mesh->triangles.size());
}

TEST(Carve, WhatGoesThroughAllLeavesTwoBodiesOrNothing) {
  const Mesh bar = box({-20, -2, -2}, {20, 2, 2}), plate = box({-1, -10, -10}, {1, 10, 10});
  const Carving two =
      carve(fly_by(bar, plate, moved_by({0, 0, 30}), moved_by({0, 0, 0})), 0, 1, {.clearance_mm = 0.5, .tolerance_mm = 1});
  EXPECT_EQ(two.bodies, 2u);
  const Carving none =
      carve(fly_by(cylinder(2, 3, 24), box({-9, -9, -9}, {9, 9, 9}), {}, {}), 0, 1, {.clearance_mm = 0.5, .tolerance_mm = 1});
  EXPECT_EQ(none.bodies, 0u);
}

TEST(Carve, RefusesWhatMakesNoSense) {
  const Scene scene = ball_into_block();
  message_of([&] { carve(scene, 1, 1); }, ErrorCode::usage);
  message_of([&] { carve(scene, 0, 1, {.clearance_mm = -1}); }, ErrorCode::usage);
  message_of([&] { carve(scene, 0, 1, {.clearance_mm = 0, .tolerance_mm = 1e-7}); }, ErrorCode::goal);
}

TEST(Sweeps, DistancesAreTheLeastOfAllMoments) {
  Draw draw(21);
  for (int n = 0; n < 5; ++n) {
    Scene scene = fly_by(icosphere(5, 1), mesh_of(draw_boxes(draw)), {}, {});
    scene.states.clear();
    scene.transitions[0].motions = {draw_motion(draw), draw_motion(draw)};
    scene.parts[0].pivot_mm = draw.vector(4);
    scene.parts[1].pivot_mm = draw.vector(4);
    const Eigen::AlignedBox3d asked(Vector3d::Constant(-10), Vector3d::Constant(10));
    const Sweep sweep(scene, 0, 1, asked, 0.02);
    const SurfaceQuery surface(*scene.parts[1].mesh);
    for (int k = 0; k < 20; ++k) {
      const Vector3d p = draw.vector(10);
      double least = 1e9;
      for (int t = 0; t <= 4000; ++t) {
        const auto at = [&](std::size_t part) {
          return scene.transitions[0].motions[part].at(t / 4000.0).about(scene.parts[part].pivot_mm);
        };
        least = std::min(least, surface.closest(at(1).inverse() * (at(0) * p), 1e9).distance_mm);
      }
      std::size_t hint = 0;
      const double found = sweep.distance_mm(p, -1e9, 1e9, hint);
      if (found > 0)
        EXPECT_NEAR(found, least, 0.1) << "samples are up to 0.1 mm off";
      else
        EXPECT_LT(least, 12) << "it is in the body, or crosses its surface";
      std::size_t other = 0;
      if (found > 1) {
        EXPECT_EQ(sweep.distance_mm(p, -1e9, found / 2, other), found / 2);
      }
    }
  }
}

}  // namespace
}  // namespace rayrep::test
