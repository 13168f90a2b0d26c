// Interiors of several bodies at once: theory.md (116)

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <vector>

#include "ray_problems.h"
#include "rayrep/rays/ray_integrals.h"
#include "rayrep/solve/parts.h"
#include "rayrep/solve/quadric.h"
#include "solids.h"

namespace rayrep::test {
namespace {

/// An affine goal as one of a single part.
PartsGoal of_one(const Goal& goal) { return {goal.J, goal.c_0, goal.at_most, goal.gradient(Moments::Zero())}; }

PartsSolution solved(const PartsGoal& goal, const std::vector<RayBody>& bodies) {
  std::vector<RayIntegrals> rays;
  for (const RayBody& body : bodies) rays.emplace_back(body.domain);
  std::vector<PartInterior> parts;
  for (std::size_t j = 0; j < bodies.size(); ++j) parts.push_back({&rays[j], bodies[j].shell});
  return solve_parts(goal, parts);
}

Moments moments_where(const RayBody& body, const Moments& q) { return body.shell + ray_moments(negative_part(body.domain, q)); }

TEST(Parts, OneOfThemIsOneBody) {
  Random random(1600);
  int both = 0;
  for (int n = 0; n < 40; ++n) {
    SCOPED_TRACE(n);
    const RayBody body = random_body(random, 30);
    Goal goal = random_goal(random, Kind::floating, body);
    Moments lid = Moments::Zero();
    lid[MX] = 1 / (body.solid()[M1] * body.length_mm);
    if (n % 2) goal = with_at_most(goal, lid, 1e-3);
    const QuadricSolution twin = solve_quadric(goal, RayIntegrals(body.domain), body.shell);
    const PartsSolution solution = solved(of_one(goal), {body});
    EXPECT_EQ(solution.converged, twin.converged);
    EXPECT_EQ(solution.infeasible, twin.infeasible);
    if (!solution.converged) continue;
    ++both;
    EXPECT_NEAR(solution.objective, goal.gradient(Moments::Zero()).dot(twin.moments), 1e-9);
    EXPECT_TRUE(moments_near(solution.moments[0], twin.moments, 1e-7, body.length_mm));
  }
  EXPECT_GT(both, 15);
}

/// Two halves of a body, each in a frame of its own, with a goal for both together.
TEST(Parts, HalvesOfABodyInOtherFramesAreThatBody) {
  Random random(1601);
  int both = 0;
  for (int n = 0; n < 20; ++n) {
    SCOPED_TRACE(n);
    const RayBody whole = random_body(random, 30);
    const Goal goal = random_goal(random, Kind::floating, whole);
    const QuadricSolution twin = solve_quadric(goal, RayIntegrals(whole.domain), whole.shell);
    std::vector<RayBody> halves(2, {{whole.domain.grid, {0}, {}}, 0.5 * whole.shell, whole.length_mm});
    for (std::size_t ray = 0; ray < whole.domain.grid.size(); ++ray)
      for (std::size_t side = 0; side < 2; ++side) {
        RayRep& rays = halves[side].domain;
        for (std::uint32_t k = whole.domain.first[ray]; k < whole.domain.first[ray + 1]; ++k)
          if ((whole.domain.grid.at(ray).x() > 1) == (side == 1)) rays.intervals.push_back(whole.domain.intervals[k]);
        rays.first.push_back(static_cast<std::uint32_t>(rays.intervals.size()));
      }
    const Eigen::Vector3d shift = random.in_box(30);
    halves[1].domain = moved(halves[1].domain, shift);
    halves[1].shell = translated(halves[1].shell, shift);
    const Matrix10 back = moment_map(Eigen::Affine3d(Eigen::Translation3d(-shift)));
    PartsGoal parts{Eigen::MatrixXd(goal.J.rows(), 20), goal.c_0, 0, Eigen::VectorXd(20)};
    parts.J << goal.J, goal.J * back;
    parts.g << goal.gradient(Moments::Zero()), back.transpose() * goal.gradient(Moments::Zero());
    const PartsSolution solution = solved(parts, halves);
    EXPECT_EQ(solution.converged, twin.converged);
    EXPECT_EQ(solution.infeasible, twin.infeasible);
    if (!solution.converged) continue;
    ++both;
    EXPECT_NEAR(solution.objective, goal.gradient(Moments::Zero()).dot(twin.moments), 1e-9);
    EXPECT_TRUE(moments_near(solution.moments[0] + back * solution.moments[1], twin.moments, 1e-7, whole.length_mm));
  }
  EXPECT_GT(both, 5);
}

/// Rows that want something of all parts, through what random interiors have, so that they can be met. Heights are in the objective
/// alone: where q.phi does not depend on z whole rays switch at once, and no interior of the form (30) may meet the constraints.
PartsGoal random_parts_goal(Random& random, const std::vector<RayBody>& bodies, int rows, int at_most) {
  const auto n = static_cast<Eigen::Index>(bodies.size());
  PartsGoal goal{Eigen::MatrixXd(rows, 10 * n), Eigen::VectorXd(rows), at_most, Eigen::VectorXd(10 * n)};
  Eigen::VectorXd met(10 * n);
  Eigen::MatrixXd wanted(rows + 1, 10);
  for (Eigen::Index j = 0; j < n; ++j) {
    const RayBody& body = bodies[static_cast<std::size_t>(j)];
    const Moments unit = moment_units(body.solid()[M1], body.length_mm);
    for (Eigen::Index row = 0; row <= rows; ++row) {
      Moments a = Moments::Zero();
      for (int k = 0; k < MZ; ++k) a[k] = random.uniform(-1, 1) / unit[k];
      if (row == rows) a[MZ] = random.uniform(1, 2) / unit[MZ];
      if (row < rows)
        goal.J.row(row).segment<10>(10 * j) = a;
      else
        goal.g.segment<10>(10 * j) = a;
    }
    Moments q = Moments::Zero();
    for (int k = 0; k <= MZ; ++k) q[k] = random.uniform(-1, 1) / unit[k];
    // A quarter of the way to what is half full: with room on all sides.
    met.segment<10>(10 * j) = 0.75 * moments_where(body, q) + 0.25 * (body.shell + 0.5 * ray_moments(body.domain));
  }
  goal.c_0 = -goal.J * met;
  goal.c_0.tail(at_most).array() -= 1e-3;
  return goal;
}

TEST(Parts, OptimumIsProvenAndEachHasItsOwnQuadric) {
  Random random(1602);
  for (int n = 0; n < 60; ++n) {
    SCOPED_TRACE(n);
    std::vector<RayBody> bodies;
    for (int j = 0; j < 2 + n % 3; ++j) bodies.push_back(random_body(random, 24));
    const PartsGoal goal = random_parts_goal(random, bodies, 4, 2);
    const PartsSolution solution = solved(goal, bodies);
    ASSERT_TRUE(solution.converged) << solution.residual;
    Eigen::VectorXd s(goal.g.size());
    const Eigen::VectorXd q = goal.g + goal.J.transpose() * solution.multipliers;
    for (std::size_t j = 0; j < bodies.size(); ++j) {
      const auto at = 10 * static_cast<Eigen::Index>(j);
      EXPECT_TRUE(moments_near(solution.moments[j], moments_where(bodies[j], q.segment<10>(at)), 1e-10, 80));
      s.segment<10>(at) = solution.moments[j];
    }
    const Eigen::VectorXd c = goal.J * s + goal.c_0;
    EXPECT_LT(c.head(2).cwiseAbs().maxCoeff(), 1e-9);
    EXPECT_LT(c.tail(2).maxCoeff(), 1e-9);
    EXPECT_GE(solution.multipliers.tail(2).minCoeff(), 0);
    EXPECT_NEAR(solution.objective, goal.g.dot(s), 1e-12);
    EXPECT_NEAR(solution.lower_bound, solution.objective, 1e-9);
  }
}

TEST(Parts, WhatCannotBeIsProvenImpossible) {
  Random random(1603);
  for (int n = 0; n < 10; ++n) {
    SCOPED_TRACE(n);
    const std::vector<RayBody> bodies = {random_body(random, 24), random_body(random, 24)};
    PartsGoal goal = random_parts_goal(random, bodies, 3, 0);
    goal.c_0[n % 3] += 10;
    const PartsSolution solution = solved(goal, bodies);
    ASSERT_TRUE(solution.infeasible);
    const Eigen::VectorXd y = solution.separation.normalized();
    const Eigen::VectorXd q = goal.J.transpose() * y;
    double margin = y.dot(goal.c_0);
    for (std::size_t j = 0; j < bodies.size(); ++j) {
      const Moments q_j = q.segment<10>(10 * static_cast<Eigen::Index>(j));
      margin += q_j.dot(moments_where(bodies[j], q_j));
    }
    EXPECT_GT(margin, 0);
  }
}

}  // namespace
}  // namespace rayrep::test
