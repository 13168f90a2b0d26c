#include <gtest/gtest.h>
#include <tbb/task_arena.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <string>
#include <vector>

#include "rayrep/base/error.h"
#include "rayrep/judge/verify.h"
#include "runs.h"
#include "solids.h"

namespace rayrep {
namespace {

using Eigen::Vector3d;
using test::failed;
using test::kPi;
using test::Names;

// A block on z = 0 with a box-shaped cavity around its middle, spinning about z on the middle of its base.
/// Contact point of a top, centre of a yo-yo.
void put(SpinSpec& goal, const Vector3d& at) {
  if (goal.yoyo)
    goal.centre_mm = at;
  else
    goal.axis = {.through = SpinAxis::Through::point, .point_mm = at};
}

struct Block {
  Vector3d size;
  Vector3d cavity = {20, 16, 8};
  Vector3d shift = Vector3d::Zero();  // of the cavity
  double turn = 0;                    // of the cavity, about y
  SpinSpec goal;

  explicit Block(const Vector3d& s) : size(s) { goal.print.wall_mm = 3; }
  Vector3d middle() const { return {0, 0, size.z() / 2}; }
  Mesh outer() const { return test::moved(test::subdivided(test::box(-size / 2, size / 2), 2), middle()); }
  Mesh mesh() const {
    const Mesh inner =
        test::rotated(test::box(-cavity / 2, cavity / 2), Eigen::AngleAxisd(turn, Vector3d::UnitY()).toRotationMatrix());
    return test::hollow(outer(), test::moved(inner, middle() + shift));
  }
  MassProperties expected() const {
    const auto at = [this](const Vector3d& s, const Vector3d& c) {
      return test::box_moments(middle() + c - s / 2, middle() + c + s / 2);
    };
    return mass_properties(at(size, Vector3d::Zero()) - at(cavity, shift), goal.print.density_g_cm3);
  }
  SpinVerdict judged(const Limits& limits = {}) const {
    const Mesh original = outer();
    return verify(mesh(), &original, goal, limits);
  }
};

Block flat() { return Block({60, 50, 20}); }
Block middling() { return Block({60, 25, 40}); }
Block tall() { return Block({28, 24, 60}); }

Names all(const Verdict& verdict) {
  Names names;
  for (const Criterion& c : verdict.criteria) names.push_back(c.name);
  return names;
}

const Criterion& criterion(const Verdict& verdict, const std::string& name) {
  const auto found =
      std::find_if(verdict.criteria.begin(), verdict.criteria.end(), [&](const Criterion& c) { return c.name == name; });
  if (found == verdict.criteria.end()) throw std::out_of_range(name);
  return *found;
}

TEST(SpinStateOf, AHollowBlockByHand) {
  const Block block = flat();
  const SpinState state = spin_state_of(block.mesh(), block.goal);
  const MassProperties expected = block.expected();
  EXPECT_NEAR(state.body.mass_g, 1.24e-3 * (60 * 50 * 20 - 20 * 16 * 8), 1e-10);
  EXPECT_TRUE(test::near(state.body.inertia_g_mm2, expected.inertia_g_mm2, 1e-9 * expected.inertia_g_mm2.norm()));
  EXPECT_NEAR(state.offset_mm, 0, 1e-12);
  EXPECT_NEAR(state.height_mm, 10, 1e-12);
  EXPECT_NEAR(state.axis_angle_rad, 0, 1e-7);
  EXPECT_EQ(state.axis_class, AxisClass::largest);
  const Vector3d moments = expected.inertia_g_mm2.diagonal();
  EXPECT_NEAR(state.ratio_larger, moments.z() / moments.y(), 1e-12);
  EXPECT_NEAR(state.ratio_smaller, moments.z() / moments.x(), 1e-12);
  // Largest axis on a sliding tip: Spin-It, Eq. 1.
  ASSERT_EQ(state.sliding.size(), 1u);
  EXPECT_NEAR(state.sliding[0].lo_rad_s, std::sqrt(expected.mass_g * 9806.65 * 10 / (moments.z() - moments.y())), 1e-9);
  EXPECT_EQ(state.sliding[0].hi_rad_s, std::numeric_limits<double>::infinity());
}

TEST(SpinStateOf, DoesNotDependOnTheFrameOrOnSharedVertices) {
  Block block = flat();
  block.shift = {1, 0.5, 0.2};
  block.turn = 0.1;
  const SpinState here = spin_state_of(block.mesh(), block.goal);
  for (int seed = 1; seed <= 4; ++seed) {
    const Eigen::Affine3d T = Eigen::Translation3d(300, -20, 70) * Eigen::Affine3d(test::random_rotation(seed));
    SpinSpec goal = block.goal;
    goal.up = 5 * (T.linear() * Vector3d::UnitZ());
    put(goal, T * Vector3d::Zero());
    const SpinState there = spin_state_of(test::soup(transformed(block.mesh(), T)), goal);
    EXPECT_NEAR(there.offset_mm, here.offset_mm, 1e-9);
    EXPECT_NEAR(there.height_mm, here.height_mm, 1e-9);
    EXPECT_NEAR(there.axis_angle_rad, here.axis_angle_rad, 1e-9);
    EXPECT_NEAR(there.ratio_larger, here.ratio_larger, 1e-9);
    ASSERT_EQ(there.sliding.size(), here.sliding.size());
    EXPECT_NEAR(there.sliding[0].lo_rad_s, here.sliding[0].lo_rad_s, 1e-7);
  }
}

TEST(VerifySpin, TheFlatBlockPasses) {
  const SpinVerdict verdict = flat().judged();
  EXPECT_EQ(failed(verdict), Names());
  EXPECT_TRUE(verdict.pass());
  EXPECT_EQ(verdict.cavities, 1u);
  EXPECT_NEAR(verdict.smallest_wall_mm, 6, 1e-12);
  EXPECT_EQ(verdict.outer_deviation_mm, 0);
  EXPECT_TRUE(verdict.notes.empty());
  EXPECT_EQ(all(verdict), Names({"closed", "outer_unchanged", "no_islands", "no_crossings", "wall", "offset", "axis_angle",
                                 "axis_class", "stable_speeds", "simulated_tilt"}));
}

// Mass and moments of inertia grow alike with more plastic everywhere, so that the speeds stay; the scatter of the centre of mass
// makes the axis lean, by e / l over 1.44 - 1 at 1.2 times the lowest speed, less where the other lateral moment decides.
TEST(VerifySpin, TellsWhatThePrintsScatterDoes) {
  Block block = flat();
  const SpinVerdict verdict = block.judged();
  EXPECT_EQ(verdict.scatter_mm, 0.1);
  EXPECT_NEAR(verdict.scatter_tilt_rad.value(), 0.1 / 10 / (1.2 * 1.2 - 1), 1e-9);
  EXPECT_EQ(verdict.meaning.size(), 2u);
  block.goal.print.density_g_cm3 *= 1.03;
  const SpinVerdict heavier = block.judged();
  EXPECT_NEAR(heavier.state.sliding[0].lo_rad_s, verdict.state.sliding[0].lo_rad_s, 1e-9);
  EXPECT_NEAR(*heavier.scatter_tilt_rad, *verdict.scatter_tilt_rad, 1e-12);
  // One that is not balanced leans anyway.
  block = flat();
  block.turn = 0.5;
  EXPECT_FALSE(block.judged().scatter_tilt_rad.has_value());
  ASSERT_EQ(block.judged().meaning.size(), 1u);
  EXPECT_NE(block.judged().meaning[0].find("wobbles at any speed"), std::string::npos);
  block = flat();
  block.shift = {8, 0, 0};
  ASSERT_EQ(block.judged().meaning.size(), 1u);
  EXPECT_NE(block.judged().meaning[0].find("mm beside the axis"), std::string::npos);
  block.shift = {0, 0, 3};
  block.goal.yoyo = true;
  put(block.goal, block.middle());
  EXPECT_NE(block.judged().meaning[0].find("mm beside the centre"), std::string::npos) << block.judged().meaning[0];
}

TEST(VerifySpin, AMiddleAxisFailsWhicheverIsPreferred) {
  Block block = middling();
  for (const AxisClass prefer : {AxisClass::largest, AxisClass::smallest}) {
    block.goal.prefer = prefer;
    const SpinVerdict verdict = block.judged();
    EXPECT_EQ(verdict.state.axis_class, AxisClass::middle);
    EXPECT_FALSE(criterion(verdict, "axis_class").pass());
    for (const std::string& name : failed(verdict)) EXPECT_TRUE(name == "axis_class" || name == "stable_speeds") << name;
    ASSERT_EQ(verdict.notes.size(), 1u);
    EXPECT_NE(verdict.notes[0].find("middle"), std::string::npos);
  }
}

TEST(VerifySpin, ASmallestAxisPassesOnlyWhenItIsPreferred) {
  Block block = tall();
  const SpinVerdict largest = block.judged();
  EXPECT_EQ(largest.state.axis_class, AxisClass::smallest);
  EXPECT_EQ(failed(largest), Names({"axis_class"}));
  EXPECT_EQ(largest.notes.size(), 1u);
  block.goal.prefer = AxisClass::smallest;
  const SpinVerdict smallest = block.judged();
  EXPECT_EQ(failed(smallest), Names());
  EXPECT_TRUE(smallest.notes.empty());
  EXPECT_NEAR(criterion(smallest, "axis_class").value, smallest.state.ratio_smaller, 0);
  Block other = flat();
  other.goal.prefer = AxisClass::smallest;
  EXPECT_EQ(failed(other.judged()), Names({"axis_class"}));
}

TEST(VerifySpin, EqualMomentsAreNotTheLargest) {
  Block cube({30, 30, 30});
  cube.cavity = {10, 10, 10};
  for (const AxisClass prefer : {AxisClass::largest, AxisClass::smallest}) {
    cube.goal.prefer = prefer;
    EXPECT_FALSE(criterion(cube.judged(), "axis_class").pass());
  }
}

TEST(VerifySpin, CavityOffTheAxisFailsOffset) {
  Block block = flat();
  const double share = 20. * 16 * 8 / (60 * 50 * 20 - 20 * 16 * 8);
  const double diagonal = block.size.norm();
  const double limit = 1e-3 * diagonal / share;
  block.shift = {0.99 * limit, 0, 0};
  EXPECT_EQ(failed(block.judged()), Names());
  block.shift = {0, 1.01 * limit, 0};
  const SpinVerdict verdict = block.judged();
  EXPECT_EQ(failed(verdict), Names({"offset"}));
  EXPECT_NEAR(criterion(verdict, "offset").value, 1.01e-3, 1e-9);
  block.shift = {0, 0, 1};  // along the axis is no offset
  EXPECT_EQ(failed(block.judged()), Names());
}

TEST(VerifySpin, TiltedCavityFailsAxisAngle) {
  Block block = flat();
  block.cavity = {24, 16, 6};
  block.turn = 0.3;
  const SpinVerdict verdict = block.judged();
  EXPECT_EQ(failed(verdict), Names({"axis_angle"}));
  // tan(2 angle) = 2 Ixz / (Izz - Ixx), with what the cavity takes away.
  const auto lateral = [&](const Vector3d& s) { return s.prod() / 12 * (s.y() * s.y() + s.z() * s.z()); };
  const auto axial = [&](const Vector3d& s) { return s.prod() / 12 * (s.x() * s.x() + s.y() * s.y()); };
  const double a = lateral(block.cavity);
  const double b = axial(block.cavity);
  const double c = std::cos(0.3);
  const double s = std::sin(0.3);
  const double xz = (b - a) * s * c;
  const double zz = axial(block.size) - (a * s * s + b * c * c);
  const double xx = lateral(block.size) - (a * c * c + b * s * s);
  EXPECT_NEAR(verdict.state.axis_angle_rad, std::abs(std::atan2(2 * xz, zz - xx) / 2), 1e-9);
  Limits lenient;
  lenient.axis_angle_rad = 1.01 * verdict.state.axis_angle_rad;
  EXPECT_EQ(failed(block.judged(lenient)), Names());
}

TEST(VerifySpin, ThinWallFailsWall) {
  Block block = flat();
  block.goal.print.wall_mm = 6.2;
  EXPECT_EQ(failed(block.judged()), Names({"wall"}));
  block.goal.print.wall_mm = 6.1;  // 2 % are allowed
  EXPECT_EQ(failed(block.judged()), Names());
  block.goal.print.wall_mm = 0;
  EXPECT_THROW(criterion(block.judged(), "wall"), std::out_of_range);
}

TEST(VerifySpin, IslandFailsNoIslands) {
  const Block block = flat();
  const Mesh original = block.outer();
  const Mesh speck = test::moved(test::box({-1, -1, -1}, {1, 1, 1}), block.middle());
  EXPECT_EQ(failed(verify(test::merged({block.mesh(), speck}), &original, block.goal)), Names({"no_islands"}));
}

TEST(VerifySpin, MovedVertexFailsOuterUnchanged) {
  const Block block = flat();
  Mesh original = block.outer();
  original.vertices[0] += Vector3d(-0.01, -0.01, -0.01);
  EXPECT_EQ(failed(verify(block.mesh(), &original, block.goal)), Names({"outer_unchanged"}));
}

TEST(VerifySpin, MissingTriangleFailsClosed) {
  const Block block = flat();
  const Mesh original = block.outer();
  Mesh mesh = block.mesh();
  mesh.triangles.pop_back();
  const SpinVerdict verdict = verify(mesh, &original, block.goal);
  EXPECT_FALSE(criterion(verdict, "closed").pass());
  EXPECT_EQ(verdict.bad_edges, 3u);
}

TEST(VerifySpin, PartsBelowTheContactPointAreTold) {
  Block block = flat();
  put(block.goal, {0, 0, 4});
  const SpinVerdict verdict = block.judged();
  EXPECT_TRUE(verdict.pass());
  EXPECT_NEAR(verdict.state.height_mm, 6, 1e-12);
  ASSERT_EQ(verdict.notes.size(), 1u);
  EXPECT_NE(verdict.notes[0].find("4 mm below"), std::string::npos) << verdict.notes[0];
}

TEST(VerifySpin, AYoyoIsJudgedByItsCentre) {
  Block block = flat();
  block.goal.yoyo = true;
  put(block.goal, block.middle());
  const SpinVerdict good = block.judged();
  EXPECT_EQ(failed(good), Names());
  EXPECT_EQ(all(good), Names({"closed", "outer_unchanged", "no_islands", "no_crossings", "wall", "offset", "centre", "axis_angle",
                              "axis_class", "stable_speeds", "simulated_tilt"}));
  ASSERT_EQ(good.state.sliding.size(), 1u);
  EXPECT_EQ(good.state.sliding[0].lo_rad_s, 0);
  const double share = 20. * 16 * 8 / (60 * 50 * 20 - 20 * 16 * 8);
  block.shift = {0, 0, 1.01e-3 * block.size.norm() / share};
  EXPECT_EQ(failed(block.judged()), Names({"centre"}));
  block.shift = {block.shift.z(), 0, 0};
  EXPECT_EQ(failed(block.judged()), Names({"offset", "centre"}));
}

TEST(VerifySpin, AYoyoOnItsMiddleAxisIsNeverStable) {
  Block block = middling();
  block.goal.yoyo = true;
  put(block.goal, block.middle());
  EXPECT_EQ(failed(block.judged()), Names({"axis_class", "stable_speeds"}));
  block = tall();
  block.goal.yoyo = true;
  put(block.goal, block.middle());
  block.goal.prefer = AxisClass::smallest;
  EXPECT_EQ(failed(block.judged()), Names());
}

TEST(VerifySpin, TheSameBitsForAnyNumberOfThreads) {
  Block block = flat();
  block.shift = {0.3, 0.1, 0.2};
  SpinVerdict one;
  tbb::task_arena(1).execute([&] { one = block.judged(); });
  const SpinVerdict many = block.judged();
  ASSERT_EQ(one.criteria.size(), many.criteria.size());
  for (std::size_t i = 0; i < one.criteria.size(); ++i)
    EXPECT_EQ(one.criteria[i].value, many.criteria[i].value) << one.criteria[i].name;
}

TEST(VerifySpin, RefusesGoalsAndMeshesThatMakeNoSense) {
  const Block block = flat();
  const auto code = [](const Mesh& mesh, const SpinSpec& goal) {
    try {
      verify(mesh, nullptr, goal);
    } catch (const Error& e) {
      return e.code();
    }
    return ErrorCode::internal;
  };
  SpinSpec goal = block.goal;
  goal.up.setZero();
  EXPECT_EQ(code(block.mesh(), goal), ErrorCode::usage);
  goal = block.goal;
  goal.prefer = AxisClass::middle;
  EXPECT_EQ(code(block.mesh(), goal), ErrorCode::usage);
  goal = block.goal;
  goal.print.density_g_cm3 = -1;
  EXPECT_EQ(code(block.mesh(), goal), ErrorCode::usage);
  EXPECT_EQ(code(Mesh(), block.goal), ErrorCode::input);
  EXPECT_EQ(code(test::flipped(block.mesh()), block.goal), ErrorCode::input);
}

TEST(VerifySpin, CanBeInterrupted) {
  const Block block = flat();
  Progress progress;
  progress.cancelled = [] { return true; };
  EXPECT_THROW(verify(block.mesh(), nullptr, block.goal, {}, progress), Error);
}

}  // namespace
}  // namespace rayrep
