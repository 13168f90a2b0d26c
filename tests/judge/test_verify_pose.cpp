#include <gtest/gtest.h>

#include <cmath>

#include "rayrep/judge/verify.h"
#include "runs.h"
#include "solids.h"

namespace rayrep {
namespace {

using namespace test;

const Eigen::Vector3d kX = Eigen::Vector3d::UnitX();
const Eigen::Vector3d kZ = Eigen::Vector3d::UnitZ();

PoseSpec spec_of(std::vector<Pose> poses) {
  PoseSpec spec;
  spec.poses = std::move(poses);
  return spec;
}

/// Every criterion of the goal's own verdict, at the end of that of the pose.
template <typename Verdict>
void expect_criteria_of(const PoseVerdict& poses, const Verdict& alone, const char* first, double relative = 1e-9) {
  std::size_t begin = 0;
  while (alone.criteria[begin].name != first) ++begin;
  for (std::size_t n = begin; n < alone.criteria.size(); ++n) {
    const std::string name = "pose_1_" + alone.criteria[n].name;
    const auto found =
        std::find_if(poses.criteria.begin(), poses.criteria.end(), [&](const Criterion& c) { return c.name == name; });
    ASSERT_NE(found, poses.criteria.end()) << name;
    EXPECT_NEAR(found->value, alone.criteria[n].value, relative * (1 + std::abs(found->value))) << name;
    EXPECT_EQ(found->limit, alone.criteria[n].limit);
    EXPECT_EQ(found->pass(), alone.criteria[n].pass());
  }
}

TEST(VerifyPose, JudgesAPoseAsItsOwnGoalDoes) {
  Mesh solid = rotated(frustum(15, 8, 30, 40), random_rotation(5));
  const Eigen::Vector3d up = random_rotation(5) * kZ;
  StandSpec stand;
  stand.up = up;
  expect_criteria_of(verify(solid, &solid, spec_of({{.kind = Pose::Kind::stands, .up = up}})), verify(solid, &solid, stand),
                     "supported");
  solid = rotated(box({0, 0, 0}, {40, 40, 10}), random_rotation(6));
  FloatSpec afloat;
  afloat.up = random_rotation(6) * kZ;
  afloat.print.density_g_cm3 = 0.5;
  PoseSpec spec = spec_of({{.kind = Pose::Kind::floats, .up = afloat.up}});
  spec.print.density_g_cm3 = 0.5;
  const PoseVerdict verdict = verify(solid, &solid, spec);
  EXPECT_TRUE(verdict.pass());
  expect_criteria_of(verdict, verify(solid, &solid, afloat), "mass_error");
  // A top that spins, and one that does not: solid, of each of the ways to name its axis.
  for (const SpinAxis& axis : {SpinAxis{}, SpinAxis{.through = SpinAxis::Through::centre_of_mass},
                               SpinAxis{.through = SpinAxis::Through::point, .point_mm = {3, 2, 0}}}) {
    SpinSpec spin;
    spin.up = afloat.up;
    spin.axis = axis;
    const PoseVerdict top =
        verify(solid, &solid,
               spec_of({{.kind = Pose::Kind::spins, .up = spin.up, .axis = axis}, {.kind = Pose::Kind::stands, .up = spin.up}}));
    const SpinVerdict alone = verify(solid, &solid, spin);
    EXPECT_EQ(alone.pass(), axis.through != SpinAxis::Through::point);
    EXPECT_EQ(top.pass(), alone.pass());
    expect_criteria_of(top, alone, "offset", 1e-6);  // what tumbles is simulated, too
  }
}

TEST(VerifyPose, HangsWhereItsCentreOfMassIsBelowItsPoint) {
  const Mesh solid = box({0, 0, 0}, {20, 20, 40});
  const Eigen::Vector3d c(10, 10, 20);
  for (const double tilt : {0.0, 0.5, 0.99, 1.01, 20.0, 100.0, 180.0}) {
    const double t = tilt * kPi / 180;
    const Eigen::Vector3d point = c + 30 * Eigen::Vector3d(std::sin(t), 0, std::cos(t));
    const HangState state = hang_state_of(mass_properties(solid, 1.24), point, 2 * kZ);
    EXPECT_NEAR(state.tilt_rad, t, 1e-12);
    EXPECT_NEAR(state.below_mm, 30 * std::cos(t), 1e-9);
    EXPECT_NEAR(state.beside_mm, 30 * std::sin(t), 1e-9);
    const PoseVerdict verdict = verify(solid, nullptr, spec_of({{.kind = Pose::Kind::hangs, .up = {}, .point_mm = point}}));
    EXPECT_EQ(verdict.pass(), tilt < 1) << tilt;
    EXPECT_EQ(failed(verdict), tilt < 1 ? Names{} : Names{"pose_1_hangs"});
  }
}

TEST(VerifyPose, TellsTheSmallestAngleOfAllAndWhichPoseFails) {
  const Mesh solid = box({0, 0, 0}, {20, 30, 40});
  PoseSpec spec = spec_of({{.kind = Pose::Kind::stands, .up = kX}, {.kind = Pose::Kind::stands, .up = kZ}});
  EXPECT_NEAR(verify(solid, nullptr, spec).smallest_tipping_angle_rad, std::atan2(10, 20), 1e-12);
  spec.poses.push_back({.kind = Pose::Kind::stands, .up = Eigen::Vector3d(0, 1, 1)});
  const PoseVerdict verdict = verify(solid, nullptr, spec);
  EXPECT_EQ(failed(verdict), (Names{"pose_3_supported", "pose_3_inside"}));
  EXPECT_EQ(verdict.poses.size(), 3u);
  EXPECT_TRUE(mentions(verdict.meaning[2], {"Pose 3, standing with (0, 0.707107, 0.707107) up: it does not stand"}))
      << verdict.meaning[2];
}

TEST(VerifyPose, OfAnOpenSurfaceNothingIsSaidOfThePoses) {
  Mesh open = box({0, 0, 0}, {20, 20, 40});
  open.triangles.pop_back();
  const PoseVerdict verdict = verify(open, nullptr, spec_of({{.kind = Pose::Kind::stands, .up = kZ}}));
  EXPECT_FALSE(verdict.pass());
  EXPECT_TRUE(verdict.poses.empty());
  EXPECT_EQ(verdict.goal, "pose");
}

}  // namespace
}  // namespace rayrep
