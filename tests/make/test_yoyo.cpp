// Yo-yos in two halves, with an axle and a gap for the string.

#include <gtest/gtest.h>

#include <algorithm>

#include "rayrep/base/error.h"
#include "rayrep/judge/verify.h"
#include "rayrep/make/hollow.h"
#include "rayrep/mesh/assembly.h"
#include "rayrep/mesh/boolean.h"
#include "rayrep/physics/axle.h"
#include "runs.h"
#include "solids.h"

namespace rayrep::test {
namespace {

Job<SpinSpec> yoyo(Axle::Kind kind, double gap_mm = 4) {
  Job<SpinSpec> job{.spec = {}, .hollow = coarse(40)};
  job.spec.yoyo = true;
  job.spec.axle = {kind, gap_mm};
  return job;
}

/// Flat, and turned so that no axis of the file is the axis of its spin.
Eigen::Matrix3d turn() { return random_rotation(5); }
Mesh lens() { return moved(rotated(uv_ellipsoid(30, 29, 22, 20), turn()), {3, 2, 1}); }

HollowResult made(Job<SpinSpec> job) {
  job.spec.up = turn().col(2);
  return hollow(lens(), job.spec, job.hollow);
}

/// With a rod of 4 mm, once for all tests.
const HollowResult& with_m4() {
  static const HollowResult result = made(yoyo(Axle::Kind::m4));
  return result;
}

std::string refusal(const Mesh& solid, const Job<SpinSpec>& job, ErrorCode code) {
  try {
    hollowed(solid, job);
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), code);
    return error.what();
  }
  ADD_FAILURE() << "made";
  return {};
}

std::vector<Mesh> halves_of(const Mesh& mesh) {
  const Mesh merged = with_merged_vertices(mesh);
  return split(merged, connected_components(merged));
}

class EveryAxle : public ::testing::TestWithParam<Axle::Kind> {};

TEST_P(EveryAxle, IsBalancedWithItsSteelAndKeepsTheOutsideButForGapAndBore) {
  const HollowResult result = GetParam() == Axle::Kind::m4 ? with_m4() : made(yoyo(GetParam()));
  EXPECT_LE(result.as_built_error, 1e-6);
  const Mesh solid = lens();
  const Verdict verdict = verify(result.delivery, &solid, result.spec);
  EXPECT_EQ(failed(verdict), Names{});
  EXPECT_EQ(verdict.goal, "yo-yo");
  EXPECT_TRUE(in_pieces(result.delivery));
  // What axle it has its steel tells.
  Spec untold = result.spec;
  std::get<SpinSpec>(untold).axle = {};
  EXPECT_EQ(failed(verify(result.delivery, &solid, untold)), Names{});
  // Mass by hand.
  double mass = 0;
  for (const Part& part : result.delivery.parts) mass += 1e-3 * part.density_g_cm3 * mesh_moments(part.mesh)[M1];
  EXPECT_NEAR(verdict.body.mass_g, mass, 1e-9 * mass);
  EXPECT_LT((verdict.body.centre_of_mass_mm - bounding_box(solid).center()).norm(), 1e-4);
  // Nothing of the halves lies in the gap.
  const Eigen::Vector3d up = turn().col(2);
  const Mesh body = result.delivery.body();
  for (const Eigen::Vector3d& v : body.vertices) EXPECT_GE(std::abs(up.dot(v - bounding_box(solid).center())), 2 - 1e-9);
}

INSTANTIATE_TEST_SUITE_P(Yoyo, EveryAxle, ::testing::Values(Axle::Kind::m4, Axle::Kind::rod_8mm, Axle::Kind::bearing_608));

TEST(Yoyo, SteelWeighsWhatDataSheetsSay) {
  const AxleFit m4 = fit({Axle::Kind::m4, 4}, {1, 2, 3}, Eigen::Vector3d::UnitX(), 50);
  EXPECT_EQ(m4.rod_length_mm, 20);
  ASSERT_EQ(m4.steel.size(), 1u);
  EXPECT_NEAR(mass_properties(m4.steel[0].mesh, m4.steel[0].density_g_cm3).mass_g, 7.85e-3 * kPi * 4 * 20, 1e-9);
  const AxleFit bearing = fit({Axle::Kind::bearing_608, 4}, {1, 2, 3}, Eigen::Vector3d::UnitX(), 50);
  ASSERT_EQ(bearing.steel.size(), 2u);
  EXPECT_TRUE(is_closed_solid(bearing.steel[1].mesh));
  EXPECT_NEAR(mass_properties(bearing.steel[1].mesh, bearing.steel[1].density_g_cm3).mass_g, 12, 1e-9);
  EXPECT_NEAR(mesh_moments(bearing.steel[1].mesh)[M1], kPi * (121 - 16) * 7, 0.005 * kPi * 121 * 7);
  for (const AxleFit& axle : {m4, bearing}) {
    EXPECT_TRUE(is_closed_solid(axle.bore));
    EXPECT_GT(mesh_moments(axle.bore)[M1], mesh_moments(axle.steel[0].mesh)[M1]);
  }
}

TEST(Yoyo, TheJudgeHoldsTheChangeToGapAndBore) {
  const HollowResult& result = with_m4();
  const Mesh solid = lens();
  const auto failures = [&](Axle axle) {
    Spec spec = result.spec;
    std::get<SpinSpec>(spec).axle = axle;
    return failed(verify(result.delivery, &solid, spec));
  };
  EXPECT_EQ(failures({Axle::Kind::m4, 4}), Names{});
  const Names names = failures({Axle::Kind::m4, 3.9});
  EXPECT_TRUE(std::find(names.begin(), names.end(), "outer_unchanged") != names.end());
}

