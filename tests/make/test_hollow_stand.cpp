#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>

#include "rayrep/base/error.h"
#include "rayrep/io/mesh_io.h"
#include "rayrep/judge/verify.h"
#include "rayrep/make/hollow.h"
#include "rayrep/mesh/level_set.h"
#include "runs.h"
#include "solids.h"

namespace rayrep {
namespace {

using namespace test;

Job<StandSpec> coarse() {
  Job<StandSpec> options;
  options.hollow.resolution = 40;
  options.hollow.as_stored = [](const Mesh& mesh) { return as_stored("x.stl", mesh); };
  return options;
}

StandVerdict expect_stands(const Mesh& solid, const Job<StandSpec>& options) {
  const Outcome<StandSpec> result = hollowed(solid, options);
  const auto path = own_file("stand.stl");
  write_mesh(path, result.delivery.body());
  StandSpec goal;
  goal.up = options.spec.up;
  goal.target_mm = *result.found.target_mm;
  const StandVerdict verdict = verify(read_mesh(path).mesh, &solid, goal);
  for (const Criterion& c : verdict.criteria)
    EXPECT_TRUE(c.pass()) << path << ": " << c.name << " " << c.value << " limit " << c.limit;
  if (verdict.pass()) std::filesystem::remove(path);
  return verdict;
}

TEST(HollowStand, ABoxBringsItsCentreOfMassDown) {
  // By symmetry the target is the middle and the cavity flat: filled to t above the floor, the lowest centre of mass lies at the
  // level of the filling (otherwise one more or one less layer would lower it).
  const Mesh solid = box({0, 0, 0}, {20, 20, 40});
  const StandVerdict verdict = expect_stands(solid, coarse());
  const double w = 1.2;
  const auto height = [&](double t) {
    const Moments s = box_moments({0, 0, 0}, {20, 20, 40}) - box_moments({w, w, t}, {20 - w, 20 - w, 40 - w});
    return s[MZ] / s[M1];
  };
  double lowest = 20;
  for (double t = w; t < 40 - w; t += 0.01) lowest = std::min(lowest, height(t));
  EXPECT_NEAR(verdict.state.height_mm, lowest, 0.03);  // the edges of the cavity are chamfered over a cell of 0.6 mm
  EXPECT_NEAR(verdict.state.smallest_tipping_angle_rad, std::atan2(10, lowest), 1e-3);
}

TEST(HollowStand, ABallStandsOnTheLeastCutThatMakesItSafe) {
  const Mesh solid = icosphere(20, 4);
  Job<StandSpec> options = coarse();
  EXPECT_TRUE(mentions(message_of([&] { hollowed(solid, options); }, ErrorCode::goal), {"cannot stand"}));
  options.spec.flatten_mm = 6;
  const Outcome<StandSpec> result = hollowed(solid, options);
  const double cut_mm = result.found.flatten_mm;
  EXPECT_GT(cut_mm, 0);
  EXPECT_LT(cut_mm, 6);
  const Mesh body = result.delivery.body();
  EXPECT_NEAR(bounding_box(body).sizes().z(), 40 - cut_mm, 1e-4);
  StandSpec goal;
  goal.flatten_mm = cut_mm;
  const StandVerdict verdict = verify(body, &solid, goal);
  EXPECT_TRUE(verdict.pass());
  EXPECT_GE(verdict.state.smallest_tipping_angle_rad, 0.05);
  // A judge who was told of no cut, or of a smaller one, finds the outside changed.
  for (const double allowed : {0.0, 0.7 * cut_mm}) {
    goal.flatten_mm = allowed;
    EXPECT_FALSE(verify(body, &solid, goal).pass()) << allowed;
  }
  // It is the least: half as much again is no longer safe.
  options.spec.flatten_mm = 0.6 * cut_mm;
  const auto angle = [&] {
    try {
      const Outcome<StandSpec> less = hollowed(solid, options);
      return verify(less.delivery.body(), nullptr, StandSpec{}).state.smallest_tipping_angle_rad;
    } catch (const Error&) {
      return 0.0;
    }
  };
  EXPECT_LT(angle(), 0.053);
  // Little that is allowed is refused with what was tried.
  options.spec.flatten_mm = 1e-3;
  EXPECT_TRUE(
      mentions(message_of([&] { hollowed(solid, options); }, ErrorCode::goal), {"cannot stand", "0.001 mm cut off", "--flatten"}));
}

TEST(HollowStand, PausesAreCountedFromTheBaseThatWasCut) {
  Job<StandSpec> options = coarse();
  options.spec.flatten_mm = 6;
  Part magnet{box({-2, -2, 2}, {2, 2, 5}), Part::Role::insert, 7.5};
  options.hollow.fixed.push_back({magnet});
  const Mesh solid = icosphere(20, 4);
  const Outcome<StandSpec> result = hollowed(solid, options);
  EXPECT_GT(result.found.flatten_mm, 0);
  const double base_mm = bounding_box(result.delivery.body()).min().z();
  ASSERT_EQ(result.delivery.pauses_mm.size(), 1U);
  EXPECT_NEAR(result.delivery.pauses_mm[0], 5 - base_mm, 1e-4);
  EXPECT_NEAR(base_mm, -20 + result.found.flatten_mm, 1e-2);
  const Verdict verdict = verify(result.delivery, &solid, result.spec);
  EXPECT_EQ(failed(verdict), Names{});
}

TEST(HollowStand, NothingIsCutOffWhatStandsByItself) {
  Job<StandSpec> options = coarse();
  const Mesh solid = box({0, 0, 0}, {20, 20, 40});
  const Mesh plain = hollowed(solid, options).delivery.body();
  options.spec.flatten_mm = 3;
  const Mesh allowed = hollowed(solid, options).delivery.body();
  EXPECT_EQ(allowed.vertices, plain.vertices);
  EXPECT_TRUE(verify(allowed, &solid, options.spec).pass());
}

TEST(HollowStand, TheGapIsClosedByTheExactSolverAndSmallByIpopt) {
  const Mesh solid = polycubes({{0, 0, 0}, {0, 0, 1}, {0, 0, 2}, {1, 0, 2}}, 20);
  Job<StandSpec> options = coarse();
  const Outcome<StandSpec> exact = hollowed(solid, options);
  EXPECT_LT(exact.duality_gap, 1e-9);
  options.hollow.solver = Solver::rays;
  const Outcome<StandSpec> rays = hollowed(solid, options);
  EXPECT_GE(*rays.duality_gap, 0);
  EXPECT_LT(*rays.duality_gap, 1e-4);
  EXPECT_NEAR(rays.solve.objective, exact.solve.objective, 1e-4 * exact.solve.objective);
}

TEST(HollowStand, AToweringHeadIsBalancedOverTheBase) {
  // A block with an overhanging head: solid, its centre of mass lies nearly over the edge.
  const Mesh solid = polycubes({{0, 0, 0}, {0, 0, 1}, {0, 0, 2}, {1, 0, 2}}, 20);
  const StandState before = stand_state_of(solid, {});
  const StandVerdict after = expect_stands(solid, coarse());
  EXPECT_GT(after.state.smallest_tipping_angle_rad, 1.5 * before.smallest_tipping_angle_rad);
}

TEST(HollowStand, TheLargestTippingAngleIsNoSmallerThanAtTheSafestPoint) {
  const Mesh solid = polycubes({{0, 0, 0}, {0, 0, 1}, {0, 0, 2}, {1, 0, 2}}, 20);
  Job<StandSpec> options = coarse();
  const double lowest = expect_stands(solid, options).state.smallest_tipping_angle_rad;
  options.spec.objective = StandSpec::Objective::tip_angle;
  EXPECT_GE(expect_stands(solid, options).state.smallest_tipping_angle_rad, lowest - 1e-3);
}

TEST(HollowStand, AGivenTargetIsMet) {
  Job<StandSpec> options = coarse();
  options.spec.target_mm = Eigen::Vector3d(8, 11, 0);
  const Outcome<StandSpec> result = hollowed(box({0, 0, 0}, {20, 20, 40}), options);
  const Moments s = mesh_moments(result.delivery.body());
  EXPECT_NEAR(s[MX] / s[M1], 8, 1e-3);
  EXPECT_NEAR(s[MY] / s[M1], 11, 1e-3);
}

TEST(HollowStand, KeepsToALargestMass) {
  const Mesh solid = box({0, 0, 0}, {20, 20, 40});
  Job<StandSpec> options = coarse();
  const double free_g = expect_stands(solid, options).body.mass_g;
  options.spec.most_mass_g = 0.8 * free_g;
  const Outcome<StandSpec> result = hollowed(solid, options);
  EXPECT_LT(*result.duality_gap, 1e-6);
  const StandVerdict light = verify(result.delivery.body(), &solid, result.found);
  EXPECT_TRUE(light.pass());
  EXPECT_EQ(light.criteria.back().name, "most_mass");
  EXPECT_NEAR(light.body.mass_g, 0.8 * free_g, 1e-4 * free_g);
  // Filled as far as that mass goes.
  const double w = 1.2;
  const double fill = w + (0.8 * free_g / 1.24e-3 - (16000 - std::pow(20 - 2 * w, 2) * (40 - 2 * w))) / std::pow(20 - 2 * w, 2);
  const Moments s = box_moments({0, 0, 0}, {20, 20, 40}) - box_moments({w, w, fill}, {20 - w, 20 - w, 40 - w});
  EXPECT_NEAR(light.state.height_mm, s[MZ] / s[M1], 0.05);
  options.spec.most_mass_g = 2 * free_g;
  EXPECT_NEAR(expect_stands(solid, options).body.mass_g, free_g, 1e-3 * free_g);
  options.spec.most_mass_g = 3;
  EXPECT_TRUE(mentions(message_of([&] { hollowed(solid, options); }, ErrorCode::goal), {"It cannot be so light", "3.00 g"}));
}

TEST(HollowStand, RefusesAPointAnEdgeAndATargetOutOfReach) {
  const auto message = [](const Mesh& solid, const Job<StandSpec>& options) -> std::string {
    try {
      hollowed(solid, options);
    } catch (const Error& error) {
      EXPECT_EQ(error.code(), ErrorCode::goal) << error.what();
      return error.what();
    }
    return "no error";
  };
  Mesh cone = rotated(frustum(15, 0, 30, 48), Eigen::AngleAxisd(kPi, Eigen::Vector3d::UnitX()).toRotationMatrix());
  EXPECT_NE(message(cone, coarse()).find("a point only"), std::string::npos) << message(cone, coarse());
  const Mesh roof =
      rotated(box({-10, -20, -10}, {10, 20, 10}), Eigen::AngleAxisd(kPi / 4, Eigen::Vector3d::UnitY()).toRotationMatrix());
  EXPECT_NE(message(roof, coarse()).find("an edge only"), std::string::npos) << message(roof, coarse());
  Job<StandSpec> far = coarse();
  far.spec.target_mm = Eigen::Vector3d(1, 10, 0);
  EXPECT_NE(message(box({0, 0, 0}, {20, 20, 40}), far).find("mm beside it"), std::string::npos);
}

}  // namespace
}  // namespace rayrep
