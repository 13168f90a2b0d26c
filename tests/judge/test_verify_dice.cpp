#include <gtest/gtest.h>

#include <cmath>

#include "rayrep/judge/verify.h"
#include "runs.h"
#include "solids.h"

namespace rayrep {
namespace {

using namespace test;

const Eigen::Vector3d kZ = Eigen::Vector3d::UnitZ();

/// A cube of 20 mm with a cubic cavity, off its middle.
Mesh hollowed_cube(const Eigen::Vector3d& off, double half = 5) {
  Mesh mesh = box({-10, -10, -10}, {10, 10, 10});
  Mesh cavity = box(off - Eigen::Vector3d::Constant(half), off + Eigen::Vector3d::Constant(half));
  flip(cavity);
  append(mesh, cavity);
  return mesh;
}

DiceSpec loaded(const Eigen::Vector3d& up, std::optional<double> share = std::nullopt) {
  DiceSpec spec;
  spec.load = DiceSpec::Load{up, share};
  return spec;
}

double figure(const Verdict& verdict, const std::string& name) {
  for (const Figure& f : verdict.figures)
    if (f.name == name) return std::get<double>(f.value);
  ADD_FAILURE() << "no " << name;
  return 0;
}

TEST(VerifyDice, ACubeIsFairAndWithItsCavityAsideItIsNot) {
  const Mesh cube = box({-10, -10, -10}, {10, 10, 10});
  const DiceVerdict fair = verify(hollowed_cube({0, 0, 0}), &cube, DiceSpec{});
  EXPECT_TRUE(fair.pass());
  EXPECT_EQ(fair.goal, "dice");
  EXPECT_EQ(fair.state.rests.size(), 6u);
  EXPECT_NEAR(fair.state.largest_share, 1.0 / 6, 1e-12);
  EXPECT_NEAR(figure(fair, "share_ratio"), 1, 1e-12);
  EXPECT_NEAR(figure(fair, "inertia_ratio"), 1, 1e-12);
  EXPECT_GT(fair.scattered, 1.01);
  EXPECT_LT(fair.scattered, 1.1);
  EXPECT_TRUE(mentions(fair.meaning[0], {"It falls fairly", "each of its 6 faces in 16.67 % of all throws", "as prints scatter"}));
  EXPECT_TRUE(mentions(fair.meaning[1], {"without bouncing", "Real throws bounce", "1.000 times the smallest"}));

  const DiceVerdict unfair = verify(hollowed_cube({0, 0, 3}), &cube, DiceSpec{});
  EXPECT_EQ(failed(unfair), Names{"fairness"});
  EXPECT_NEAR(unfair.solid.largest_share, 1.0 / 6, 1e-12);
  // The void pulls the centre of mass down by 3/7 mm.
  EXPECT_NEAR(unfair.body.centre_of_mass_mm.z(), -3.0 / 7, 1e-12);
  const double up = figure(unfair, "largest_share");
  EXPECT_GT(up, 1.0 / 6 + 0.005);
  EXPECT_LT((unfair.state.rests.front().up - kZ).norm(), 1e-9);
  EXPECT_TRUE(mentions(unfair.meaning[0], {"It does not fall fairly", "(0, 0, 1) up most often"})) << unfair.meaning[0];
  DiceSpec lenient;
  lenient.fairness = 1.5;
  EXPECT_TRUE(verify(hollowed_cube({0, 0, 3}), &cube, lenient).pass());
}

TEST(VerifyDice, OfALongPrismTheEndsNeedNotCount) {
  const Mesh rod = box({-5, -5, -20}, {5, 5, 20});
  EXPECT_EQ(failed(verify(rod, nullptr, DiceSpec{})), Names{"fairness"});
  DiceSpec four;
  four.faces = 4;
  const DiceVerdict verdict = verify(rod, nullptr, four);
  EXPECT_TRUE(verdict.pass());
  EXPECT_EQ(verdict.state.counted, 4u);
  EXPECT_EQ(figure(verdict, "counted_faces"), 4);
  EXPECT_TRUE(mentions(verdict.meaning[0], {"4 of its 6 faces"})) << verdict.meaning[0];
  EXPECT_TRUE(mentions(verdict.meaning[1], {"one of the 2 others, which do not count"})) << verdict.meaning[1];
  four.faces = 7;
  EXPECT_EQ(failed(verify(rod, nullptr, four)), (Names{"faces", "fairness"}));
}

TEST(VerifyDice, ALoadedOneIsHeldToItsShare) {
  const Mesh cube = box({-10, -10, -10}, {10, 10, 10});
  const Mesh body = hollowed_cube({0, 0, 3});
  const DiceVerdict open = verify(body, &cube, loaded(2 * kZ));
  EXPECT_TRUE(open.pass());
  const double share = open.state.load_share;
  EXPECT_NEAR(share, open.state.largest_share, 1e-12);
  EXPECT_LT(open.scattered, share);
  EXPECT_GT(open.scattered, share - 0.02);
  EXPECT_TRUE(mentions(open.meaning[0], {"It is loaded", "(0, 0, 1) up", "(solid in 16.67 %)"})) << open.meaning[0];
  EXPECT_TRUE(verify(body, &cube, loaded(kZ, share + 0.004)).pass());
  EXPECT_EQ(failed(verify(body, &cube, loaded(kZ, share + 0.006))), Names{"load"});
  EXPECT_EQ(failed(verify(body, &cube, loaded(kZ, share - 0.006))), Names{"load"});
  const DiceVerdict never = verify(body, &cube, loaded({0, 1, 1}));
  EXPECT_EQ(failed(never), Names{"load"});
  EXPECT_TRUE(mentions(never.meaning[0], {"never comes to rest with (0, 0.707, 0.707) up"})) << never.meaning[0];
}

TEST(VerifyDice, OfAPrintTheSharesAreThoseOfItsOwnMoments) {
  const Mesh cube = box({-10, -10, -10}, {10, 10, 10});
  const Mesh body = hollowed_cube({1, 2, 3});
  const Verdict mesh = verify(body, &cube, Spec(DiceSpec{}));
  const Verdict print = verify_print(cube, mesh_moments(body), Spec(DiceSpec{}));
  EXPECT_NEAR(figure(print, "share_ratio"), figure(mesh, "share_ratio"), 1e-9);
  EXPECT_EQ(failed(print), failed(mesh));
  // The figures before it was hollowed are those of the solid.
  double before = 0;
  for (const Figure& f : state_figures(cube, Spec(DiceSpec{})))
    if (f.name == "share_ratio") before = std::get<double>(f.value);
  EXPECT_NEAR(before, 1, 1e-12);
}

TEST(VerifyDice, OfAnOpenSurfaceNothingIsSaidOfItsThrows) {
  Mesh open = box({0, 0, 0}, {20, 20, 20});
  open.triangles.pop_back();
  const DiceVerdict verdict = verify(open, nullptr, DiceSpec{});
  EXPECT_FALSE(verdict.pass());
  EXPECT_TRUE(verdict.state.rests.empty());
  EXPECT_EQ(verdict.goal, "dice");
}

}  // namespace
}  // namespace rayrep
