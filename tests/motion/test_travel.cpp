// How far bodies come: bounds against samples.

#include <gtest/gtest.h>

#include "motion/pair_timeline.h"
#include "motion_scenes.h"

namespace rayrep::test {
namespace {

using Eigen::Isometry3d;
using Eigen::Vector3d;

/// A pair whose bodies turn alike about pivots of their own.
struct Pair {
  Motion first, second;
  Vector3d first_pivot, second_pivot;

  Isometry3d seen(double time) const { return first.at(time).about(first_pivot).inverse() * second.at(time).about(second_pivot); }
  Travel travel() const { return Travel::seen_from(first, second, second_pivot - first_pivot); }
};

Pair drawn_pair(Draw& draw) {
  Pair pair{draw_motion(draw), draw_motion(draw), draw.vector(20), draw.vector(20)};
  pair.second.rotation = pair.first.rotation;
  return pair;
}

TEST(Travel, SeenFromWhatTurnsAlikeBoundsEveryPoint) {
  Draw draw(9);
  for (int n = 0; n < 100; ++n) {
    const Pair pair = drawn_pair(draw);
    const Travel travel = pair.travel();
    double length = 0;  // of the way of one point: all go the same
    const Vector3d p = draw.vector(50);
    Vector3d before = pair.seen(0) * p;
    constexpr int kSteps = 400;
    for (int k = 1; k <= kSteps; ++k) {
      const Vector3d after = pair.seen(static_cast<double>(k) / kSteps) * p;
      EXPECT_LE((after - before).norm(), travel.at(static_cast<double>(k) / kSteps) - travel.at((k - 1.0) / kSteps) + 1e-9);
      length += (after - before).norm();
      before = after;
    }
    EXPECT_LT(travel.whole(), 1.6 * length);
  }
}

TEST(Travel, BodiesThatHangTogetherHardlyMoveToEachOther) {
  // Both turn about the axis through the origin, by keys as an imported robot has them: on arcs that are Hermite's.
  Pair pair{{}, {}, {100, 0, 0}, {300, 50, 0}};
  constexpr int kKeys = 12;
  constexpr double kTurn = 2.4;
  for (Motion* motion : {&pair.first, &pair.second}) {
    const Vector3d& pivot = motion == &pair.first ? pair.first_pivot : pair.second_pivot;
    for (int n = 0; n <= kKeys; ++n) {
      const double time = static_cast<double>(n) / kKeys;
      const Vector3d at = Eigen::AngleAxisd(kTurn * time, Vector3d::UnitZ()) * pivot;
      const Vector3d third = kTurn * Vector3d::UnitZ().cross(at) / (3 * kKeys);
      motion->translation.push_back({time, at - pivot, at - pivot - third, at - pivot + third});
    }
    for (const double time : {0.0, 0.5, 1.0})
      motion->rotation.push_back({time, Eigen::Quaterniond(Eigen::AngleAxisd(kTurn * time, Vector3d::UnitZ()))});
  }
  EXPECT_LT(pair.travel().whole(), 0.05);
  EXPECT_GT(Travel(pair.first, 50).whole(), 200);
}

}  // namespace
}  // namespace rayrep::test
