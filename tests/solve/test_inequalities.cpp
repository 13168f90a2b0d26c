// Goals with inequalities: theory.md (70)

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "ray_problems.h"
#include "rayrep/rays/ray_integrals.h"
#include "rayrep/solve/nlp.h"
#include "rayrep/solve/quadric.h"
#include "rayrep/solve/solve.h"
#include "solids.h"

namespace rayrep::test {
namespace {

/// Moments over what makes them of order 1.
Moments unit_of(const RayBody& body) { return moment_units(body.solid()[M1], body.length_mm); }

/// Cuts off the moments `s` by a random plane through a mixture of them and the middle of all.
Goal with_random_cut(Goal goal, Random& random, const RayBody& body, const Moments& s, bool first_moments_only) {
  const Moments unit = unit_of(body);
  Moments a = Moments::Zero();
  for (int k = 0; k < (first_moments_only ? MZ : 10); ++k) a[k] = random.uniform(-1, 1) / unit[k];
  const Moments middle = body.shell + 0.5 * ray_moments(body.domain);
  if (a.dot(s - middle) < 0) a = -a;
  const Moments on = middle + random.uniform(0.2, 1.05) * (s - middle);
  return with_at_most(std::move(goal), a, -a.dot(on));
}

/// The best of all choices of inequalities that are met as equations, those that meet the others.
double least_by_trying_all(const Goal& goal, const RayIntegrals& rays, const Moments& shell) {
  const Eigen::Index equations = goal.constraints() - goal.at_most;
  double least = std::numeric_limits<double>::infinity();
  for (unsigned set = 0; set < 1u << goal.at_most; ++set) {
    Goal some = goal;
    some.at_most = 0;
    Eigen::Index rows = equations;
    for (Eigen::Index k = 0; k < goal.at_most; ++k) {
      if (!(set >> k & 1)) continue;
      some.J.row(rows) = goal.J.row(equations + k);
      some.c_0[rows++] = goal.c_0[equations + k];
    }
    some.J.conservativeResize(rows, 10);
    some.c_0.conservativeResize(rows);
    const QuadricSolution solution = solve_quadric(some, rays, shell);
    if (!solution.converged) continue;
    if (goal.constraint_values(solution.moments).tail(goal.at_most).maxCoeff() > 1e-8) continue;
    least = std::min(least, solution.objective);
  }
  return least;
}

TEST(Inequalities, AreMetWithMultipliersThatAreNotNegative) {
  Random random(700);
  int active = 0;
  int unsolved = 0;
  for (int n = 0; n < 120; ++n) {
    const RayBody body = random_body(random, 24);
    const RayIntegrals rays(body.domain);
    Goal goal = random_goal(random, Kind::floating, body);
    const QuadricSolution free = solve_quadric(goal, rays, body.shell);
    if (!free.converged) continue;
    const int cuts = 1 + n % 3;
    for (int k = 0; k < cuts; ++k) goal = with_random_cut(std::move(goal), random, body, free.moments, false);
    const double twin = least_by_trying_all(goal, rays, body.shell);
    const QuadricSolution solution = solve_quadric(goal, rays, body.shell);
    if (!std::isfinite(twin)) {
      EXPECT_FALSE(solution.converged);
      continue;
    }
    if (!solution.converged) {
      ++unsolved;
      continue;
    }
    const Eigen::VectorXd c = goal.constraint_values(solution.moments);
    const Eigen::VectorXd slack = c.tail(goal.at_most);
    const Eigen::VectorXd nu = solution.multipliers.tail(goal.at_most);
    EXPECT_LT(c.head(c.size() - goal.at_most).cwiseAbs().maxCoeff(), 1e-9);
    EXPECT_LT(slack.maxCoeff(), 1e-9);
    EXPECT_GE(nu.minCoeff(), 0);
    EXPECT_LT(nu.cwiseProduct(slack).cwiseAbs().maxCoeff(), 1e-8 * (1 + nu.maxCoeff()));
    EXPECT_NEAR(solution.objective, twin, 1e-8) << n;
    EXPECT_NEAR(solution.objective, solution.lower_bound, 1e-8);
    active += nu.maxCoeff() > 0;
  }
  EXPECT_GT(active, 25);
  EXPECT_LE(unsolved, 1);
}

TEST(Inequalities, AgreeWithIpoptOnTheSameRays) {
  Random random(701);
  int compared = 0;
  for (int n = 0; n < 30; ++n) {
    const RayBody body = random_body(random, 16);
    const RayIntegrals rays(body.domain);
    Goal goal = random_goal(random, Kind::floating, body);
    const QuadricSolution free = solve_quadric(goal, rays, body.shell);
    if (!free.converged) continue;
    // No mass is given, but one that it has at least; and cuts across.
    goal.J = goal.J.bottomRows(2).eval();
    goal.c_0 = goal.c_0.tail(2).eval();
    goal = with_at_most(std::move(goal), -Moments::Unit(M1) / free.moments[M1], 1);
    goal = with_random_cut(std::move(goal), random, body, free.moments, true);
    const QuadricSolution exact = solve_quadric(goal, rays, body.shell);
    if (!exact.converged || exact.q[MZ] <= 0) continue;
    const BottomFilledRays interior(body.domain);
    const InteriorNlp nlp(goal, interior, body.shell, {body.solid()[M1], body.length_mm});
    SolveOptions options;
    options.tolerance = 1e-7;
    options.barrier_target = 1e-9;
    const SolveReport report = solve_ipopt(nlp, options);
    if (report.status != SolveStatus::converged) continue;
    const Moments s = nlp.body(report.x);
    EXPECT_NEAR(goal.objective(s), exact.objective, 2e-5) << n;
    EXPECT_LT(goal.constraint_values(s).tail(goal.at_most).maxCoeff(), 1e-5);
    ++compared;
  }
  EXPECT_GE(compared, 6);
}

TEST(Inequalities, AStandWithALargestMassIsTheLowestOfThoseWithIt) {
  Random random(702);
  int capped = 0;
  for (int n = 0; n < 25; ++n) {
    const RayBody body = random_body(random, 24);
    const RayIntegrals rays(body.domain);
    const Goal goal = random_goal(random, Kind::standing, body);
    const QuadricSolution free = solve_quadric(goal, rays, body.shell);
    if (!free.converged) continue;
    const double cap = body.shell[M1] + random.uniform(0.3, 1.3) * (free.moments[M1] - body.shell[M1]);
    const Goal limited = with_at_most(goal, Moments::Unit(M1) / cap, -1);
    Goal exact = limited;
    exact.at_most = 0;
    const QuadricSolution solution = solve_quadric(limited, rays, body.shell);
    if (cap > free.moments[M1]) {
      ASSERT_TRUE(solution.converged);
      EXPECT_NEAR(solution.objective, free.objective, 1e-9);
      EXPECT_EQ(solution.multipliers[2], 0);
      continue;
    }
    const QuadricSolution twin = solve_quadric(exact, rays, body.shell);
    EXPECT_EQ(solution.converged, twin.converged);
    if (!twin.converged) continue;
    ++capped;
    EXPECT_NEAR(solution.moments[M1], cap, 1e-7 * cap);
    EXPECT_NEAR(solution.objective, twin.objective, 1e-8);
    EXPECT_GT(solution.multipliers[2], 0);
  }
  EXPECT_GT(capped, 5);
}

TEST(Inequalities, ThatContradictEachOtherAreProvenTo) {
  Random random(703);
  const RayBody body = random_body(random, 24);
  const RayIntegrals rays(body.domain);
  const double solid = body.solid()[M1];
  Goal goal = float_goal(0.9 * solid, body.solid().segment<2>(MX) / solid, body.length_mm);
  goal.J = goal.J.bottomRows(2).eval();
  goal.c_0 = goal.c_0.tail(2).eval();
  goal = with_at_most(std::move(goal), Moments::Unit(M1) / body.shell[M1], -0.9);  // lighter than the shell
  const QuadricSolution solution = solve_quadric(goal, rays, body.shell);
  EXPECT_FALSE(solution.converged);
  ASSERT_TRUE(solution.infeasible);
  EXPECT_GE(solution.separation[2], 0);
  EXPECT_GT(separation_margin(goal, solution.separation, rays, body.shell), 0);
}

}  // namespace
}  // namespace rayrep::test
