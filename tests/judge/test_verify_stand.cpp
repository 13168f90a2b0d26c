#include <gtest/gtest.h>
#include <tbb/task_arena.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>
#include <vector>

#include "rayrep/base/error.h"
#include "rayrep/judge/verify.h"
#include "runs.h"
#include "solids.h"

namespace rayrep {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;
using test::failed;
using test::kPi;
using test::Names;

// A gallows, 30 x 10 x 20 on a foot of 10 x 10: solid it falls to its arm's side. Hollowing the arm lets it stand.
struct Gallows {
  StandSpec goal;
  Gallows() { goal.print.wall_mm = 1; }
  static Mesh outer() { return test::polycubes({{0, 0, 0}, {0, 0, 1}, {1, 0, 1}, {2, 0, 1}}, 10); }
  static Mesh mesh() { return test::hollow(outer(), test::box({11, 1, 11}, {29, 9, 19})); }
};

constexpr double kCavity = 18 * 8 * 8;
// Of the hollow one, along x and z.
constexpr double kCentreX = (4000 * 12.5 - kCavity * 20) / (4000 - kCavity);
constexpr double kCentreZ = (4000 * 12.5 - kCavity * 15) / (4000 - kCavity);

const Criterion& criterion(const Verdict& verdict, const std::string& name) {
  const auto found =
      std::find_if(verdict.criteria.begin(), verdict.criteria.end(), [&](const Criterion& c) { return c.name == name; });
  if (found == verdict.criteria.end()) throw std::out_of_range(name);
  return *found;
}

TEST(StandStateOf, TheGallowsByHand) {
  const Gallows gallows;
  const StandState solid = stand_state_of(Gallows::outer(), gallows.goal);
  const StandState hollow = stand_state_of(Gallows::mesh(), gallows.goal);
  for (const StandState* state : {&solid, &hollow}) {
    ASSERT_EQ(state->polygon.corners_mm.size(), 4u);
    EXPECT_NEAR(state->polygon.area_mm2, 100, 1e-10);
    EXPECT_EQ(state->to_ground, Eigen::Matrix3d::Identity());
  }
  EXPECT_TRUE(test::near(solid.centre_mm, Vector2d(12.5, 5), 1e-12));
  EXPECT_NEAR(solid.smallest_tipping_angle_rad, std::atan2(-2.5, 12.5), 1e-12);
  EXPECT_TRUE(test::near(hollow.centre_mm, Vector2d(kCentreX, 5), 1e-12));
  EXPECT_NEAR(hollow.height_mm, kCentreZ, 1e-12);
  EXPECT_NEAR(hollow.smallest_tipping_angle_rad, std::atan2(10 - kCentreX, kCentreZ), 1e-12);
  EXPECT_NEAR(hollow.body.mass_g, 1.24e-3 * (4000 - kCavity), 1e-12);
}

TEST(StandStateOf, DoesNotDependOnTheFrameOrOnSharedVertices) {
  const Gallows gallows;
  const StandState here = stand_state_of(Gallows::mesh(), gallows.goal);
  for (int seed = 1; seed <= 4; ++seed) {
    const Eigen::Affine3d T = Eigen::Translation3d(300, -20, 70) * Eigen::Affine3d(test::random_rotation(seed));
    StandSpec goal = gallows.goal;
    goal.up = 7 * (T.linear() * Vector3d::UnitZ());
    goal.target_mm = T * Vector3d(2, 5, 99);
    const StandState there = stand_state_of(test::soup(transformed(Gallows::mesh(), T)), goal);
    EXPECT_TRUE(test::near((there.to_ground * goal.up).eval(), Vector3d(0, 0, 7), 1e-12));
    EXPECT_EQ(there.polygon.corners_mm.size(), 4u);
    EXPECT_NEAR(there.polygon.area_mm2, 100, 1e-8);
    EXPECT_NEAR(there.height_mm, here.height_mm, 1e-9);
    EXPECT_NEAR(there.smallest_tipping_angle_rad, here.smallest_tipping_angle_rad, 1e-9);
    EXPECT_NEAR(there.target_offset_mm, kCentreX - 2, 1e-9);
  }
  // Along an axis the frame is exact.
  StandSpec down = gallows.goal;
  down.up = -Vector3d::UnitZ();
  const StandState upside_down = stand_state_of(Gallows::mesh(), down);
  EXPECT_NEAR(upside_down.polygon.area_mm2, 300, 1e-10);
  EXPECT_EQ(upside_down.to_ground.cwiseAbs().sum(), 3);
}

TEST(VerifyStand, TheHollowGallowsStandsAndTheSolidOneFalls) {
  const Gallows gallows;
  const Mesh outer = Gallows::outer();
  const StandVerdict hollow = verify(Gallows::mesh(), &outer, gallows.goal);
  EXPECT_EQ(failed(hollow), Names());
  EXPECT_TRUE(hollow.notes.empty());
  EXPECT_EQ(hollow.cavities, 1u);
  EXPECT_NEAR(hollow.smallest_wall_mm, 1, 1e-12);
  Names names;
  for (const Criterion& c : hollow.criteria) names.push_back(c.name);
  EXPECT_EQ(names, Names({"closed", "outer_unchanged", "no_islands", "no_crossings", "wall", "supported", "inside"}));
  const StandVerdict solid = verify(outer, &outer, gallows.goal);
  EXPECT_EQ(failed(solid), Names({"inside"}));
  EXPECT_NEAR(criterion(solid, "inside").value, std::atan2(-2.5, 12.5), 1e-12);
  EXPECT_EQ(solid.meaning, Names({"It does not stand: it falls over."}));
}

TEST(VerifyStand, ThePrintsScatterTakesSomeOfTheTippingAngle) {
  EXPECT_EQ(print_scatter_mm(100), 0.1);
  EXPECT_EQ(print_scatter_mm(1000), 0.5);
  const Gallows gallows;
  const StandVerdict verdict = verify(Gallows::mesh(), nullptr, gallows.goal);
  EXPECT_NEAR(verdict.scattered_tipping_angle_rad, std::atan2(10 - kCentreX - 0.1, kCentreZ), 1e-12);
  EXPECT_EQ(verdict.meaning.size(), 2u);
  // A T whose centre of mass lies 0.05 mm inside the edge of its foot, at x = 10, stands on the computer only.
  const double reach = 25;
  const double height = 1000 * (9.95 - 5) / (reach * 10 * (reach / 2 - 9.95));
  const StandVerdict barely = verify(
      test::merged({test::box({0, 0, 0}, {10, 10, 10}), test::box({0, 0, 10}, {reach, 10, 10 + height})}), nullptr, StandSpec());
  EXPECT_TRUE(barely.pass());
  EXPECT_NEAR(barely.state.centre_mm.x(), 9.95, 1e-9);
  ASSERT_FALSE(barely.notes.empty());
  EXPECT_NE(barely.notes.back().find("it tips over by itself"), std::string::npos);
}

TEST(VerifyStand, AnAngleMayBeAskedFor) {
  const Gallows gallows;
  Limits limits;
  limits.tipping_angle_rad = std::atan2(10 - kCentreX, kCentreZ) - 1e-9;
  EXPECT_EQ(failed(verify(Gallows::mesh(), nullptr, gallows.goal, limits)), Names());
  limits.tipping_angle_rad += 2e-9;
  EXPECT_EQ(failed(verify(Gallows::mesh(), nullptr, gallows.goal, limits)), Names({"inside"}));
}

TEST(VerifyStand, TheTargetIsMissedByItsHorizontalDistance) {
  Gallows gallows;
  const double diagonal = std::sqrt(30. * 30 + 10 * 10 + 20 * 20);
  gallows.goal.target_mm = Vector3d(kCentreX, 5 + 0.99e-3 * diagonal, 40);
  EXPECT_EQ(failed(verify(Gallows::mesh(), nullptr, gallows.goal)), Names());
  gallows.goal.target_mm = Vector3d(kCentreX, 5 + 1.01e-3 * diagonal, 40);
  const StandVerdict verdict = verify(Gallows::mesh(), nullptr, gallows.goal);
  EXPECT_EQ(failed(verdict), Names({"offset"}));
  EXPECT_NEAR(criterion(verdict, "offset").value, 1.01e-3, 1e-12);
}

TEST(VerifyStand, APointOrAnEdgeIsNoSupport) {
  StandSpec goal;
  const Mesh cone = test::cone(10, 20, 24);
  EXPECT_EQ(failed(verify(cone, &cone, goal)), Names());
  goal.up = -Vector3d::UnitZ();
  const StandVerdict tip = verify(cone, &cone, goal);
  EXPECT_EQ(failed(tip), Names({"supported", "inside"}));
  EXPECT_EQ(criterion(tip, "supported").value, 1);
  ASSERT_EQ(tip.notes.size(), 1u);
  EXPECT_NE(tip.notes[0].find("a point"), std::string::npos);

  goal.up = {1, 0, 1};
  const Mesh box = test::box({0, 0, 0}, {10, 30, 10});
  const StandVerdict edge = verify(box, &box, goal);
  EXPECT_EQ(failed(edge), Names({"supported", "inside"}));
  EXPECT_EQ(criterion(edge, "supported").value, 2);
  ASSERT_EQ(edge.notes.size(), 1u);
  EXPECT_NE(edge.notes[0].find("an edge"), std::string::npos);
}

TEST(VerifyStand, TheContactToleranceIsTheOneGiven) {
  // One leg of a stool is 0.2 mm short.
  Mesh stool = test::box({-20, -20, 20}, {20, 20, 25});
  append(stool, test::box({-20, -20, 0}, {-18, -18, 21}));
  append(stool, test::box({18, -20, 0}, {20, -18, 21}));
  append(stool, test::box({-1, 18, 0.2}, {1, 20, 21}));
  StandSpec goal;
  const StandVerdict strict = verify(stool, nullptr, goal);
  EXPECT_EQ(failed(strict), Names({"inside"}));
  EXPECT_NEAR(strict.state.polygon.area_mm2, 40 * 2, 1e-9);
  EXPECT_NE(strict.headline.find("within 0.125 mm of the lowest point"), std::string::npos) << strict.headline;
  goal.contact_tolerance_mm = 0.21;
  const StandVerdict lenient = verify(stool, nullptr, goal);
  EXPECT_EQ(failed(lenient), Names());
  EXPECT_EQ(lenient.state.polygon.corners_mm.size(), 6u);
}

TEST(VerifyStand, EachFaultOfTheSurfaceFailsItsOwnCriterion) {
  const Gallows gallows;
  const Mesh outer = Gallows::outer();
  StandSpec goal = gallows.goal;
  goal.print.wall_mm = 1.1;
  EXPECT_EQ(failed(verify(Gallows::mesh(), &outer, goal)), Names({"wall"}));
  const Mesh speck = test::box({15, 4, 14}, {16, 5, 15});
  EXPECT_EQ(failed(verify(test::merged({Gallows::mesh(), speck}), &outer, gallows.goal)), Names({"no_islands"}));
  Mesh moved = outer;
  moved.vertices.back() += Vector3d(0.01, 0, 0);
  EXPECT_EQ(failed(verify(Gallows::mesh(), &moved, gallows.goal)), Names({"outer_unchanged"}));
  Mesh open = Gallows::mesh();
  open.triangles.pop_back();
  EXPECT_FALSE(criterion(verify(open, &outer, gallows.goal), "closed").pass());
}

TEST(VerifyStand, TheSameBitsForAnyNumberOfThreads) {
  const Gallows gallows;
  StandVerdict one;
  tbb::task_arena(1).execute([&] { one = verify(Gallows::mesh(), nullptr, gallows.goal); });
  const StandVerdict many = verify(Gallows::mesh(), nullptr, gallows.goal);
  for (std::size_t i = 0; i < one.criteria.size(); ++i)
    EXPECT_EQ(one.criteria[i].value, many.criteria.at(i).value) << one.criteria[i].name;
}

TEST(VerifyStand, RefusesGoalsAndMeshesThatMakeNoSense) {
  const auto code = [](const Mesh& mesh, const StandSpec& goal) {
    try {
      verify(mesh, nullptr, goal);
    } catch (const Error& e) {
      return e.code();
    }
    return ErrorCode::internal;
  };
  StandSpec goal;
  goal.up.setZero();
  EXPECT_EQ(code(Gallows::mesh(), goal), ErrorCode::usage);
  goal = {};
  goal.contact_tolerance_mm = -1;
  EXPECT_EQ(code(Gallows::mesh(), goal), ErrorCode::usage);
  goal = {};
  goal.print.wall_mm = -1;
  EXPECT_EQ(code(Gallows::mesh(), goal), ErrorCode::usage);
  goal = {};
  EXPECT_EQ(code(Mesh(), goal), ErrorCode::input);
  EXPECT_EQ(code(test::flipped(Gallows::mesh()), goal), ErrorCode::input);
}

}  // namespace
}  // namespace rayrep
