// What stays in a body that is held still and lets all run out, against what can be worked out by hand. theory.md (102)

#include <gtest/gtest.h>

#include <cmath>

#include "physics/trapped.h"
#include "rayrep/mesh/boolean.h"
#include "solids.h"

namespace rayrep::test {
namespace {

Mesh without(const std::vector<Mesh>& meshes) { return combined(meshes, {BooleanOperation::subtract}).mesh; }

/// 40 x 30 x 20 with walls of 2, and a square hole in the +x one, its floor at z = 8.
Mesh holed_box() {
  return without({box({-20, -15, 0}, {20, 15, 20}), box({-18, -13, 2}, {18, 13, 18}), box({17, -2, 8}, {21, 2, 12})});
}

void expect_moments(const Moments& s, const Moments& expected, double tolerance) {
  const Moments unit = moment_units(expected[M1], 20);
  EXPECT_LT((s - expected).cwiseQuotient(unit).cwiseAbs().maxCoeff(), tolerance) << s.transpose() << "\n" << expected.transpose();
}

TEST(Trapped, OfABoxIsWhatLiesBelowItsHole) {
  const Mesh body = holed_box();
  const std::vector<Pool> pools = pools_in(body, {0, 0, 2});
  ASSERT_EQ(pools.size(), 1u);
  expect_moments(pools[0].s, mesh_moments(box({-18, -13, 2}, {18, 13, 8})), 1e-12);
  EXPECT_NEAR(pools[0].surface_mm, 8, 1e-12);
  EXPECT_EQ(pools[0].lowest_mm.z(), 2);
  expect_moments(total(pools_in(body, -Eigen::Vector3d::UnitZ())), mesh_moments(box({-18, -13, 12}, {18, 13, 18})), 1e-12);
  // Held with the hole below all of it runs out, with the hole above only what fills the hole as well is more.
  EXPECT_TRUE(pools_in(body, -Eigen::Vector3d::UnitX()).empty());
  EXPECT_NEAR(total(pools_in(body, Eigen::Vector3d::UnitX()))[M1], 36 * 26 * 16 + 2 * 4 * 4, 1e-8);
}

TEST(Trapped, OfATiltedBoxRunsOverTheHigherEndOfItsHole) {
  const Mesh body = holed_box();
  // The hole's side below: over its inner edge; above: over its outer one, and some stays in the hole.
  EXPECT_NEAR(total(pools_in(body, {-0.1, 0, 1}))[M1], 26 * 36 * 4.2, 1e-8);
  EXPECT_NEAR(total(pools_in(body, {0.1, 0, 1}))[M1], 26 * 36 * 8 + 0.8, 1e-8);
}

TEST(Trapped, OfABallIsACap) {
  const Mesh shell = hollow(icosphere(20, 5), icosphere(18, 5));
  const Mesh drill =
      moved(rotated(cylinder(2, 30, 60), Eigen::AngleAxisd(kPi / 2, Eigen::Vector3d::UnitY()).toRotationMatrix()), {0, 0, 5});
  const Mesh body = without({shell, drill});
  const double height = 18 + 3;  // the hole's lowest line
  const std::vector<Pool> pools = pools_in(body, {0, 0, 1});
  ASSERT_EQ(pools.size(), 1u);
  EXPECT_NEAR(pools[0].s[M1], kPi * height * height * (18 - height / 3), 2e-3 * pools[0].s[M1]);
  EXPECT_NEAR(pools[0].surface_mm, 3, 1e-9);
}

TEST(Trapped, StaysBehindAWeir) {
  Mesh body = holed_box();
  const std::vector<Mesh> both = {without({body, box({17, -1, 4}, {21, 1, 9})}), box({-1, -14, 1}, {1, 14, 10})};
  body = combined(both, {BooleanOperation::unite}).mesh;
  const std::vector<Pool> pools = pools_in(body, {0, 0, 1});
  ASSERT_EQ(pools.size(), 2u);
  const auto [small, large] = std::minmax(pools[0].s[M1], pools[1].s[M1]);
  EXPECT_NEAR(small, 17 * 26 * 2, 1e-8);
  EXPECT_NEAR(large, 17 * 26 * 8, 1e-8);
}

TEST(Trapped, OfASealedCavityIsAllOfIt) {
  const Mesh cavity = rotated(box({-18, -13, 2}, {18, 13, 18}), random_rotation(5));
  const Mesh body = hollow(rotated(box({-20, -15, 0}, {20, 15, 20}), random_rotation(5)), cavity);
  const std::vector<Pool> pools = pools_in(body, {1, 2, 3});
  ASSERT_EQ(pools.size(), 1u);
  EXPECT_TRUE(std::isinf(pools[0].surface_mm));
  expect_moments(pools[0].s, mesh_moments(cavity), 1e-12);
}

TEST(Trapped, MovesWithTheBody) {
  const Mesh body = holed_box();
  for (int seed = 1; seed < 6; ++seed) {
    Eigen::Affine3d motion(random_rotation(seed));
    motion.pretranslate(Eigen::Vector3d(100, -30, 7));
    const Eigen::Vector3d up(0.3 * seed - 0.9, 0.2, 1);
    expect_moments(total(pools_in(transformed(body, motion), motion.linear() * up)), moment_map(motion) * total(pools_in(body, up)),
                   1e-9);
  }
}

}  // namespace
}  // namespace rayrep::test
