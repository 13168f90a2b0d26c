// Insides of several parts that rest in several states: theory.md (116), (117)

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <numbers>

#include "rayrep/base/error.h"
#include "rayrep/io/mesh_io.h"
#include "rayrep/judge/verify_mechanism.h"
#include "rayrep/make/balance.h"
#include "shapes.h"
#include "solids.h"

namespace rayrep::test {
namespace {

using Eigen::Affine3d;
using Eigen::Translation3d;
using Eigen::Vector3d;

constexpr double kDegree = std::numbers::pi / 180;

Pose rests(Pose::Kind kind, const Vector3d& up = Vector3d::UnitZ()) {
  Pose pose;
  pose.kind = kind;
  pose.up = up;
  return pose;
}

HollowOptions quick() {
  HollowOptions options;
  options.resolution = 60;
  options.as_stored = [](const Mesh& mesh) { return as_stored("x.stl", mesh); };
  return options;
}

/// A tower with an arm that is stretched out, hangs down in front of it, or lies on top.
Mechanism crane() {
  Mechanism crane;
  crane.parts = {{"tower", box({-15, -15, 0}, {15, 15, 60}), {}}, {"arm", box({0, -8, -8}, {70, 8, 8}), {}}};
  const Affine3d here = Affine3d::Identity();
  crane.states = {{"stretched", {here, Affine3d(Translation3d(15, 0, 50))}, rests(Pose::Kind::stands)},
                  {"folded", {here, Translation3d(-35, 0, 68) * Affine3d::Identity()}, rests(Pose::Kind::stands)}};
  return crane;
}

MechanismVerdict judged(Mechanism mechanism, const BalanceResult& result) {
  std::vector<const Mesh*> originals(mechanism.parts.size(), nullptr);
  const Mechanism asked = mechanism;
  for (std::size_t n = 0; n < originals.size(); ++n) originals[n] = &asked.parts[n].mesh;
  for (const BalancedPart& part : result.parts) mechanism.parts[part.part].mesh = part.delivery.body();
  return verify(mechanism, originals);
}

void expect_verified(const Mechanism& mechanism, const BalanceResult& result) {
  const MechanismVerdict verdict = judged(mechanism, result);
  EXPECT_TRUE(verdict.pass());
  ASSERT_EQ(verdict.states.size(), mechanism.states.size());
  for (const auto& list : {verdict.parts, std::vector<Verdict>(verdict.states.begin(), verdict.states.end())})
    for (const Verdict& v : list)
      for (const Criterion& c : v.criteria) EXPECT_TRUE(c.pass()) << v.headline << ": " << c.name << " " << c.value;
  EXPECT_NEAR(verdict.mass_g, result.mass_g, 1e-4 * result.mass_g);
  for (std::size_t k = 0; k < verdict.states.size(); ++k) {
    if (mechanism.states[k].rests.kind != Pose::Kind::stands) continue;
    EXPECT_NEAR(verdict.states[k].smallest_tipping_angle_rad, result.tipping_angles_rad[k], 1e-4);
  }
}

TEST(Balance, ACraneStandsStretchedAndFolded) {
  const Mechanism mechanism = crane();
  const BalanceResult result = balance(mechanism, quick());
  EXPECT_LT(result.as_built_error, 1e-6);
  ASSERT_TRUE(result.least_tip_rad && result.tip_bound_rad);
  EXPECT_GT(*result.tip_bound_rad, *result.least_tip_rad);
  EXPECT_LT(*result.tip_bound_rad, 1.03 * *result.least_tip_rad);
  for (const double angle : result.tipping_angles_rad) EXPECT_GT(angle, *result.least_tip_rad - 1e-5);
  expect_verified(mechanism, result);
}

TEST(Balance, WithAnAngleGivenItIsLighter) {
  Mechanism mechanism = crane();
  const BalanceResult safest = balance(mechanism, quick());
  mechanism.least_tip_deg = 0.5 * *safest.least_tip_rad / kDegree;
  const BalanceResult lighter = balance(mechanism, quick());
  EXPECT_LT(lighter.mass_g, 0.97 * safest.mass_g);
  expect_verified(mechanism, lighter);
  mechanism.least_tip_deg = 1.1 * *safest.tip_bound_rad / kDegree;
  EXPECT_THROW(balance(mechanism, quick()), Error);
}

/// One part in one state, turned and moved in any way, is one body that stands.
TEST(Balance, OfOnePartIsThePoseOfABody) {
  const Mesh body = polycubes({{0, 0, 0}, {0, 0, 1}, {0, 0, 2}, {1, 0, 2}, {0, 1, 0}}, 20);
  PoseSpec spec;
  spec.poses = {rests(Pose::Kind::stands)};
  const HollowResult twin = hollow(body, spec, quick());
  const double twin_angle = verify(twin.delivery.body(), nullptr, spec).smallest_tipping_angle_rad;
  const Affine3d moved = Translation3d(7, -3, 100) * Eigen::AngleAxisd(1.1, Vector3d(1, 2, 3).normalized());
  Mechanism mechanism;
  mechanism.parts = {{"body", transformed(body, moved.inverse()), {}}};
  mechanism.states = {{"standing", {moved}, rests(Pose::Kind::stands)}};
  const BalanceResult result = balance(mechanism, quick());
  EXPECT_NEAR(result.tipping_angles_rad[0], twin_angle, 0.03 * twin_angle);
  expect_verified(mechanism, result);
}

/// Two hulls, side by side or one upon the other.
TEST(Balance, AFoldingBoatFloatsOpenAndShut) {
  Mechanism boat;
  const Mesh hull = box({-40, 0, 0}, {40, 30, 16});
  boat.parts = {{"port", hull, {}}, {"starboard", hull, {}}};
  boat.states = {{"open", {Affine3d::Identity(), Affine3d(Translation3d(0, -30.5, 0))}, rests(Pose::Kind::floats)},
                 {"shut", {Affine3d::Identity(), Affine3d(Translation3d(0, 0, 16.5))}, rests(Pose::Kind::floats)}};
  const BalanceResult result = balance(boat, quick());
  EXPECT_LT(result.as_built_error, 1e-6);
  expect_verified(boat, result);
}

TEST(Balance, WhatSinksInAStateFailsThere) {
  Mechanism boat;
  boat.parts = {{"hull", box({-40, 0, 0}, {40, 30, 16}), {}}};
  boat.states = {{"afloat", {Affine3d::Identity()}, rests(Pose::Kind::floats)},
                 {"ashore", {Affine3d::Identity()}, rests(Pose::Kind::stands)}};
  const MechanismVerdict verdict = verify(boat, {nullptr});
  ASSERT_EQ(verdict.states.size(), 2u);
  EXPECT_FALSE(verdict.states[0].pass());
  EXPECT_EQ(verdict.states[0].criteria.front().name, "pose_1_afloat");
  EXPECT_NEAR(verdict.states[0].criteria.front().value, 1 / 1.24, 1e-12);
  EXPECT_NE(verdict.states[0].meaning.front().find("In the state 'afloat', floating with z up: it sinks."), std::string::npos);
  EXPECT_TRUE(verdict.states[1].pass());
  boat.fluid_g_cm3 = 1.25;
  EXPECT_FALSE(verify(boat, {nullptr}).states[0].criteria.front().name == "pose_1_afloat");
}

TEST(Balance, WhatHangsAndStandsDoesBoth) {
  Mechanism lamp = crane();
  lamp.states[1].rests = rests(Pose::Kind::hangs);
  lamp.states[1].rests.point_mm = Vector3d(2, 0, 76);
  expect_verified(lamp, balance(lamp, quick()));
}

/// The arm on its hinge at (10, ., 0) of its own, with a counterweight behind.
TEST(Balance, WhatTurnsOnAHingeStaysWhereItIs) {
  Mechanism mechanism = crane();
  mechanism.parts[1].mesh = box({-25, -8, -8}, {35, 8, 8});
  mechanism.states.resize(1);
  mechanism.states[0].poses[1] = Affine3d(Translation3d(0, 0, 80));
  mechanism.states[0].hinges = {{Vector3d(3, 0, 80), Vector3d::UnitY(), {1}}};
  const BalanceResult result = balance(mechanism, quick());
  const Moments s = mesh_moments(result.parts[1].delivery.body());
  EXPECT_NEAR(s[MX] / s[M1], 3, 1e-3);
  expect_verified(mechanism, result);
  mechanism.states[0].hinges[0].point_mm.x() = 5;
  EXPECT_FALSE(judged(mechanism, result).pass());
  mechanism.states[0].hinges[0].point_mm.x() = 30;
  EXPECT_THROW(balance(mechanism, quick()), Error);
  mechanism.states[0].hinges[0].axis = Vector3d::UnitZ();
  EXPECT_THROW(balance(mechanism, quick()), Error);
}

TEST(Balance, APartThatIsNotPrintedCounts) {
  Mechanism mechanism = crane();
  mechanism.parts[1].printed = false;
  mechanism.parts[1].print.density_g_cm3 = 0.6;
  const BalanceResult result = balance(mechanism, quick());
  EXPECT_EQ(result.parts.size(), 1u);
  expect_verified(mechanism, result);
}

TEST(Balance, SaysWhichStatesCannotBe) {
  Mechanism mechanism = crane();
  mechanism.parts[1].mesh = box({0, -8, -8}, {400, 8, 8});
  mechanism.parts[1].print.wall_mm = 4;
  try {
    balance(mechanism, quick());
    FAIL();
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), ErrorCode::goal);
    EXPECT_NE(std::string(error.what()).find("'stretched'"), std::string::npos) << error.what();
  }
  mechanism = crane();
  mechanism.states[0].poses.pop_back();
  EXPECT_THROW(balance(mechanism, quick()), Error);
}

TEST(Balance, TheSameTwiceIsTheSameBytes) {
  const Mechanism mechanism = crane();
  const BalanceResult once = balance(mechanism, quick());
  const BalanceResult again = balance(mechanism, quick());
  for (std::size_t j = 0; j < once.parts.size(); ++j)
    EXPECT_EQ(once.parts[j].delivery.body().vertices, again.parts[j].delivery.body().vertices);
}

}  // namespace
}  // namespace rayrep::test
