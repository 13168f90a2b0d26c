#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>

#include "rayrep/base/error.h"
#include "rayrep/io/mesh_io.h"
#include "rayrep/judge/verify.h"
#include "rayrep/make/hollow.h"
#include "rayrep/solve/goals.h"
#include "runs.h"
#include "solids.h"

namespace rayrep {
namespace {

using namespace test;

Pose stand(const Eigen::Vector3d& up) { return {.kind = Pose::Kind::stands, .up = up}; }
Pose hang(const Eigen::Vector3d& point, const Eigen::Vector3d& up) {
  return {.kind = Pose::Kind::hangs, .up = up, .point_mm = point};
}
Pose afloat(const Eigen::Vector3d& up) { return {.kind = Pose::Kind::floats, .up = up}; }

const Eigen::Vector3d kX = Eigen::Vector3d::UnitX();
const Eigen::Vector3d kY = Eigen::Vector3d::UnitY();
const Eigen::Vector3d kZ = Eigen::Vector3d::UnitZ();

Job<PoseSpec> job(std::vector<Pose> poses) {
  Job<PoseSpec> options;
  options.spec.poses = std::move(poses);
  options.hollow.resolution = 40;
  options.hollow.as_stored = [](const Mesh& mesh) { return as_stored("x.stl", mesh); };
  return options;
}

/// Makes it, writes it, reads it back and has it judged.
PoseVerdict expect_rests(const Mesh& solid, const Job<PoseSpec>& options) {
  const Outcome<PoseSpec> result = hollowed(solid, options);
  const auto path = own_file("pose.stl");
  write_mesh(path, result.delivery.body());
  const PoseVerdict verdict = verify(read_mesh(path).mesh, &solid, result.found);
  for (const Criterion& c : verdict.criteria)
    EXPECT_TRUE(c.pass()) << path << ": " << c.name << " " << c.value << " limit " << c.limit;
  if (verdict.pass()) std::filesystem::remove(path);
  return verdict;
}

double figure(const HollowResult& result, const std::string& name) {
  for (const Figure& f : result.proof_figures)
    if (f.name == name) return std::get<double>(f.value);
  ADD_FAILURE() << "no " << name;
  return 0;
}

Eigen::Vector3d centre_of(const HollowResult& result) {
  const Moments s = mesh_moments(result.delivery.body());
  return s.segment<3>(MX) / s[M1];
}

/// What is low when it stands is not when it lies.
Mesh bracket() { return polycubes({{0, 0, 0}, {0, 0, 1}, {0, 0, 2}, {1, 0, 0}}, 14); }

TEST(Pose, OneFootIsStandingAsSafelyAsItCan) {
  const Mesh solid = polycubes({{0, 0, 0}, {0, 0, 1}, {0, 0, 2}, {1, 0, 2}}, 20);
  Job<StandSpec> options;
  options.hollow = job({}).hollow;
  options.spec.objective = StandSpec::Objective::tip_angle;
  const Outcome<StandSpec> alone = hollowed(solid, options);
  const double by_search = verify(alone.delivery.body(), &solid, alone.found).state.smallest_tipping_angle_rad;
  const double found = expect_rests(solid, job({stand(kZ)})).smallest_tipping_angle_rad;
  EXPECT_GE(found, by_search - 1e-3);  // which leaves some room
  EXPECT_LT(found, by_search + 0.02);
}

TEST(Pose, ABoxOnTwoSidesIsAsSafeAsOnTheWorseOne) {
  // On its end it tips first, and what helps it there does not harm it on its side.
  const Mesh solid = box({0, 0, 0}, {20, 20, 40});
  const PoseVerdict one = expect_rests(solid, job({stand(kZ)}));
  const PoseVerdict two = expect_rests(solid, job({stand(kZ), stand(kX)}));
  EXPECT_NEAR(two.smallest_tipping_angle_rad, one.smallest_tipping_angle_rad, 2e-3);
  EXPECT_NEAR(two.poses[1].criteria[1].value, kPi / 4, 2e-3);
}

TEST(Pose, OnBothEndsTheMiddleIsBest) {
  const Mesh solid = box({0, 0, 0}, {20, 24, 40});
  const Outcome<PoseSpec> result = hollowed(solid, job({stand(kZ), stand(-kZ)}));
  const Eigen::Vector3d c = centre_of(result);  // in y there is room
  EXPECT_NEAR(c.x(), 10, 2e-4);
  EXPECT_NEAR(c.z(), 20, 2e-4);
  EXPECT_NEAR(figure(result, "largest_possible_rad"), std::atan2(10, 20), 1e-6);
  const PoseVerdict verdict = expect_rests(solid, job({stand(kZ), stand(-kZ)}));
  EXPECT_NEAR(verdict.smallest_tipping_angle_rad, std::atan2(10, 20), 2e-4);
}

TEST(Pose, TheBoundHoldsForWhatIsDelivered) {
  for (const auto& poses : {std::vector{stand(kZ), stand(kX)}, std::vector{stand(kZ), stand(-kY), stand(kX)}}) {
    const Mesh solid = bracket();
    const Outcome<PoseSpec> result = hollowed(solid, job(poses));
    const double bound = figure(result, "largest_possible_rad");
    EXPECT_NEAR(figure(result, "smallest_tipping_angle_rad"), bound, 2e-3);
    EXPECT_LE(figure(result, "smallest_tipping_angle_rad"), bound + 1e-6);
    const PoseVerdict verdict = verify(result.delivery.body(), &solid, result.found);
    EXPECT_TRUE(verdict.pass());
    EXPECT_NEAR(verdict.smallest_tipping_angle_rad, bound, 3e-3);
  }
}

TEST(Pose, TheOrderDoesNotMatter) {
  const Mesh solid = bracket();
  const Outcome<PoseSpec> one = hollowed(solid, job({stand(kZ), stand(kX)}));
  const Outcome<PoseSpec> other = hollowed(solid, job({stand(kX), stand(kZ)}));
  EXPECT_NEAR(figure(one, "largest_possible_rad"), figure(other, "largest_possible_rad"), 1e-5);
  EXPECT_LT((centre_of(one) - centre_of(other)).norm(), 0.02);
}

TEST(Pose, HangsFromAPointOverItsCorner) {
  // Half full at most: the vertical passes the middle by 3 and 2 mm.
  const Mesh solid = box({0, 0, 0}, {20, 20, 20});
  const Eigen::Vector3d point(11.5, 9, 22);
  const PoseVerdict verdict = expect_rests(solid, job({hang(point, kZ)}));
  const HangState state = hang_state_of(verdict.body, point, kZ);
  EXPECT_LT(state.beside_mm, 1e-3);
  EXPECT_GT(state.below_mm, 13);
  EXPECT_EQ(verdict.criteria.back().name, "pose_1_hangs");
}

TEST(Pose, HangsAndStandsOnOneInside) {
  const Mesh solid = box({0, 0, 0}, {20, 20, 40});
  const Eigen::Vector3d point(10, 11, 44);
  const PoseVerdict verdict = expect_rests(solid, job({stand(kZ), hang(point, kZ)}));
  EXPECT_LT(hang_state_of(verdict.body, point, kZ).beside_mm, 1e-3);
  // The nearest edge is at 9 mm now.
  const Eigen::Vector3d& c = verdict.body.centre_of_mass_mm;
  EXPECT_NEAR(verdict.smallest_tipping_angle_rad, std::atan2(9, c.z()), 1e-3);
  EXPECT_LT(c.z(), 17);
}

TEST(Pose, FloatsAndStands) {
  const Mesh solid = box({0, 0, 0}, {40, 40, 20});
  const Job<PoseSpec> options = job({stand(kZ), afloat(kZ)});
  const Outcome<PoseSpec> result = hollowed(solid, options);
  ASSERT_TRUE(result.found.poses[1].waterline_mm);
  const PoseVerdict verdict = expect_rests(solid, options);
  EXPECT_NEAR(verdict.body.mass_g, 1600 * *result.found.poses[1].waterline_mm * 1e-3, 1e-3);
  EXPECT_GT(verdict.smallest_tipping_angle_rad, std::atan2(20, 10));
  // At a given waterline, too.
  Job<PoseSpec> given = options;
  given.spec.poses[1].waterline_mm = 9;
  EXPECT_NEAR(expect_rests(solid, given).body.mass_g, 14.4, 1e-2);
}

TEST(Pose, ARolyPolyRightsItselfFromAnyTilt) {
  const Eigen::Vector3d up = Eigen::Vector3d(1, -2, 2) / 3;
  const PoseVerdict verdict = expect_rests(icosphere(20, 4), job({{.kind = Pose::Kind::rights, .up = up}}));
  EXPECT_EQ(verdict.criteria.back().name, "pose_1_righted");
  EXPECT_LT(verdict.body.centre_of_mass_mm.dot(up), -2);
  EXPECT_LT(verdict.body.centre_of_mass_mm.cross(up).norm(), 0.5);
}

TEST(Pose, TheLightestThatStandsSoSafely) {
  const Mesh solid = box({0, 0, 0}, {20, 20, 40});
  Job<PoseSpec> options = job({stand(kZ), stand(kX)});
  double lighter = 0;
  for (const double degrees : {20.0, 28.0, 32.0, 34.0}) {
    options.spec.least_tip_deg = degrees;
    const Outcome<PoseSpec> result = hollowed(solid, options);
    const PoseVerdict verdict = verify(result.delivery.body(), &solid, result.found);
    EXPECT_TRUE(verdict.pass());
    EXPECT_GT(verdict.smallest_tipping_angle_rad, degrees * kPi / 180 - 1e-5);
    EXPECT_GE(verdict.body.mass_g, lighter - 1e-3);
    lighter = verdict.body.mass_g;
    EXPECT_NEAR(figure(result, "mass_g"), figure(result, "smallest_possible_g"), 0.01 * verdict.body.mass_g);
    // Filled to t above its floor its centre lies 10 mm over the tangent up: by bisection.
    const double w = 1.2;
    const auto filled = [&](double t) {
      return Moments(box_moments({0, 0, 0}, {20, 20, 40}) - box_moments({w, w, t}, {20 - w, 20 - w, 40 - w}));
    };
    double lo = w;
    double hi = 14;
    for (int n = 0; n < 50; ++n) {
      const double t = 0.5 * (lo + hi);
      const Moments s = filled(t);
      (s[MZ] / s[M1] > 10 / std::tan(degrees * kPi / 180) ? lo : hi) = t;
    }
    EXPECT_NEAR(verdict.body.mass_g, 1.24e-3 * filled(hi)[M1], 0.01 * verdict.body.mass_g);
  }
  options.spec.least_tip_deg = 40;
  const std::string text = message_of([&] { hollowed(solid, options); }, ErrorCode::goal);
  EXPECT_TRUE(mentions(text, {"It cannot stand so safely", "35.", "40.00 degrees"})) << text;
}

std::string refusal(const Mesh& solid, const Job<PoseSpec>& options) {
  return message_of([&] { hollowed(solid, options); }, ErrorCode::goal);
}

TEST(Pose, ContradictionsAreToldWithWhatEachPoseCosts) {
  const Mesh solid = box({0, 0, 0}, {20, 20, 40});
  // Two verticals that pass each other.
  const std::string apart = refusal(solid, job({hang({10, 10, 45}, kZ), hang({25, 11.5, 20}, kX)}));
  EXPECT_TRUE(mentions(apart, {"contradict", "1.50 mm beside each other", "Without hanging from (10, 10, 45) mm with z up"}))
      << apart;
  // A point at the corner, and a foot.
  const std::string corner = refusal(solid, job({stand(kZ), hang({1, 1, 45}, kZ)}));
  EXPECT_TRUE(mentions(corner, {"contradict", "by itself it is out of reach hanging from (1, 1, 45) mm", "tips over at 3"}))
      << corner;
  EXPECT_TRUE(mentions(refusal(solid, job({hang({1, 1, 45}, kZ)})), {"It cannot be made for hanging", "beside the vertical"}));
  EXPECT_TRUE(mentions(refusal(solid, job({stand({1, 1, 1})})), {"It cannot be standing with", "a point only"}));
  Job<PoseSpec> heavy = job({afloat(kZ), afloat(kX)});
  heavy.spec.poses[0].waterline_mm = 20;
  heavy.spec.poses[1].waterline_mm = 5;
  EXPECT_TRUE(mentions(refusal(solid, heavy), {"waterlines contradict", "8.00 g", "4.00 g"}));
  heavy.spec.poses.pop_back();
  heavy.spec.poses[0].waterline_mm = 1;
  EXPECT_TRUE(mentions(refusal(solid, heavy), {"It cannot float like that", "0.40 g"}));
}

Pose spin(const Eigen::Vector3d& up, const SpinAxis& axis = {}) { return {.kind = Pose::Kind::spins, .up = up, .axis = axis}; }

SpinAxis through(const Eigen::Vector3d& point) { return {.through = SpinAxis::Through::point, .point_mm = point}; }

/// What the certificate of a top says.
double certified(const HollowResult& result, const std::string& name) {
  for (const Figure& f : result.proof_figures)
    if (f.name == "certificate")
      for (const auto& [key, value] : std::get<Record>(f.value))
        if (key == name) return std::holds_alternative<bool>(value) ? std::get<bool>(value) : std::get<double>(value);
  ADD_FAILURE() << "no " << name;
  return 0;
}

/// The measure of spin of what was delivered, about the vertical through a point.
double measure_of(const Mesh& mesh, const Mesh& solid, const Eigen::Vector3d& contact) {
  const Moments s = translated(mesh_moments(mesh), -contact);
  return spin_goal({}, true, false, mesh_moments(solid)[M1], bounding_box(solid).diagonal().norm()).objective(s);
}

TEST(PoseWithATop, WhatDoesNotHoldItBackIsTheTopOfSpin) {
  const Mesh solid = box({0, 0, 0}, {30, 34, 12});
  const Job<PoseSpec> options = job({spin(kZ), stand(kZ)});
  const Outcome<PoseSpec> both = hollowed(solid, options);
  Job<SpinSpec> alone;
  alone.hollow = options.hollow;
  alone.spec.certify = true;
  const Outcome<SpinSpec> top = hollowed(solid, alone);
  EXPECT_EQ(certified(both, "closed"), 1);
  EXPECT_NEAR(measure_of(both.delivery.body(), solid, {15, 17, 0}), measure_of(top.delivery.body(), solid, {15, 17, 0}), 2e-4);
  // The judge says of the same file what the judge of tops says.
  const PoseVerdict verdict = verify(both.delivery.body(), &solid, both.found);
  EXPECT_TRUE(verdict.pass());
  SpinSpec spec;
  spec.axis = through({15, 17, 0});
  const SpinVerdict judged = verify(both.delivery.body(), &solid, spec);
  ASSERT_TRUE(judged.pass());
  ASSERT_GE(verdict.poses[0].criteria.size(), 5u);
  for (const Criterion& c : verdict.poses[0].criteria) {
    const auto same =
        std::find_if(judged.criteria.begin(), judged.criteria.end(), [&](const Criterion& other) { return other.name == c.name; });
    ASSERT_NE(same, judged.criteria.end()) << c.name;
    EXPECT_NEAR(c.value, same->value, 1e-9) << c.name;
  }
  EXPECT_EQ(verdict.criteria.back().name, "least_tip");
  expect_rests(solid, options);
}

TEST(PoseWithATop, ANarrowFootKeepsItsCentreLow) {
  // Its foot reaches 5 cos(pi/32) mm to an edge: so high at most for the tipping angle.
  const Mesh solid = frustum(5, 18, 16, 32);
  Job<PoseSpec> options = job({stand(kZ), spin(kZ)});
  options.spec.contact_tolerance_mm = 1e-6;
  const double free_mm = centre_of(hollowed(solid, options)).z();
  const double reach_mm = 5 * std::cos(kPi / 32);
  const double angle = std::atan2(reach_mm, free_mm - 0.6) * 180 / kPi;  // 0.6 mm lower than it would like
  options.spec.least_tip_deg = angle;
  const Outcome<PoseSpec> held = hollowed(solid, options);
  EXPECT_NEAR(centre_of(held).z(), free_mm - 0.6, 1e-3);
  EXPECT_NEAR(certified(held, "highest_mm"), free_mm - 0.6, 1e-5);
  EXPECT_EQ(certified(held, "closed"), 1);
  EXPECT_GE(measure_of(held.delivery.body(), solid, {0, 0, 0}), certified(held, "lower_bound") - 1e-3);
  const PoseVerdict verdict = expect_rests(solid, options);
  EXPECT_NEAR(verdict.smallest_tipping_angle_rad, angle * kPi / 180, 1e-4);
}

TEST(PoseWithATop, HangsFromAPointOfItsAxis) {
  const Mesh solid = frustum(6, 18, 14, 32);
  const double free_mm = centre_of(hollowed(solid, job({stand(kZ), spin(kZ)}))).z();
  // A point in it, so low that its centre of mass has to go down.
  const Eigen::Vector3d point(0, 0, free_mm + 0.01 * bounding_box(solid).diagonal().norm() - 0.5);
  const Job<PoseSpec> options = job({hang(point, kZ), spin(kZ)});
  const PoseVerdict verdict = expect_rests(solid, options);
  EXPECT_NEAR(verdict.body.centre_of_mass_mm.z(), free_mm - 0.5, 1e-3);
  // Across the axis the height is that of the point.
  const Eigen::Vector3d beside(-30, 0, free_mm - 0.3);
  const PoseVerdict lying = expect_rests(solid, job({hang(beside, -kX), spin(kZ)}));
  EXPECT_NEAR(lying.body.centre_of_mass_mm.z(), free_mm - 0.3, 1e-3);
}

TEST(PoseWithATop, FloatsAtAWaterlineOfItsOwnOrAGivenOne) {
  const Mesh solid = cylinder(20, 14, 48);
  Job<PoseSpec> options = job({afloat(kZ), spin(kZ)});
  const Outcome<PoseSpec> result = hollowed(solid, options);
  ASSERT_TRUE(result.found.poses[0].waterline_mm);
  expect_rests(solid, options);
  options.spec.poses[0].waterline_mm = 9;
  const PoseVerdict given = expect_rests(solid, options);
  const double area = 0.5 * 48 * 400 * std::sin(2 * kPi / 48);
  EXPECT_NEAR(given.body.mass_g, 1e-3 * area * 9, 1e-2);
}

TEST(PoseWithATop, StandsOnTwoSides) {
  const Mesh solid = box({0, 0, 0}, {26, 26, 16});
  const PoseVerdict verdict = expect_rests(solid, job({spin(kZ), stand(kZ), stand(kX)}));
  EXPECT_GT(verdict.smallest_tipping_angle_rad, 3 * kPi / 180);
}

TEST(PoseWithATop, ContradictionsTellWhatEachPoseLeavesOfTheAxis) {
  const Mesh solid = frustum(2, 18, 18, 32);
  Job<PoseSpec> steep = job({stand(kZ), spin(kZ)});
  steep.spec.contact_tolerance_mm = 1e-6;
  steep.spec.least_tip_deg = 25;
  const std::string narrow = refusal(solid, steep);
  EXPECT_TRUE(mentions(narrow, {"contradict each other", "standing with z up (tipping over at 25.00 degrees): at most 4.2",
                                "balanced about the axis: ", "It can be made with --min-tip ",
                                "Without standing with z up it spins "
                                "with Izz",
                                "Without spinning on its lowest point with z up it tips over at"}))
      << narrow;
  // With what is advised it can.
  const std::size_t at = narrow.find("--min-tip ") + 10;
  steep.spec.least_tip_deg = std::stod(narrow.substr(at));
  expect_rests(solid, steep);
  // Beside the axis.
  const std::string beside = refusal(solid, job({hang({1, 0, 30}, kZ), spin(kZ)}));
  EXPECT_TRUE(mentions(beside, {"hanging from (1, 0, 30) mm with z up: nowhere, the vertical that it needs passes 1.00 mm beside"}))
      << beside;
  // No top at all, whatever else it is.
  EXPECT_TRUE(mentions(refusal(box({0, 0, 0}, {10, 10, 40}), job({stand(kZ), spin(kZ)})),
                       {"times the larger lateral moment", "tumbles about an axis of middle moment"}));
  EXPECT_TRUE(
      mentions(refusal(solid, job({stand(kZ), spin(kZ, through({17, 0, 18}))})), {"It cannot be balanced about this axis"}));
}

TEST(PoseWithATop, SaysWhatMakesNoSense) {
  const auto usage = [](const Job<PoseSpec>& options) {
    return message_of([&] { hollowed(box({0, 0, 0}, {20, 20, 10}), options); }, ErrorCode::usage);
  };
  EXPECT_TRUE(mentions(usage(job({spin(kZ)})), {"rayrep spin", "--stand UP"}));
  EXPECT_TRUE(mentions(usage(job({spin(kZ), spin(kX)})), {"give --spin once"}));
  EXPECT_TRUE(
      mentions(usage(job({spin(kZ, {.through = SpinAxis::Through::best}), stand(kZ)})), {"--spin UP:auto is not searched"}));
  EXPECT_TRUE(mentions(usage(job({spin(kX, {.through = SpinAxis::Through::point, .leaves_below = true}), stand(kZ)})),
                       {"--spin UP:X,Y needs the up direction z or -z"}));
}

TEST(Pose, SaysWhatMakesNoSense) {
  const auto usage = [](const Job<PoseSpec>& options) {
    return message_of([&] { hollowed(box({0, 0, 0}, {20, 20, 40}), options); }, ErrorCode::usage);
  };
  EXPECT_TRUE(mentions(usage(job({})), {"--stand"}));
  Job<PoseSpec> rays = job({stand(kZ)});
  rays.hollow.solver = Solver::rays;
  EXPECT_TRUE(mentions(usage(rays), {"quadric"}));
  Job<PoseSpec> above = job({afloat(kZ)});
  above.spec.poses[0].waterline_mm = 50;
  EXPECT_TRUE(mentions(usage(above), {"highest point"}));
}

}  // namespace
}  // namespace rayrep
