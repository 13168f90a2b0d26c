// Distances, depths and contours of two bodies, and how far motions take them, against brute force and known shapes.

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "motion/proximity.h"
#include "motion/travel.h"
#include "motion_scenes.h"

namespace rayrep::test {
namespace {

using Eigen::Isometry3d;
using Eigen::Vector3d;

constexpr double kInfinite = std::numeric_limits<double>::infinity();

SolidBody prepared(Mesh mesh) {
  SolidBody body(std::make_shared<const Mesh>(std::move(mesh)));
  body.prepare();
  return body;
}

Isometry3d place(const Vector3d& p) { return Isometry3d(Eigen::Translation3d(p)); }

TEST(Proximity, DistancesAreThoseOfAllTriangles) {
  const SolidBody first = prepared(icosphere(5, 2)), second = prepared(torus(8, 2, 16, 8));
  Draw draw(1);
  for (int n = 0; n < 20; ++n) {
    const Isometry3d pose = Eigen::Translation3d(draw.vector(25)) * draw.rotation();
    double least = kInfinite;
    for (std::size_t s = 0; s < first.mesh().triangles.size(); ++s)
      for (std::size_t t = 0; t < second.mesh().triangles.size(); ++t) {
        Corners3 corners = corners_of(second.mesh(), static_cast<int>(t));
        for (Vector3d& c : corners) c = pose * c;
        least = std::min(least, triangle_distance(corners_of(first.mesh(), static_cast<int>(s)), corners).distance_mm);
      }
    const Nearness found = nearness(first, second, pose, kInfinite);
    EXPECT_LE(found.at_least_mm, least * (1 + 1e-12));
    EXPECT_GE(found.at_most_mm, least * (1 - 1e-12));
    EXPECT_LE(found.at_most_mm, kLoose * found.at_least_mm * (1 + 1e-12));
    EXPECT_NEAR(nearness(first, second, pose, kInfinite, 1 + 1e-9).at_most_mm, least, 1e-8 * (1 + least));
    EXPECT_EQ(nearness(first, second, pose, least / 2).at_least_mm, least / 2) << "no more than was asked";
    EXPECT_LE(apart_by_boxes(first, second, pose), least * (1 + 1e-12));
  }
}

TEST(Proximity, WhatKeepsApartDoesSoWhereverItIsMoved) {
  Draw draw(6);
  int kept = 0;
  for (int n = 0; n < 60; ++n) {
    const SolidBody first = prepared(mesh_of(draw_boxes(draw))), second = prepared(mesh_of(draw_boxes(draw)));
    const Isometry3d pose = Eigen::Translation3d(draw.vector(45)) * draw.rotation();
    const std::vector<Vector3d> offsets = {draw.vector(15), draw.vector(15), draw.vector(15), Vector3d::Zero()};
    const double gap = draw.number(0, 1);
    if (!keeps_apart(first, second, pose, offsets, gap)) continue;
    ++kept;
    for (int k = 0; k < 40; ++k) {
      Vector3d offset = Vector3d::Zero();
      double left = 1;
      for (const Vector3d& o : offsets) {
        const double share = k < 4 ? (&o == &offsets[static_cast<std::size_t>(k)] ? 1 : 0) : draw.number(0, left);
        offset += share * o;
        left -= share;
      }
      const Isometry3d moved = Eigen::Translation3d(offset) * pose;
      EXPECT_GT(nearness(first, second, moved, kInfinite, 1 + 1e-9).at_most_mm, gap);
    }
  }
  EXPECT_GT(kept, 20);
  EXPECT_LT(kept, 60);
}

TEST(Proximity, DepthIsFoundAsFineAsItIsWanted) {
  const SolidBody floor = prepared(box({-50, -50, -20}, {50, 50, 0})), ball = prepared(icosphere(10, 4));
  for (const double depth : {5.0, 1.0, 0.1, 0.01, 0.001}) {
    const Depth found = depth_inside(floor, ball, place({1, 3, 10 - depth}), {.factor = 1.01, .points = 800});
    EXPECT_LE(found.at_least_mm, depth * (1 + 1e-9));
    EXPECT_GE(found.at_least_mm, 0.95 * depth);
  }
}

TEST(Proximity, DepthOfAnEdgeThatDipsIn) {
  const SolidBody floor = prepared(box({-50, -50, -20}, {50, 50, 0})), bar = prepared(box({-1, -30, -1}, {1, 30, 1}));
  const Eigen::Quaterniond tilt(Eigen::AngleAxisd(kPi / 4, Vector3d::UnitY()));
  for (const double depth : {5.0, 1.0, 0.1, 1e-3}) {
    const Isometry3d pose = Eigen::Translation3d(0, 0, std::sqrt(2.0) - depth) * tilt;
    const Depth found = depth_inside(floor, bar, pose, {.least_mm = 1e-5});
    EXPECT_LE(found.at_least_mm, depth * (1 + 1e-9));
    EXPECT_GE(found.at_least_mm, depth / 4) << depth;
    EXPECT_LE(found.place_mm.z(), 0);
  }
  EXPECT_LT(depth_inside(floor, bar, place({0, 0, 1}), {.least_mm = 1e-5}).at_least_mm, 1e-9) << "it lies on it";
}

TEST(Proximity, DepthOfAnEdgeWhoseEndIsFlushWithAFace) {
  // The bar ends where the post does, so that its edges cross the post's surface once.
  const SolidBody post = prepared(box({-50, -6, -40}, {-40, 6, 0})), bar = prepared(box({-50, -1, -1}, {50, 1, 1}));
  for (const double depth : {0.5, 0.02}) {
    const Depth found = depth_inside(post, bar, place({0, 0, 1 - depth}), {1, 1e-3});
    EXPECT_LE(found.at_least_mm, depth * (1 + 1e-9));
    EXPECT_GE(found.at_least_mm, depth / 4);
  }
}

TEST(Proximity, AContourIsTheCurveOfBothSurfaces) {
  const SolidBody slab = prepared(box({-50, -50, -40}, {50, 50, 0})), ball = prepared(icosphere(10, 5));
  for (const double height : {-3.0, 0.123, 6.0}) {
    double length = 0;
    for (const ContourPiece& piece : contour(slab, ball, place({0, 0, height}))) {
      length += piece.length_mm();
      for (const auto& end : piece.ends) EXPECT_NEAR(end.at_mm.z(), 0, 1e-12);
    }
    EXPECT_NEAR(length, 2 * kPi * std::sqrt(100 - height * height), 0.05);
  }
  EXPECT_TRUE(contour(slab, ball, place({0, 0, 11})).empty());
  EXPECT_TRUE(contour(slab, ball, place({0, 0, -10.001})).empty()) << "wholly inside";
}

TEST(Travel, NoPointComesFurther) {
  Draw draw(5);
  for (int n = 0; n < 50; ++n) {
    const Motion motion = draw_motion(draw);
    const Vector3d pivot = draw.vector(5);
    const double reach = draw.number(1, 20);
    const Travel travel(motion, reach);
    for (int k = 0; k < 50; ++k) {
      const Vector3d p = pivot + reach * draw.vector(1).normalized();
      double a = draw.number(0, 1), b = draw.number(0, 1);
      if (a > b) std::swap(a, b);
      const double moved = (motion.at(a).about(pivot) * p - motion.at(b).about(pivot) * p).norm();
      EXPECT_LE(moved, travel.at(b) - travel.at(a) + 1e-9);
      const double length = draw.number(0, 30);
      EXPECT_LE(travel.at(travel.later(a, length, 1)) - travel.at(a), length + 1e-9);
      EXPECT_LE(travel.at(b) - travel.at(travel.earlier(b, length, 0)), length + 1e-9);
      EXPECT_GE(travel.later(a, length, 1), a);
      EXPECT_LE(travel.earlier(b, length, 0), b);
    }
  }
}

TEST(Travel, IsThatOfAnEvenMotion) {
  const Travel straight(straight_motion({}, moved_by({30, 40, 0})), 10);
  EXPECT_NEAR(straight.whole(), 50, 1e-6);
  EXPECT_NEAR(straight.at(0.3), 15, 1e-6);
  EXPECT_NEAR(straight.later(0.5, 5, 1), 0.6, 1e-8);
  EXPECT_NEAR(straight.earlier(0.5, 5, 0), 0.4, 1e-8);
  const Travel turn(straight_motion({}, moved_by({0, 0, 0}, Eigen::Quaterniond(Eigen::AngleAxisd(1.5, Vector3d::UnitX())))), 10);
  EXPECT_NEAR(turn.whole(), 15, 1e-6);
  EXPECT_EQ(Travel().later(0.2, 1e-9, 0.9), 0.9) << "at rest forever";
}

}  // namespace
}  // namespace rayrep::test
