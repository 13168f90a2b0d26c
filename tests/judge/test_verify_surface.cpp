// The criteria on the surface that all goals share: what was changed of the outside.

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <filesystem>
#include <string>
#include <vector>

#include "mesh/float32.h"
#include "places.h"
#include "rayrep/io/mesh_io.h"
#include "rayrep/judge/verify.h"
#include "solids.h"

namespace rayrep {
namespace {

using Eigen::Vector3d;

TargetSpec goal(double wall_mm = 0) {
  TargetSpec spec;
  spec.wanted[M1] = 1.0;
  spec.print.wall_mm = wall_mm;
  return spec;
}

Verdict judged(const Mesh& delivered, const Mesh& original, double wall_mm = 0) {
  return verify(delivered, &original, goal(wall_mm));
}

const Criterion* criterion(const Verdict& verdict, const std::string& name) {
  for (const Criterion& c : verdict.criteria)
    if (c.name == name) return &c;
  return nullptr;
}

double deviation(const Mesh& delivered, const Mesh& original) { return judged(delivered, original).outer_deviation_mm; }

Mesh cube() { return test::box({0, 0, 0}, {20, 20, 20}); }

/// The cube with a point of its top drawn to a height; 0: merely cut into other triangles.
Mesh with_spike(double height) {
  Mesh mesh = cube();
  std::erase_if(mesh.triangles, [](const Eigen::Vector3i& t) { return t.minCoeff() >= 4; });  // the top
  EXPECT_EQ(mesh.triangles.size(), 10u);
  mesh.vertices.insert(mesh.vertices.end(), {{14, 3, 20}, {15, 3, 20}, {14.5, 4, 20}, {14.5, 3.3, 20 + height}});
  // A ring around the triangle (8, 9, 10), and the spike on it.
  for (const auto& t : std::vector<Eigen::Vector3i>{
           {4, 5, 9}, {4, 9, 8}, {5, 7, 10}, {5, 10, 9}, {7, 6, 10}, {6, 4, 8}, {6, 8, 10}, {8, 9, 11}, {9, 10, 11}, {10, 8, 11}})
    mesh.triangles.push_back(t);
  EXPECT_TRUE(test::is_closed_solid(mesh));
  return mesh;
}

TEST(OuterDeviation, OfASpikeIsItsHeightAndOfAPitItsDepth) {
  for (const double h : {10.0, 3.0, 1.0, 0.1, 1e-2, 1e-4}) {
    EXPECT_NEAR(deviation(with_spike(h), cube()), h, 1e-3 * h);
    EXPECT_NEAR(deviation(cube(), with_spike(h)), h, 1e-3 * h);
    EXPECT_FALSE(criterion(judged(with_spike(h), cube()), "outer_unchanged")->pass()) << h;
  }
  for (const double h : {0.1, 1e-2, 1e-4}) EXPECT_NEAR(deviation(with_spike(-h), cube()), h, 1e-3 * h);
  // A deep one is farthest where its wall is as far from the nearest side as from the top: 4 - 0.7 t = 10 t.
  EXPECT_NEAR(deviation(with_spike(-10), cube()), 40 / 10.7, 4e-3);
}

TEST(OuterDeviation, OfTheSameFacesCutOtherwiseIsNothing) {
  EXPECT_EQ(deviation(with_spike(0), cube()), 0);
  EXPECT_EQ(deviation(cube(), with_spike(0)), 0);
  for (int n = 1; n < 4; ++n) {
    EXPECT_EQ(deviation(test::subdivided(cube(), n), cube()), 0);
    EXPECT_EQ(deviation(with_spike(0), test::subdivided(cube(), n)), 0);
    EXPECT_TRUE(criterion(judged(test::subdivided(cube(), n), cube()), "outer_unchanged")->pass());
  }
}

TEST(OuterDeviation, OfATranslatedCopyIsTheTranslation) {
  for (const double t : {7.0, 0.3, 1e-3}) {
    EXPECT_NEAR(deviation(test::moved(cube(), {t, 0, 0}), cube()), t, 1e-3 * t);
    const Mesh ball = test::icosphere(10, 3);
    const double d = deviation(test::moved(ball, {0, 0, t}), ball);
    EXPECT_LE(d, t * (1 + 1e-9));
    EXPECT_GE(d, 0.97 * t);  // no facet is quite upright on the way
  }
}

TEST(OuterDeviation, IsTheSameBothWays) {
  for (std::uint64_t seed = 1; seed <= 5; ++seed) {
    test::Random random(seed);
    const Mesh a = test::rotated(test::icosphere(10, 2), test::random_rotation(seed));
    Mesh b = a;
    for (int n = 0; n < 5; ++n) b.vertices[static_cast<std::size_t>(random.uniform() * 160)] += random.in_box(1);
    const double there = deviation(b, a);
    EXPECT_GT(there, 0.05);
    EXPECT_NEAR(deviation(a, b), there, 1.1e-3 * there);
  }
}

TEST(OuterDeviation, IsJudgedByTheRoundingOfTheCoordinatesAsTheyAre) {
  // At 1e6 mm float32 values are 0.06 mm apart; these coordinates are none.
  const Vector3d far(1e6, 1e6, 1e6);
  const Mesh original = test::moved(cube(), far);
  for (const double raised : {0.1, 0.01, 1e-4}) {
    Mesh delivered = original;
    delivered.vertices[7].z() += raised;
    const Verdict verdict = judged(delivered, original);
    EXPECT_NEAR(verdict.outer_deviation_mm, raised, 1e-3 * raised + 1e-9);
    EXPECT_LT(verdict.coordinate_rounding_mm, 1e-8);
    EXPECT_FALSE(criterion(verdict, "outer_unchanged")->pass());
  }
  // The same as STL would store it: what rounding did is no change, and the verdict says that there is no room for a wall.
  Mesh uneven = test::moved(test::scaled(cube(), 1.0371), far);
  append(uneven, test::flipped(test::moved(test::box({6, 6, 6}, {14, 14, 14}), far)));
  const Mesh stored = as_float32(uneven);
  const Verdict verdict = judged(stored, test::moved(test::scaled(cube(), 1.0371), far), 1.2);
  EXPECT_EQ(verdict.outer_deviation_mm, 0);
  EXPECT_TRUE(criterion(verdict, "outer_unchanged")->pass());
  ASSERT_EQ(verdict.notes.size(), 1u);
  EXPECT_TRUE(test::mentions(verdict.notes[0], {"float32", "0.0625", "1.2 mm", "origin"}));
  EXPECT_TRUE(judged(uneven, test::moved(test::scaled(cube(), 1.0371), far), 1.2).notes.empty());
  EXPECT_FALSE(float32_holds_wall(bounding_box(stored), 1.2));
  EXPECT_TRUE(float32_holds_wall(bounding_box(cube()), 1.2));
  EXPECT_EQ(float32_spacing_mm(bounding_box(stored)), 0.0625);
}

TEST(OuterDeviation, OfTheSharedCases) {
  const auto folder = test::shared_meshes().parent_path() / "cases";
  if (!std::filesystem::exists(folder)) GTEST_SKIP() << folder << " is missing";
  const auto of = [&](const char* name) { return read_mesh(folder / name).mesh; };
  EXPECT_NEAR(deviation(of("ca_spike10.obj"), of("ca_plain.obj")), 10, 1e-2);
  EXPECT_EQ(deviation(of("ca_spike0.obj"), of("ca_plain.obj")), 0);
  EXPECT_NEAR(deviation(of("u_mod_1e6.obj"), of("u_orig_1e6.obj")), 0.1, 1e-4);
}

}  // namespace
}  // namespace rayrep
