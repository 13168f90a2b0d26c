// Out of each other's way: derivatives against differences, what hints promise, what descent leaves.

#include <gtest/gtest.h>

#include <cmath>

#include "motion/proximity.h"
#include "motion_scenes.h"
#include "rayrep/motion/resolve.h"

namespace rayrep::test {
namespace {

using Eigen::Vector3d;
using Kind = Freedom::Kind;

/// A body that moves and turns through another one that moves, both over keys on the way.
Scene tangle() {
  Draw draw(4);
  Scene scene = fly_by(icosphere(10, 2), uv_ellipsoid(6, 9, 4, 16), {}, {});
  scene.states.clear();
  Motion& first = scene.transitions[0].motions[0];
  Motion& second = scene.transitions[0].motions[1];
  first.translation = {
      {0, {0, 0, 0}, {0, 0, 0}, {2, 1, 0}}, {0.4, {3, 2, 1}, {2, 2, 0}, {4, 2, 2}}, {1, {5, 1, 0}, {5, 2, 1}, {5, 1, 0}}};
  first.rotation = {{0, draw.rotation()}, {0.6, draw.rotation()}, {1, draw.rotation()}};
  second.translation = {{0, {-40, 12, 3}, {0, 0, 0}, {-20, 12, 3}},
                        {0.5, {2, 11, 4}, {-10, 12, 4}, {10, 10, 4}},
                        {1, {40, 9, 3}, {20, 9, 3}, {0, 0, 0}}};
  second.rotation = {{0, draw.rotation()}, {0.45, draw.rotation()}, {1, draw.rotation()}};
  scene.parts[1].pivot_mm = {0.5, 0.4, -0.6};
  return scene;
}

/// (112) by the moments of slope, over a fixed interval.
double swept_contour(const Scene& scene, const CollisionInterval& overlap) {
  const auto prepared = [&](std::size_t part) {
    SolidBody body(scene.parts[part].mesh);
    body.prepare();
    return body;
  };
  const SolidBody first = prepared(0), second = prepared(1);
  constexpr int kMoments = 12;
  const double half = (overlap.to - overlap.from) / 2, centre = (overlap.to + overlap.from) / 2;
  double sum = 0;
  for (int n = 1; n <= kMoments; ++n) {
    const double angle = kPi * n / (kMoments + 1);
    const auto at = [&](std::size_t part) {
      return scene.transitions[0].motions[part].at(centre - half * std::cos(angle)).about(scene.parts[part].pivot_mm);
    };
    for (const ContourPiece& piece : contour(first, second, at(0).inverse() * at(1)))
      sum += half * kPi / (kMoments + 1) * std::sin(angle) * piece.length_mm();
  }
  return sum;
}

TEST(Resolve, SlopesAreThoseOfDifferences) {
  const Scene scene = tangle();
  const PairMotion pair = MotionChecker().check(scene).pairs.at(0);
  ASSERT_FALSE(pair.intervals.empty());
  CollisionInterval inner = pair.intervals[0];
  ASSERT_EQ(inner.kind, CollisionInterval::Kind::overlap);
  // A little inside, so that a step of the difference leaves no moment without a contour.
  const double length = inner.to - inner.from;
  inner.from += 0.1 * length;
  inner.to -= 0.1 * length;
  int nonzero = 0;
  for (const Freedom& freedom : freedoms_of(scene)) {
    const Vector3d found = slope(scene, pair, inner, freedom);
    for (int axis = 0; axis < freedom.size(); ++axis) {
      const bool in_mm = freedom.kind == Kind::translation || freedom.kind == Kind::rest;
      const double step = in_mm ? 1e-6 : 1e-7;
      const double more = swept_contour(moved_by(scene, freedom, step * Vector3d::Unit(axis)), inner);
      const double less = swept_contour(moved_by(scene, freedom, -step * Vector3d::Unit(axis)), inner);
      const double expected = (more - less) / (2 * step);
      EXPECT_NEAR(found[axis], expected, 2e-4 * (1 + std::abs(expected))) << words_of(scene, freedom) << ", axis " << axis;
      nonzero += std::abs(expected) > 1e-3;
    }
  }
  EXPECT_GT(nonzero, 10);
}

TEST(Resolve, ForceAndCounterforceAreEqual) {
  const Scene scene = tangle();
  const PairMotion pair = MotionChecker().check(scene).pairs.at(0);
  const Vector3d first = slope(scene, pair, pair.intervals.at(0), {Kind::rest, 0, 0, 0});
  const Vector3d second = slope(scene, pair, pair.intervals.at(0), {Kind::rest, 1, 0, 0});
  EXPECT_LT((first + second).norm(), 1e-9 * (1 + first.norm()));
}

TEST(Resolve, KeysInTheMiddleChangeNoMotion) {
  Scene scene = fly_by(icosphere(2, 1), icosphere(2, 1), moved_by({-9, 0, 0}), moved_by({9, 3, 1}));
  scene.transitions[0].motions[1].translation[0].out_mm = {-9, 20, 5};
  const Scene more = with_middle_keys(scene);
  EXPECT_EQ(more.transitions[0].motions[0].translation.size(), 2u) << "it is at rest";
  ASSERT_EQ(more.transitions[0].motions[1].translation.size(), 3u);
  for (int n = 0; n <= 20; ++n)
    EXPECT_LT(
        (more.transitions[0].motions[1].at(n / 20.0).translation_mm - scene.transitions[0].motions[1].at(n / 20.0).translation_mm)
            .norm(),
        1e-12);
}

TEST(Resolve, ABallGoesRoundWhatItGrazed) {
  const Scene scene = fly_by(icosphere(10, 2), icosphere(10, 2), moved_by({-50, 14, 0}), moved_by({50, 14, 0}));
  const Resolved resolved = resolve(scene);
  EXPECT_TRUE(resolved.report.free());
  EXPECT_GE(resolved.steps, 1);
  EXPECT_TRUE(MotionChecker().check(resolved.scene).free());
}

TEST(Resolve, HintsKeepWhatTheyPromise) {
  const Scene scene = fly_by(icosphere(10, 2), icosphere(10, 2), moved_by({-50, 14, 0}), moved_by({50, 14, 0}));
  const std::vector<Hint> all = hints(scene);
  ASSERT_FALSE(all.empty());
  EXPECT_TRUE(all[0].frees);
  for (const Hint& hint : all) {
    const MotionReport after = MotionChecker().check(moved_by(with_middle_keys(scene), hint.freedom, hint.amount));
    EXPECT_EQ(!after.pairs.at(0).overlaps(), hint.frees) << words_of(with_middle_keys(scene), hint.freedom);
    EXPECT_LT(hint.after_mm, hint.before_mm);
  }
}

TEST(Resolve, WhatWasFreeStaysFree) {
  // A ball between a post that it hits and a wall that it must not.
  Scene scene = fly_by(icosphere(10, 2), icosphere(5, 2), moved_by({-50, 12, 0}), moved_by({50, 12, 0}));
  scene.parts.push_back(scene_part("wall", box({-60, 18, -60}, {60, 20, 60})));
  for (SceneState& state : scene.states) state.poses.emplace_back();
  scene.transitions[0].motions.push_back(straight_motion({}, {}));
  EXPECT_FALSE(MotionChecker().check(scene).free());
  const Resolved resolved = resolve(scene);
  for (const PairMotion& pair : resolved.report.pairs)
    if (pair.second == 2) {
      EXPECT_FALSE(pair.overlaps());
    }
  EXPECT_LE(resolved.report.pairs[0].intervals.empty() ? 0 : resolved.report.pairs[0].intervals[0].intersection_mm,
            MotionChecker().check(scene).pairs[0].intervals[0].intersection_mm);
}

TEST(Resolve, WhatMayNotBeMovedStaysAndIsTold) {
  const Scene scene = fly_by(icosphere(10, 2), icosphere(10, 2), moved_by({-50, 14, 0}), moved_by({50, 14, 0}));
  ResolveOptions options;
  options.parts = {"first"};
  const Resolved resolved = resolve(scene, options);
  EXPECT_EQ(resolved.scene.transitions[0].motions[1].at(0.5).translation_mm, Vector3d(0, 14, 0));
  options.parts = {"nobody"};
  EXPECT_TRUE(mentions(message_of([&] { resolve(scene, options); }, ErrorCode::input), {"nobody", "first, second"}));
}

}  // namespace
}  // namespace rayrep::test
