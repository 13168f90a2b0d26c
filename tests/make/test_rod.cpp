#include <gtest/gtest.h>

#include <random>

#include "make/carriers.h"
#include "make/rod.h"
#include "solids.h"

namespace rayrep::test {
namespace {

using detail::Rod;

Eigen::Vector3d along(const Rod& rod, double part) { return (1 - part) * rod.from_mm + part * rod.to_mm; }

TEST(Rod, GapIsThatOfTheNearestPointsOfBothAxes) {
  std::mt19937 random(7);
  std::uniform_real_distribution<double> coordinate(-1, 1);
  const auto point = [&] { return Eigen::Vector3d(coordinate(random), coordinate(random), coordinate(random)); };
  for (int n = 0; n < 60; ++n) {
    Rod a{point(), point(), 0.1};
    Rod b{point(), point(), 0.2};
    if (n % 5 == 0) b.to_mm = b.from_mm + 0.7 * (a.to_mm - a.from_mm);  // parallel
    if (n % 7 == 0) b.to_mm = b.from_mm;                                // a ball
    double nearest = 1e9;
    constexpr int kSteps = 200;
    for (int i = 0; i <= kSteps; ++i)
      for (int j = 0; j <= kSteps; ++j)
        nearest = std::min(nearest, (along(a, i / double{kSteps}) - along(b, j / double{kSteps})).norm());
    EXPECT_LE(gap_mm(a, b), nearest - 0.3 + 1e-12);
    EXPECT_GT(gap_mm(a, b), nearest - 0.3 - 2.0 / kSteps);
    EXPECT_NEAR(gap_mm(a, b), gap_mm(b, a), 1e-12);
  }
}

TEST(Rod, APillarIsWhatStandsBelowItsCone) {
  const detail::Carrying how{.angle_rad = kPi / 4, .wall_mm = 1.2, .spacing_mm = 0.5, .within = {}};
  const SurfaceQuery surface(box({-20, -15, 0}, {20, 15, 25}));
  const detail::Carriers found = detail::carriers({surface}, how, {});
  ASSERT_GT(found.bones.size(), 3U);
  const Eigen::Affine3d turned(random_rotation(3));
  for (const Mesh& bone : found.bones) {
    const Rod pillar = detail::pillar_of(bone, how.clearance_mm());
    EXPECT_NEAR(pillar.radius_mm, how.radius_mm(), 0.02 * how.radius_mm());
    EXPECT_NEAR(pillar.from_mm.z(), 0, 1e-9);  // it stands on what the box stands on
    EXPECT_LT((pillar.to_mm - pillar.from_mm).head<2>().norm(), 1e-9);
    EXPECT_GT(pillar.to_mm.z(), 5);
    EXPECT_LE(pillar.to_mm.z(), 25 - 1.2 + 1e-9);
    const Rod same = detail::pillar_of(transformed(bone, turned), how.clearance_mm());
    EXPECT_LT((same.to_mm - turned * pillar.to_mm).norm(), 1e-9);
  }
}

TEST(Carriers, StandClearOfHolesAndCarryWhatIsAboveThem) {
  detail::Carrying how{.angle_rad = kPi / 4, .wall_mm = 1.2, .spacing_mm = 0.5, .within = {}};
  const Mesh body = box({-20, -15, 0}, {20, 15, 25});
  const SurfaceQuery alone(body);
  const std::vector<Mesh> free = detail::carriers({alone}, how, {}).bones;
  // Where a pillar would stand, and in the roof.
  const Rod pillar = detail::pillar_of(free.front(), how.clearance_mm());
  const Eigen::Vector3d above(pillar.to_mm.x(), pillar.to_mm.y(), 25);
  how.holes = {{pillar.from_mm, pillar.from_mm + 4 * Eigen::Vector3d::UnitZ(), 2},
               {above, above - 4 * Eigen::Vector3d::UnitZ(), 2}};
  const detail::Carriers found = detail::carriers({alone}, how, {});
  Mesh all = body;
  for (const Mesh& bone : found.bones) {
    for (const Rod& hole : how.holes)
      EXPECT_GT(gap_mm(detail::pillar_of(bone, how.clearance_mm()), hole), detail::kClearOfPillars_mm);
    append(all, bone);
  }
  const auto first = static_cast<int>(body.triangles.size());
  const SurfaceQuery surface(all, {first, how.wall_mm - how.clearance_mm()});
  EXPECT_LT(detail::carriers({surface, first}, how, {}).roof_mm2, 2e-3 * found.roof_mm2);
}

}  // namespace
}  // namespace rayrep::test