TEST(Yoyo, TheEndsOfTheBoreAreRoofsAndTheGapIsNone) {
  // Solid, so that there is nothing else: 0.1 mm more than the rod all around, in both halves.
  const Mesh solid = lens();
  const AxleFit axle = fit({Axle::Kind::m4, 4}, bounding_box(solid).center(), turn().col(2), 60);
  std::vector<Mesh> operands = {solid};
  operands.insert(operands.end(), axle.taken.begin(), axle.taken.end());
  Delivery delivery;
  for (Mesh& half : halves_of(combined(operands, {.operation = BooleanOperation::subtract}).mesh)) {
    Part piece{.mesh = std::move(half), .name = "half " + std::to_string(delivery.parts.size() + 1)};
    const bool below = turn().col(2).dot(mesh_moments(piece.mesh).segment<3>(1)) <
                       turn().col(2).dot(bounding_box(solid).center()) * mesh_moments(piece.mesh)[M1];
    const Eigen::Vector3d up = below ? Eigen::Vector3d(-turn().col(2)) : Eigen::Vector3d(turn().col(2));
    piece.to_bed.linear() = Eigen::Quaterniond::FromTwoVectors(up, Eigen::Vector3d::UnitZ()).toRotationMatrix();
    piece.to_bed.translation().z() = -up.dot(bounding_box(solid).center()) - 2;
    if (below) piece.to_bed.pretranslate(Eigen::Vector3d(100, 0, 0));
    delivery.parts.push_back(std::move(piece));
  }
  ASSERT_EQ(delivery.parts.size(), 2u);
  SpinSpec spec = yoyo(Axle::Kind::m4).spec;
  spec.up = turn().col(2);
  const Verdict verdict = verify(delivery, &solid, Spec(spec));
  const auto figure = [&verdict](const char* name) -> double {
    for (const Figure& f : verdict.figures)
      if (f.name == name) return std::get<double>(f.value);
    return -1;
  };
  EXPECT_NEAR(figure("roof_mm2"), 2 * kPi * 2.1 * 2.1, 0.05);
  EXPECT_NEAR(figure("widest_bridge_mm"), 4.2, 0.1);
}

TEST(Yoyo, WithoutAnAxleItIsInOnePieceAsBefore) {
  const HollowResult result = made(yoyo(Axle::Kind::none, 0));
  EXPECT_FALSE(in_pieces(result.delivery));
  EXPECT_EQ(result.delivery.parts.size(), 1u);
}

TEST(Yoyo, WhereTheAxleHasNoRoomThatIsSaid) {
  const Mesh small = uv_ellipsoid(12, 12, 8, 24);
  Job<SpinSpec> job = yoyo(Axle::Kind::rod_8mm);
  EXPECT_TRUE(mentions(refusal(small, job, ErrorCode::goal), {"no room", "36.0 mm long", "--axle none"}));
  // Only what would help is advised.
  EXPECT_FALSE(mentions(refusal(small, job, ErrorCode::goal), {"--gap"}));
  job = yoyo(Axle::Kind::m4, 9);
  EXPECT_TRUE(mentions(refusal(uv_ellipsoid(15, 15, 11.5, 24), job, ErrorCode::goal), {"--gap"}));
  job = yoyo(Axle::Kind::rod_8mm);
  // Two blocks and a web between them above the gap: below it there are two pieces.
  const Mesh dumbbell = merged({box({-30, -8, -14}, {-6, 8, 14}), box({6, -8, -14}, {30, 8, 14}), box({-29, -7, 3}, {29, 7, 13})});
  job = yoyo(Axle::Kind::m4);
  job.spec.centre_mm = Eigen::Vector3d(18, 0, -1);
  EXPECT_TRUE(mentions(refusal(dumbbell, job, ErrorCode::goal), {"pieces", "--axle none"}));
}

TEST(Yoyo, WhatDoesNotGoWithAnAxleIsRefused) {
  Job<SpinSpec> job = yoyo(Axle::Kind::m4);
  job.spec.yoyo = false;
  EXPECT_TRUE(mentions(refusal(lens(), job, ErrorCode::usage), {"--axle belongs to --yoyo"}));
  for (const double narrow_mm : {0.0, 0.001}) {
    job = yoyo(Axle::Kind::m4, narrow_mm);
    EXPECT_TRUE(mentions(refusal(lens(), job, ErrorCode::usage), {"--gap at least 0.5"}));
  }
  job = yoyo(Axle::Kind::bearing_608, 6);
  EXPECT_TRUE(mentions(refusal(lens(), job, ErrorCode::usage), {"at most 5"}));
  job = yoyo(Axle::Kind::none, 3);
  EXPECT_TRUE(mentions(refusal(lens(), job, ErrorCode::usage), {"--axle"}));
  job = yoyo(Axle::Kind::m4);
  job.spec.print.core.density_g_cm3 = 7;
  EXPECT_TRUE(mentions(refusal(lens(), job, ErrorCode::usage), {"--axle none"}));
  job = yoyo(Axle::Kind::m4);
  job.spec.print.cut.where = Cut::Where::found;
  EXPECT_TRUE(mentions(refusal(lens(), job, ErrorCode::usage), {"--cut"}));
}

}  // namespace
}  // namespace rayrep::test
