// When bodies collide, against what is known of spheres and boxes; certified, progressive, the same after an edit.

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <cmath>
#include <string>
#include <vector>

#include "motion_scenes.h"

namespace rayrep::test {
namespace {

using Eigen::Vector3d;
using Kind = CollisionInterval::Kind;

std::vector<CollisionInterval> intervals_of(const Scene& scene, const MotionCheckOptions& options = {}) {
  return MotionChecker().check(scene, options).pairs.at(0).intervals;
}

MotionCheckOptions finely() {
  MotionCheckOptions options;
  options.tolerance = 1e-4;
  return options;
}

/// One overlap with these ends, to 1e-4 of the transition.
void expect_overlap(const std::vector<CollisionInterval>& intervals, double from, double to) {
  ASSERT_EQ(intervals.size(), 1u);
  EXPECT_EQ(intervals[0].kind, Kind::overlap);
  EXPECT_NEAR(intervals[0].from, from, 1e-4);
  EXPECT_NEAR(intervals[0].to, to, 1e-4);
  EXPECT_LE(intervals[0].within, 1e-4);
}

Mesh cube(double half) { return box(Vector3d::Constant(-half), Vector3d::Constant(half)); }

TEST(MotionCheck, BoxesThatFlyByOverlapWhileTheirShadowsDo) {
  const Scene scene = fly_by(cube(5), cube(5), moved_by({-50, 3, 2}), moved_by({50, 3, 2}));
  expect_overlap(intervals_of(scene, finely()), 0.4, 0.6);
}

TEST(MotionCheck, WorstIsTheDeepestMomentWhereContoursAreAsLong) {
  const Mesh floor = box({-20, -20, -10}, {20, 20, 0}), foot = box({-5, -5, 0}, {5, 5, 10});
  const auto dip = intervals_of(fly_by(floor, foot, moved_by({1, 3, 20}), moved_by({1, 3, -2})));
  ASSERT_EQ(dip.size(), 1u);
  EXPECT_NEAR(dip[0].worst_time, 1, 1e-3);
  EXPECT_NEAR(dip[0].depth_mm, 2, 0.01);
  EXPECT_NEAR(dip[0].contour_length_mm, 40, 1e-9);
  // Through each other flush all around: there is no contour, and the end of one is 5 mm deep in the other halfway.
  const auto flush = intervals_of(fly_by(cube(5), cube(5), moved_by({-30, 0, 0}), moved_by({30, 0, 0})));
  ASSERT_EQ(flush.size(), 1u);
  EXPECT_GT(flush[0].depth_mm, 4);
  EXPECT_LE(flush[0].depth_mm, 5 + 1e-9);
}

TEST(MotionCheck, ShallowOverlapsAreFoundDownToWhatIsTouch) {
  const Mesh floor = box({-20, -20, -10}, {20, 20, 0});
  const Eigen::Affine3d turned(Eigen::AngleAxisd(0.3, Vector3d::UnitZ()));
  for (const Mesh& foot : {box({-10, -10, 0}, {10, 10, 10}), transformed(box({-10, -10, 0}, {10, 10, 10}), turned),
                           moved(icosphere(10, 4), {0, 0, 10})})
    for (const double depth : {0.1, 0.01, 1e-3}) {
      const auto found = intervals_of(fly_by(floor, foot, moved_by({-60, 3, -depth}), moved_by({60, 3, -depth})));
      ASSERT_EQ(found.size(), 1u) << depth;
      EXPECT_EQ(found[0].kind, Kind::overlap);
      EXPECT_LE(found[0].depth_mm, depth * (1 + 1e-9));
      EXPECT_GE(found[0].depth_mm, 0.95 * depth);
    }
}

TEST(MotionCheck, TightSlidesTakeFewLooks) {
  // A pin of 64 sides goes 30 mm down a bore of 72, askew in space.
  const Mesh pin = cylinder(10, 40, 64);
  const std::vector<Mesh> block_and_bore = {box({-20, -20, -5}, {20, 20, 35}), moved(cylinder(10.05, 60, 72), {0, 0, -10})};
  const Mesh block = combined(block_and_bore, {.operation = BooleanOperation::subtract}).mesh;
  const Eigen::Affine3d askew(Draw(3).rotation());
  const Vector3d way = askew * Vector3d(0, 0, 30);
  const Scene scene = fly_by(transformed(block, askew), transformed(pin, askew), moved_by(way), moved_by({0, 0, 0}));
  MotionCheckOptions near;
  near.clearance_mm = 0.03;
  for (const MotionCheckOptions& options : {MotionCheckOptions{}, near}) {
    const MotionReport report = MotionChecker().check(scene, options);
    EXPECT_TRUE(report.pairs.at(0).intervals.empty());
    EXPECT_LT(report.moments, 40u);
  }
  near.clearance_mm = 0.06;
  const Scene resting = fly_by(transformed(block, askew), transformed(pin, askew), {}, {});
  EXPECT_FALSE(MotionChecker().check(resting, near).free());
}

TEST(MotionCheck, SpheresThatFlyByOverlapWhileTheirCentresAreNear) {
  const Mesh sphere = icosphere(10, 5);
  const double half = std::sqrt(20.0 * 20 - 12 * 12) / 100;
  expect_overlap(intervals_of(fly_by(sphere, sphere, moved_by({-50, 12, 0}), moved_by({50, 12, 0})), finely()), 0.5 - half,
                 0.5 + half);
}

TEST(MotionCheck, ABarThatTurnsHitsAWallWithItsCorners) {
  const Mesh wall = box({19, -100, -5}, {30, 100, 5}), bar = box({-20, -1, -2}, {20, 1, 2});
  Scene scene = fly_by(wall, bar, {}, {});
  Motion& turn = scene.transitions[0].motions[1];
  turn.rotation.clear();
  for (int n = 0; n <= 4; ++n)
    turn.rotation.push_back({n / 4.0, Eigen::Quaterniond(Eigen::AngleAxisd((n / 4.0 - 0.5) * kPi, Vector3d::UnitZ()))});
  const double angle = std::atan2(1, 20) + std::acos(19 / std::hypot(20, 1));
  expect_overlap(intervals_of(scene, finely()), 0.5 - angle / kPi, 0.5 + angle / kPi);
}

TEST(MotionCheck, APartTurnsAboutItsPivot) {
  // The same bar about its end, which is elsewhere in its mesh.
  const Mesh wall = box({70, -100, -5}, {81, 100, 5}), bar = box({100, -1, -2}, {120, 1, 2});
  Scene scene = fly_by(wall, bar, {}, {});
  scene.parts[1].pivot_mm = {100, 0, 0};
  Motion& turn = scene.transitions[0].motions[1];
  turn.rotation.clear();
  for (int n = 0; n <= 4; ++n)
    turn.rotation.push_back({n / 4.0, Eigen::Quaterniond(Eigen::AngleAxisd((n / 4.0 + 0.5) * kPi, Vector3d::UnitZ()))});
  const double angle = std::atan2(1, 20) + std::acos(19 / std::hypot(20, 1));
  expect_overlap(intervals_of(scene, finely()), 0.5 - angle / kPi, 0.5 + angle / kPi);
}

TEST(MotionCheck, ABodyInsideAnotherOverlapsThoughNoSurfacesCross) {
  const auto inside = intervals_of(fly_by(cube(20), cube(2), moved_by({-5, 0, 0}), moved_by({5, 0, 0})));
  ASSERT_EQ(inside.size(), 1u);
  EXPECT_EQ(inside[0].kind, Kind::overlap);
  EXPECT_EQ(inside[0].from, 0);
  EXPECT_EQ(inside[0].to, 1);
  EXPECT_EQ(inside[0].contour_length_mm, 0);
  EXPECT_GT(inside[0].depth_mm, 10);
  const Mesh room = hollow(cube(20), cube(15));
  EXPECT_TRUE(intervals_of(fly_by(room, cube(2), moved_by({-5, 0, 0}), moved_by({5, 0, 0}))).empty());
  EXPECT_EQ(intervals_of(fly_by(room, cube(2), moved_by({-5, 0, 0}), moved_by({15, 0, 0}))).at(0).kind, Kind::overlap);
  // A part of several bodies of which one is inside.
  const Mesh two = merged({cube(2), moved(cube(2), {100, 0, 0})});
  EXPECT_EQ(intervals_of(fly_by(cube(20), two, {}, {})).at(0).kind, Kind::overlap);
}

TEST(MotionCheck, BodiesInTheVerySamePlaceOverlap) {
  const auto same = intervals_of(fly_by(cube(5), cube(5), {}, {}));
  ASSERT_EQ(same.size(), 1u);
  EXPECT_EQ(same[0].kind, Kind::overlap);
  EXPECT_GT(same[0].depth_mm, 1);
}

TEST(MotionCheck, BodiesThatCrossLikeAPlusOverlap) {
  const auto plus = intervals_of(
      fly_by(box({-10, -1, -1}, {10, 1, 1}), box({-1, -10, -1}, {1, 10, 1}), moved_by({0, 0, -10}), moved_by({0, 0, 10})),
      finely());
  expect_overlap(plus, 0.4, 0.6);
}

TEST(MotionCheck, WhatSlidesOnAnotherTouchesIt) {
  const Scene scene =
      fly_by(box({-50, -50, -5}, {50, 50, 0}), box({-5, -5, 0}, {5, 5, 10}), moved_by({-20, 0, 0}), moved_by({20, 0, 0}));
  MotionCheckOptions options;
  options.tolerance = 1e-2;
  const MotionReport report = MotionChecker().check(scene, options);
  ASSERT_EQ(report.pairs[0].intervals.size(), 1u);
  EXPECT_EQ(report.pairs[0].intervals[0].kind, Kind::contact);
  EXPECT_TRUE(report.free());
  // At rest on it, one look is enough.
  const MotionReport rest = MotionChecker().check(fly_by(box({-50, -50, -5}, {50, 50, 0}), box({-5, -5, 0}, {5, 5, 10}), {}, {}));
  EXPECT_EQ(rest.pairs[0].intervals.at(0).kind, Kind::contact);
  EXPECT_EQ(rest.moments, 1u);
}

TEST(MotionCheck, PartsThatMoveAsOneAreLookedAtOnce) {
  Draw draw(3);
  Scene scene = fly_by(cube(5), cube(5), {}, {});
  scene.transitions[0].motions[0] = scene.transitions[0].motions[1] = draw_motion(draw);
  scene.parts[1].mesh = std::make_shared<const Mesh>(moved(cube(5), {20, 0, 0}));
  const MotionReport report = MotionChecker().check(scene);
  EXPECT_TRUE(report.free());
  EXPECT_LE(report.moments, 1u);
}

TEST(MotionCheck, AClearanceIsKept) {
  // Two cubes whose faces pass at 2 mm: they are nearer than c while their edges are.
  const Scene scene = fly_by(cube(5), cube(5), moved_by({-50, 12, 0}), moved_by({50, 12, 0}));
  MotionCheckOptions options = finely();
  options.clearance_mm = 1.9;
  EXPECT_TRUE(intervals_of(scene, options).empty());
  options.clearance_mm = 2.5;
  expect_overlap(intervals_of(scene, options), 0.4 - 0.015, 0.6 + 0.015);
  Scene hinged = scene;
  hinged.pairs = {{0, 1, 1.0}};
  EXPECT_TRUE(intervals_of(hinged, options).empty()) << "a clearance of its own goes before";
  hinged.pairs = {{1, 0, {}}};
  EXPECT_TRUE(MotionChecker().check(hinged, options).pairs.empty()) << "what may touch is not tested";
}

TEST(MotionCheck, AContourSweepsTheSurfaceOfTheIntersection) {
  // A sphere through a plane: the contours are circles, and sweep pi^2 r^2 over the speed.
  const Scene scene = fly_by(box({-50, -50, -100}, {50, 50, 0}), icosphere(10, 4), moved_by({0, 0, 40}), moved_by({0, 0, -40}));
  const auto intervals = intervals_of(scene);
  ASSERT_EQ(intervals.size(), 1u);
  const double over_plane = 0.625;  // after that the sphere is inside
  EXPECT_NEAR(intervals[0].from, 0.375, 1e-3);
  EXPECT_EQ(intervals[0].to, 1);
  EXPECT_NEAR(intervals[0].contour_length_mm, 2 * kPi * 10, 1) << "half of it in: the longest";
  EXPECT_NEAR(intervals[0].worst_time, 0.5, 0.05);
  EXPECT_LT(intervals[0].worst_box_mm.sizes().z(), 1e-6);
  EXPECT_GT(intervals[0].intersection_mm, 0);
  // Stopped where it is just inside, the whole of it by the rule for what grows like a root at both ends.
  Scene through = scene;
  through.transitions[0].motions[1] = straight_motion(moved_by({0, 0, 40}), moved_by({0, 0, 40 - 80 * over_plane}));
  EXPECT_NEAR(intervals_of(through).at(0).intersection_mm, kPi * kPi * 100 / (80 * over_plane), 0.1);
}

/// By construction some overlap, some come near, some are clear. tests/oracles/motion_sampling.cpp does the same for many more.
TEST(MotionCheck, RandomScenesMissNothingThatSamplesFind) {
  for (const Turning turning : {Turning::freely, Turning::alike, Turning::never}) {
    std::size_t overlapping = 0, intervals = 0;
    for (unsigned seed = 0; seed < 20; ++seed) {
      const SampledScene found = sample_scene(seed, 2000, 1e-3, turning);
      EXPECT_EQ(found.wrong, "");
      overlapping += found.overlapping;
      intervals += found.intervals;
    }
    EXPECT_GT(overlapping, 1000u);
    EXPECT_GT(intervals, 5u);
  }
}

Scene crowd(unsigned seed, int parts) {
  Draw draw(seed);
  Scene scene;
  scene.transitions = {{"way", 0, 0, {}}};
  for (int n = 0; n < parts; ++n) {
    scene.parts.push_back(scene_part("part " + std::to_string(n), mesh_of(draw_boxes(draw))));
    scene.transitions[0].motions.push_back(draw_motion(draw));
  }
  return scene;
}

void expect_same(const MotionReport& a, const MotionReport& b) {
  ASSERT_EQ(a.pairs.size(), b.pairs.size());
  for (std::size_t n = 0; n < a.pairs.size(); ++n) {
    ASSERT_EQ(a.pairs[n].intervals.size(), b.pairs[n].intervals.size());
    for (std::size_t k = 0; k < a.pairs[n].intervals.size(); ++k) {
      const CollisionInterval &i = a.pairs[n].intervals[k], &j = b.pairs[n].intervals[k];
      EXPECT_EQ(i.kind, j.kind);
      EXPECT_EQ(i.from, j.from);
      EXPECT_EQ(i.to, j.to);
      EXPECT_EQ(i.depth_mm, j.depth_mm);
      EXPECT_EQ(i.intersection_mm, j.intersection_mm);
    }
  }
}

TEST(MotionCheck, AfterAnEditOnlyWhatItTouchesIsLookedAtAgain) {
  Scene scene = crowd(7, 6);
  MotionChecker checker;
  EXPECT_EQ(checker.check(scene).kept, 0u);
  const MotionReport again = checker.check(scene);
  EXPECT_EQ(again.kept, 15u);
  EXPECT_EQ(again.moments, 0u);
  scene.transitions[0].motions[2].translation[1].at_mm += Vector3d(1, 2, 3);
  const MotionReport edited = checker.check(scene);
  EXPECT_EQ(edited.kept, 10u);
  expect_same(edited, MotionChecker().check(scene));
}

TEST(MotionCheck, TheAnswerDoesNotDependOnThreads) {
  const Scene scene = crowd(8, 5);
  const MotionReport many = MotionChecker().check(scene);
  const tbb::global_control one(tbb::global_control::max_allowed_parallelism, 1);
  expect_same(many, MotionChecker().check(scene));
}

TEST(MotionCheck, AnswersOnlyBecomeSharper) {
  const Scene scene = crowd(9, 5);
  std::vector<MotionReport> told;
  MotionCheckOptions options;
  options.found = [&told](const MotionReport& report) { told.push_back(report); };
  const MotionReport last = MotionChecker().check(scene, options);
  ASSERT_GE(told.size(), 4u);
  EXPECT_EQ(told.front().stage, MotionReport::Stage::coarse);
  EXPECT_EQ(told.back().stage, MotionReport::Stage::complete);
  expect_same(told.back(), last);
  const auto is_clear = [](const PairMotion& pair, double time) {
    return std::none_of(pair.intervals.begin(), pair.intervals.end(),
                        [time](const auto& i) { return i.from - i.within <= time && time <= i.to + i.within; });
  };
  std::vector<std::size_t> clear(told.size());
  for (std::size_t n = 0; n < told.size(); ++n)
    for (std::size_t p = 0; p < told[n].pairs.size(); ++p)
      for (int k = 0; k <= 1000; ++k) {
        const bool now = is_clear(told[n].pairs[p], k / 1000.0);
        clear[n] += now;
        if (n > 0 && is_clear(told[n - 1].pairs[p], k / 1000.0)) {
          EXPECT_TRUE(now) << "nothing is taken back";
        }
      }
  EXPECT_GT(clear.back(), clear.front());
}

TEST(MotionCheck, CanBeCancelled) {
  Progress progress;
  progress.cancelled = [] { return true; };
  MotionChecker checker;
  const Scene scene = crowd(8, 3);
  EXPECT_THROW(checker.check(scene, {}, progress), Error);
  expect_same(checker.check(scene), MotionChecker().check(scene));
}

TEST(MotionCheck, RefusesAToleranceThatMakesNoSense) {
  MotionCheckOptions options;
  for (const double tolerance : {0.0, -1.0, 0.6, std::nan("")}) {
    options.tolerance = tolerance;
    EXPECT_THROW(MotionChecker().check(Scene{}, options), Error);
  }
}

}  // namespace
}  // namespace rayrep::test
