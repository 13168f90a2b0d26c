#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "rayrep/mesh/section.h"
#include "rayrep/physics/moments.h"
#include "solids.h"

namespace rayrep::test {
namespace {

double area(const std::vector<SectionLoop>& loops) {
  double sum = 0;
  for (const SectionLoop& loop : loops) sum += loop_moments(loop).area_mm2;
  return sum;
}

TEST(Section, OfABoxIsItsPlan) {
  const Mesh body = box({1, 2, 3}, {11, 22, 33});
  for (const double z : {3.0 + 1e-9, 10.0, 32.9}) {
    const auto loops = section(body, z);
    ASSERT_EQ(loops.size(), 1U);
    const LoopMoments moments = loop_moments(loops[0]);
    EXPECT_NEAR(moments.area_mm2, 200, 1e-9);
    EXPECT_NEAR((moments.moment_mm3 / moments.area_mm2 - Eigen::Vector2d(6, 12)).norm(), 0, 1e-12);
  }
  EXPECT_TRUE(section(body, 3.0).empty());  // its lower face counts as above
  EXPECT_EQ(section(body, 33.0).size(), 1U);
  EXPECT_TRUE(section(body, 40).empty());
}

TEST(Section, AreasAddUpToTheVolume) {
  const Mesh sphere = icosphere(10, 5);
  const MeshSections sections(sphere);
  constexpr int layers = 4000;
  double volume = 0;
  for (int n = 0; n < layers; ++n) volume += area(sections.at(-10 + (n + 0.5) * 20.0 / layers)) * 20.0 / layers;
  EXPECT_NEAR(volume / mesh_moments(sphere)[M1], 1, 1e-5);
}

TEST(Section, HolesRunTheOtherWay) {
  const auto loops = section(hollow(box({0, 0, 0}, {10, 10, 10}), box({2, 2, 2}, {5, 5, 5})), 3.3);
  ASSERT_EQ(loops.size(), 2U);
  EXPECT_NEAR(area(loops), 100 - 9, 1e-12);
  const auto outer = outermost(loops);
  ASSERT_EQ(outer.size(), 1U);
  EXPECT_NEAR(loop_moments(loops[outer[0]]).area_mm2, 100, 1e-12);
}

}  // namespace
}  // namespace rayrep::test
