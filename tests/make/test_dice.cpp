// Dice: theory.md (72), (73)

#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>

#include "make/body.h"
#include "make/centre_reach.h"
#include "places.h"
#include "rayrep/base/error.h"
#include "rayrep/io/mesh_io.h"
#include "rayrep/judge/verify.h"
#include "rayrep/make/hollow.h"
#include "rayrep/mesh/mesh_check.h"
#include "runs.h"
#include "solids.h"

namespace rayrep {
namespace {

using namespace test;

const Eigen::Vector3d kZ = Eigen::Vector3d::UnitZ();

Job<DiceSpec> job() {
  Job<DiceSpec> options;
  options.hollow.resolution = 40;
  options.hollow.as_stored = [](const Mesh& mesh) { return as_stored("x.stl", mesh); };
  return options;
}

Job<DiceSpec> loaded(const Eigen::Vector3d& up, std::optional<double> share = std::nullopt) {
  Job<DiceSpec> options = job();
  options.spec.load = DiceSpec::Load{up, share};
  return options;
}

/// Makes it, writes it, reads it back and has it judged.
DiceVerdict expect_made(const Mesh& solid, const Job<DiceSpec>& options) {
  const Outcome<DiceSpec> result = hollowed(solid, options);
  const auto path = own_file("dice.stl");
  write_mesh(path, result.delivery.body());
  const DiceVerdict verdict = verify(read_mesh(path).mesh, &solid, result.found);
  for (const Criterion& c : verdict.criteria)
    EXPECT_TRUE(c.pass()) << path << ": " << c.name << " " << c.value << " limit " << c.limit;
  if (verdict.pass()) std::filesystem::remove(path);
  return verdict;
}

double unevenness(const MassProperties& body) { return body.principal_moments_g_mm2[2] / body.principal_moments_g_mm2[0]; }

/// A cube of 25 mm with blind holes on three of its sides, so that its centre of mass is not in its middle.
Mesh pitted_cube() {
  std::vector<Eigen::Vector3i> cells;
  for (int x = 0; x < 5; ++x)
    for (int y = 0; y < 5; ++y)
      for (int z = 0; z < 5; ++z) {
        const bool hole =
            (x == 2 && y == 2 && z == 4) || (x == 4 && (y == 1 || y == 3) && z == 2) || (x % 2 == 1 && y == 0 && z % 2 == 1);
        if (!hole) cells.emplace_back(x, y, z);
      }
  return polycubes(cells, 5);
}

TEST(Dice, APittedCubeIsMadeFairWithEvenInertia) {
  const Mesh solid = pitted_cube();
  EXPECT_EQ(failed(verify(solid, &solid, DiceSpec{})), Names{"fairness"});
  const DiceVerdict verdict = expect_made(solid, job());
  EXPECT_EQ(verdict.state.rests.size(), 6u);
  EXPECT_LT(verdict.state.largest_share / verdict.state.smallest_share, 1.0005);
  EXPECT_LT((verdict.body.centre_of_mass_mm - Eigen::Vector3d::Constant(12.5)).norm(), 1e-3);
  EXPECT_GT(unevenness(verdict.solid.body), 1.005);
  EXPECT_LT(unevenness(verdict.body), 1.002);
  EXPECT_LT(verdict.body.mass_g, 0.9 * verdict.solid.body.mass_g);
}

TEST(Dice, ATurnedIcosahedronStaysFair) {
  const DiceVerdict verdict = expect_made(rotated(icosphere(14, 0), random_rotation(4)), job());
  EXPECT_EQ(verdict.state.rests.size(), 20u);
  EXPECT_LT(verdict.state.largest_share / verdict.state.smallest_share, 1.001);
}

TEST(Dice, AnObliqueTetrahedronHasFourSharesAndThreeCoordinates) {
  // So that there is a centre of mass for which all are equal.
  Mesh solid = unit_tetrahedron();
  solid.vertices = {{0, 0, 0}, {26, 2, 0}, {8, 24, 0}, {10, 9, 21}};
  EXPECT_EQ(failed(verify(solid, &solid, DiceSpec{})), Names{"fairness"});
  const DiceVerdict verdict = expect_made(solid, job());
  ASSERT_EQ(verdict.state.rests.size(), 4u);
  for (const RestingFace& face : verdict.state.rests) EXPECT_NEAR(face.share, 0.25, 1e-4);
}

TEST(Dice, FewerFacesAreTakenWhereAsManyAsThereCanBeAreNotFair) {
  const std::filesystem::path path = test::shared_meshes() / "thingi10k_100827_chrystal.stl";
  if (!std::filesystem::exists(path)) GTEST_SKIP() << path << " is not there";
  Mesh solid = check_mesh(read_mesh(path).mesh).mesh;
  const double factor = 60 / bounding_box(solid).sizes().maxCoeff();
  for (Eigen::Vector3d& v : solid.vertices) v *= factor;
  // It can rest on five faces at once, of which one is always rare; what is fair with --faces 4 rests on no others.
  Job<DiceSpec> four = job();
  four.spec.faces = 4;
  EXPECT_EQ(expect_made(solid, four).state.rests.size(), 4u);
  const DiceVerdict open = expect_made(solid, job());
  EXPECT_EQ(open.state.rests.size(), 4u);
  EXPECT_LT(open.state.largest_share / open.state.smallest_share, 1.02);
}

TEST(Dice, WhereSharesCannotBeEqualNoCentreNearbyMakesThemMoreSo) {
  // A triangular prism with three different sides, cut off aslant.
  Mesh solid;
  solid.vertices = {{0, 0, 0}, {24, 0, 0}, {6, 20, 0}, {0, 0, 18}, {24, 0, 24}, {6, 20, 20}};
  solid.triangles = {{0, 2, 1}, {3, 4, 5}, {0, 1, 4}, {0, 4, 3}, {1, 2, 5}, {1, 5, 4}, {2, 0, 3}, {2, 3, 5}};
  Job<DiceSpec> options = job();
  options.spec.fairness = 3;
  const DiceVerdict verdict = expect_made(solid, options);
  const Tumbler tumbler(solid);
  const auto ratio = [&](const Eigen::Vector3d& c) {
    const auto rests = tumbler.rests(c);
    return rests.size() < 5 ? 1e9 : rests.front().share / rests.back().share;
  };
  const double found = ratio(verdict.body.centre_of_mass_mm);
  EXPECT_GT(found, 1.01);
  EXPECT_LT(found, 0.9 * ratio(verdict.solid.body.centre_of_mass_mm));
  detail::Discretisation discretised;
  discretised.resolution = 60;
  const detail::Body body(solid, Eigen::Affine3d::Identity(), discretised, {});
  detail::CentreReach reach(*body.integrals, body.shell);
  Random random(5);
  for (int n = 0; n < 300; ++n) {
    const double far = n % 3 == 0 ? 0.05 : n % 3 == 1 ? 0.3 : 3.0;
    EXPECT_GE(ratio(reach.nearest(verdict.body.centre_of_mass_mm + random.in_box(far))), found - 5e-3);
  }
}

TEST(Dice, WhatCannotBeFairIsToldWithFigures) {
  Job<DiceSpec> options = job();
  const Mesh brick = box({0, 0, 0}, {10, 20, 30});
  const std::string text = message_of([&] { hollowed(brick, options); }, ErrorCode::goal);
  EXPECT_TRUE(mentions(text, {"It cannot fall fairly", "5.75 times as often", "--fairness allows 1.02", "That is its shape",
                              "comes to rest on 6 faces", "--faces N"}))
      << text;
  options.spec.fairness = 5.8;
  EXPECT_EQ(expect_made(brick, options).state.rests.size(), 6u);
  // Of a rod the four sides alone.
  options = job();
  options.spec.faces = 4;
  const DiceVerdict rod = expect_made(box({0, 0, 0}, {10, 10, 30}), options);
  EXPECT_EQ(rod.state.counted, 4u);
  EXPECT_LT(unevenness(rod.body), 0.9 * unevenness(rod.solid.body));  // as even as it can be
  EXPECT_LT(rod.state.largest_share / rod.state.smallest_share, 1.001);
  options.spec.faces = 7;
  const std::string more = message_of([&] { hollowed(brick, options); }, ErrorCode::goal);
  EXPECT_TRUE(mentions(more, {"comes to rest on 6 faces only"})) << more;
}

TEST(Dice, ALoadedCubeFallsOnTheFaceThatItsCentreIsBroughtNearTo) {
  const Mesh solid = box({0, 0, 0}, {20, 20, 20});
  const Job<DiceSpec> options = loaded(kZ);
  const Outcome<DiceSpec> result = hollowed(solid, options);
  ASSERT_TRUE(result.found.load->share);
  const DiceVerdict verdict = expect_made(solid, options);
  EXPECT_NEAR(verdict.state.load_share, *result.found.load->share, 1e-5);
  EXPECT_GT(verdict.state.load_share, 0.21);
  // Straight down, as far as it goes: filled to t above its wall.
  const Eigen::Vector3d& c = verdict.body.centre_of_mass_mm;
  EXPECT_NEAR(c.x(), 10, 0.1);
  EXPECT_NEAR(c.y(), 10, 0.1);
  double lowest = 10;
  for (double t = 1.2; t < 18; t += 0.01) {
    const Moments s = box_moments({0, 0, 0}, {20, 20, 20}) - box_moments({1.2, 1.2, t}, {18.8, 18.8, 18.8});
    lowest = std::min(lowest, s[MZ] / s[M1]);
  }
  EXPECT_NEAR(c.z(), lowest, 0.05);
}

TEST(Dice, AShareIsMetUpwardAndDownward) {
  const Mesh solid = box({0, 0, 0}, {20, 20, 20});
  for (const double share : {0.14, 0.19, 0.21})
    EXPECT_NEAR(expect_made(solid, loaded({1, 0, 0}, share)).state.load_share, share, 2.1e-3);
  const std::string text = message_of([&] { hollowed(solid, loaded(kZ, 0.9)); }, ErrorCode::goal);
  EXPECT_TRUE(mentions(text, {"so often or so seldom", "solid it does in 16.67 %"})) << text;
}

TEST(Dice, AnAttitudeInWhichItNeverRestsIsToldWithThoseInWhichItDoes) {
  const std::string text = message_of([&] { hollowed(box({0, 0, 0}, {20, 20, 20}), loaded({1, 1, 1})); }, ErrorCode::goal);
  EXPECT_TRUE(mentions(text, {"It never comes to rest like that", "(0, 0, 1) up (16.67 %)"})) << text;
}

TEST(Dice, SaysWhatMakesNoSense) {
  const auto usage = [](const Job<DiceSpec>& options) {
    return message_of([&] { hollowed(box({0, 0, 0}, {20, 20, 20}), options); }, ErrorCode::usage);
  };
  Job<DiceSpec> options = loaded(kZ);
  options.spec.faces = 6;
  EXPECT_TRUE(mentions(usage(options), {"--faces is of fair dice"}));
  options = job();
  options.hollow.solver = Solver::rays;
  EXPECT_TRUE(mentions(usage(options), {"quadric"}));
  options = job();
  options.spec.fairness = 0.9;
  EXPECT_TRUE(mentions(usage(options), {"--fairness"}));
}

TEST(CentreReach, OfABoxReachesAsFarAsFillingItUpToAPlaneDoes) {
  const double w = 2;
  detail::Discretisation discretised;
  discretised.wall_mm = w;
  discretised.resolution = 60;
  const detail::Body body(box({-10, -10, -10}, {10, 10, 10}), Eigen::Affine3d::Identity(), discretised, {});
  detail::CentreReach reach(*body.integrals, body.shell);
  EXPECT_LT(reach.middle().norm(), 1e-2);
  double farthest = 0;
  for (double t = -10 + w; t < 10 - w; t += 0.005) {
    const Moments s = box_moments({-10, -10, -10}, {10, 10, 10}) - box_moments({w - 10, w - 10, t}, {10 - w, 10 - w, 10 - w});
    farthest = std::max(farthest, -s[MZ] / s[M1]);
  }
  for (int axis = 0; axis < 3; ++axis) {
    const Eigen::Vector3d far = reach.nearest(50 * Eigen::Vector3d::Unit(axis));
    EXPECT_NEAR(far[axis], farthest, 0.02 * farthest);
    const auto outward = reach.outward(far);
    ASSERT_TRUE(outward);
    EXPECT_GT((*outward)[axis], 0.99);
  }
  const Eigen::Vector3d within(0.2 * farthest, -0.1 * farthest, 0.3 * farthest);
  EXPECT_LT((reach.nearest(within) - within).norm(), 1e-8);
  EXPECT_FALSE(reach.outward(within));
  // A plane's nearest place, of a line one near where it is.
  const Eigen::MatrixXd J = Eigen::RowVector3d(0, 0, 1);
  const Eigen::Vector3d level = reach.least(J, Eigen::VectorXd::Constant(1, -0.1 * farthest), within);
  EXPECT_NEAR(level.z(), 0.1 * farthest, 1e-3 * farthest);
  EXPECT_LT((level - within).head<2>().norm(), 1e-3 * farthest);
}

}  // namespace
}  // namespace rayrep
