// The best centre of mass for several poses: theory.md (66)

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "ray_problems.h"
#include "rayrep/rays/ray_integrals.h"
#include "rayrep/solve/quadric.h"
#include "solids.h"
#include "solve/safest_centre.h"

namespace rayrep::test {
namespace {

using detail::CentreProblem;
using detail::CentreSearch;
using detail::SafestCentre;
using Row = CentreProblem::Row;

/// (a_0, a) with a_0 + a.c = a.(c - p).
Row through(const Eigen::Vector3d& p, const Eigen::Vector3d& a) {
  Row row;
  row << -a.dot(p), a;
  return row;
}

/// Stands on a square of this half width about a point: up, and its four edges.
void add_square(CentreProblem& problem, const Eigen::Vector3d& foot, const Eigen::Vector3d& up, double half) {
  const Eigen::Vector3d side = up.unitOrthogonal();
  for (const Eigen::Vector3d& inward :
       {side, Eigen::Vector3d(-side), Eigen::Vector3d(up.cross(side)), Eigen::Vector3d(side.cross(up))})
    problem.ratios.push_back({through(foot - half * inward, inward), through(foot, up)});
}

/// Two or three feet about a random body, as far from its centre as its length.
CentreProblem random_feet(Random& random, const RayBody& body) {
  const Eigen::Vector3d centre = body.solid().segment<3>(MX) / body.solid()[M1];
  CentreProblem problem;
  const int feet = 2 + static_cast<int>(2 * random.uniform());
  for (int n = 0; n < feet; ++n) {
    const Eigen::Vector3d up = random.in_box(1).normalized();
    add_square(problem, centre - 40 * up + random.in_box(4), up, random.uniform(5, 20));
  }
  return problem;
}

Eigen::Vector3d centre_of(const Moments& s) { return s.segment<3>(MX) / s[M1]; }

Moments random_plane(Random& random, const Eigen::Vector3d& near) {
  Moments q = Moments::Zero();
  q.segment<3>(MX) = random.in_box(1);
  q[M1] = -q.segment<3>(MX).dot(near + random.in_box(10));
  return q;
}

/// How far the nearest interior's centre lies from one that is said to be attainable, mass times distance.
double distance_from_attainable(const RayIntegrals& rays, const RayBody& body, const Eigen::Vector3d& centre) {
  Goal goal;
  goal.J = Eigen::Matrix<double, Eigen::Dynamic, 10>::Zero(3, 10);
  goal.c_0 = Eigen::VectorXd::Zero(3);
  const double unit = body.solid()[M1] * body.length_mm;
  for (int k = 0; k < 3; ++k) {
    goal.J(k, MX + k) = 1 / unit;
    goal.J(k, M1) = -centre[k] / unit;
  }
  return nearest_attainable(goal, rays, body.shell, 1e-9).distance;
}

TEST(SafestCentre, IsAttainableAndNoInteriorIsBetter) {
  Random random(66);
  for (int n = 0; n < 25; ++n) {
    const RayBody body = random_body(random, 24);
    const RayIntegrals rays(body.domain);
    const CentreProblem problem = random_feet(random, body);
    CentreSearch search(rays, body.shell);
    const SafestCentre best = search.solve(problem);
    ASSERT_TRUE(best.attainable);
    EXPECT_NEAR(best.ratio, best.bound, 1e-6 * (1 + std::abs(best.bound))) << n;
    EXPECT_LE(best.ratio, best.bound + 1e-7);
    EXPECT_LT(distance_from_attainable(rays, body, best.centre_mm), 1e-7) << n;
    EXPECT_LT(search.evaluations(), 400);
    for (int k = 0; k < 50; ++k) {
      const Moments one = body.shell + rays.moments(random_plane(random, best.centre_mm));
      const Moments other = body.shell + rays.moments(random_plane(random, best.centre_mm));
      const Moments s = one + random.uniform() * (other - one);
      EXPECT_LE(problem.smallest_ratio(centre_of(s)), best.bound + 1e-9);
    }
  }
}

TEST(SafestCentre, TheOrderOfThePosesDoesNotMatter) {
  Random random(67);
  for (int n = 0; n < 10; ++n) {
    const RayBody body = random_body(random, 24);
    const RayIntegrals rays(body.domain);
    CentreProblem problem = random_feet(random, body);
    const SafestCentre one = CentreSearch(rays, body.shell).solve(problem);
    std::reverse(problem.ratios.begin(), problem.ratios.end());
    const SafestCentre other = CentreSearch(rays, body.shell).solve(problem);
    EXPECT_NEAR(one.bound, other.bound, 1e-7);
    // Where the best is not sharp the centres may differ by more than the ratios.
    EXPECT_LT((one.centre_mm - other.centre_mm).norm(), 0.02);
  }
}

TEST(SafestCentre, ABoxOnOneFootIsFilledUpToItsCentre) {
  RayGrid grid;
  grid.spacing_mm = 0.5;
  grid.nx = grid.ny = 36;
  grid.origin_mm.setConstant(-9 + 0.25);
  RayBody body{ray_rep(grid, [](const Eigen::Vector2d&) { return std::vector<Interval>{{1, 39}}; }), Moments::Zero(), 50};
  body.shell = box_moments({-10, -10, 0}, {10, 10, 40}) - ray_moments(body.domain);
  const RayIntegrals rays(body.domain);
  CentreProblem problem;
  add_square(problem, {0, 0, 0}, {0, 0, 1}, 10);
  const SafestCentre best = CentreSearch(rays, body.shell).solve(problem);
  double lowest = 20;
  for (double t = 1; t < 39; t += 1e-3) {
    const double m = body.shell[M1] + 18 * 18 * (t - 1);
    lowest = std::min(lowest, (body.shell[MZ] + 18 * 18 * (t * t - 1) / 2) / m);
  }
  EXPECT_NEAR(best.ratio, 10 / lowest, 1e-6);
  EXPECT_NEAR(best.bound, 10 / lowest, 1e-6);
  EXPECT_LT((best.centre_mm - Eigen::Vector3d(0, 0, lowest)).norm(), 1e-5);
  EXPECT_GT(best.slope.z(), 0.1);
  EXPECT_LT(best.slope.head<2>().norm(), 1e-3 * best.slope.z());
}

TEST(SafestCentre, OppositeFeetStandAgainstEachOther) {
  Random random(68);
  const RayBody body = random_body(random, 24);
  const RayIntegrals rays(body.domain);
  const Eigen::Vector3d centre = centre_of(body.solid());
  const Eigen::Vector3d up = Eigen::Vector3d(1, 2, 3).normalized();
  CentreProblem problem;
  add_square(problem, centre - 40 * up, up, 10);
  add_square(problem, centre + 40 * up, -up, 10);
  const SafestCentre best = CentreSearch(rays, body.shell).solve(problem);
  EXPECT_NEAR(best.ratio, 0.25, 1e-8);
  EXPECT_NEAR(best.bound, 0.25, 1e-8);
  EXPECT_LT((best.centre_mm - centre).norm(), 1e-5);
  EXPECT_LT(best.slope.norm(), 1e-4);
}

TEST(SafestCentre, KeepsToALineAPlaneAndAMass) {
  Random random(69);
  int held = 0;
  for (int n = 0; n < 20; ++n) {
    const RayBody body = random_body(random, 24);
    const RayIntegrals rays(body.domain);
    const Eigen::Vector3d centre = centre_of(body.solid());
    CentreProblem problem = random_feet(random, body);
    const double free = CentreSearch(rays, body.shell).solve(problem).bound;
    const Eigen::Vector3d along = random.in_box(1).normalized();
    const Eigen::Vector3d across = along.unitOrthogonal();
    problem.level = {through(centre, across), through(centre, along.cross(across))};
    problem.at_most = {through(centre + along, along)};
    problem.volume_mm3 = 0.6 * body.shell[M1] + 0.4 * body.solid()[M1];
    const SafestCentre best = CentreSearch(rays, body.shell).solve(problem);
    EXPECT_LE(best.bound, free + 1e-9);
    if (!best.attainable) continue;
    ++held;
    const Eigen::Vector3d off = best.centre_mm - centre;
    EXPECT_LT((off - off.dot(along) * along).norm(), 1e-5);
    EXPECT_LT(off.dot(along), 1 + 1e-5);
    EXPECT_NEAR(best.ratio, best.bound, 1e-5 * (1 + std::abs(best.bound)));
  }
  EXPECT_GT(held, 10);
}

TEST(SafestCentre, WhatContradictsItselfIsNotAttainable) {
  Random random(70);
  const RayBody body = random_body(random, 24);
  const RayIntegrals rays(body.domain);
  const Eigen::Vector3d centre = centre_of(body.solid());
  CentreProblem problem = random_feet(random, body);
  CentreSearch search(rays, body.shell);
  EXPECT_TRUE(search.solve(problem).attainable);
  problem.level = {through(centre, {1, 0, 0}), through(centre + Eigen::Vector3d(1, 0, 0), {1, 0, 0})};
  EXPECT_FALSE(search.solve(problem).attainable);
  problem.level = {through(centre + Eigen::Vector3d(60, 0, 0), {1, 0, 0})};  // outside of the body
  EXPECT_FALSE(search.solve(problem).attainable);
  problem.level.clear();
  EXPECT_TRUE(search.solve(problem).attainable);
}

TEST(SafestCentre, AScarceCoreBoundsIt) {
  Random random(71);
  RayBody body = random_body(random, 24);
  const CentreProblem problem = random_feet(random, body);
  const RayIntegrals plain(body.domain);
  body.domain.grid.weight = 6;
  body.domain.grid.substitute = 1.0 / 6;
  const RayIntegrals heavy(body.domain);
  body.domain.grid.most_mm3 = 0.05 * heavy.full()[M1] / 6;
  const RayIntegrals scarce(body.domain);
  const double without = CentreSearch(plain, body.shell).solve(problem).bound;
  const SafestCentre best = CentreSearch(scarce, body.shell).solve(problem);
  const double plenty = CentreSearch(heavy, body.shell).solve(problem).bound;
  EXPECT_GT(best.ratio, without);
  EXPECT_LT(best.bound, plenty);
  EXPECT_NEAR(best.ratio, best.bound, 1e-4 * (1 + std::abs(best.bound)));
}

}  // namespace
}  // namespace rayrep::test
