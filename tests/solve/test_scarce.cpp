// A core of which there is not enough: two level sets of one quadric, and a price. theory.md (49)

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "ray_problems.h"
#include "rayrep/rays/ray_integrals.h"
#include "rayrep/solve/quadric.h"
#include "solids.h"

namespace rayrep::test {
namespace {

/// A core of c times the density of the print, of which there are so many mm^3.
RayBody with_core(RayBody body, double c, double most_mm3) {
  body.domain.grid.weight = c;
  body.domain.grid.substitute = 1 / c;
  body.domain.grid.most_mm3 = most_mm3;
  return body;
}

RayBody glass(double c, double most_mm3) {
  RayGrid grid;
  grid.spacing_mm = 0.5;
  grid.nx = grid.ny = 36;
  grid.origin_mm.setConstant(-9 + 0.25);
  RayBody body{ray_rep(grid, [](const Eigen::Vector2d&) { return std::vector<Interval>{{1, 19}}; }), Moments::Zero(), 30};
  body.shell = box_moments({-10, -10, 0}, {10, 10, 20}) - ray_moments(body.domain);
  return with_core(body, c, most_mm3);
}

constexpr double kArea = 18 * 18;

TEST(Scarce, AGlassHasItsCoreBelowItsPlasticBelowItsCentreOfMass) {
  constexpr double c = 6;
  const RayBody body = glass(c, kArea * 2);  // 2 mm high
  const RayIntegrals rays(body.domain);
  const QuadricSolution solution = solve_quadric(stand_goal({0, 0}, 8000, 30), rays, body.shell);
  ASSERT_TRUE(solution.converged);
  EXPECT_NEAR(solution.filled_mm3, kArea * 2, 1e-5 * kArea);
  EXPECT_GT(solution.price, 0);
  const double to_core = -(solution.q[M1] + solution.price) / solution.q[MZ];
  const double to_plastic = -solution.q[M1] / solution.q[MZ];
  EXPECT_NEAR(to_core, 3, 1e-6);
  // Plastic helps as long as it lies below the centre of mass: z m(z) of all that is below is stationary there.
  const auto height = [&](double z) {
    const double mass = body.shell[M1] + kArea * (2 * c + (z - 3));
    return (body.shell[MZ] + kArea * (2 * c * 2 + (z * z - 9) / 2)) / mass;
  };
  const double found = solution.moments[MZ] / solution.moments[M1];
  EXPECT_NEAR(to_plastic, found, 1e-6);
  EXPECT_NEAR(height(to_plastic), found, 1e-6);
  for (const double z : {to_plastic - 0.5, to_plastic + 0.5, 3.0, 19.0}) EXPECT_GT(height(z), found);
}

TEST(Scarce, MoreThanEnoughChangesNothing) {
  const RayBody body = glass(6, kArea * 18);
  RayBody unlimited = glass(6, 0);
  unlimited.domain.grid.most_mm3 = std::numeric_limits<double>::infinity();
  const Goal goal = stand_goal({0.2, 0}, 8000, 30);
  const QuadricSolution a = solve_quadric(goal, RayIntegrals(body.domain), body.shell);
  const QuadricSolution b = solve_quadric(goal, RayIntegrals(unlimited.domain), unlimited.shell);
  EXPECT_EQ(a.q, b.q);
  EXPECT_EQ(a.price, 0);
  EXPECT_EQ(a.filled_mm3, b.filled_mm3);
}

TEST(Scarce, OfWhatCannotDoWithoutItIsSaidHowMuchItTakes) {
  // It floats at a mass that plastic alone does not have.
  const RayBody body = glass(6, kArea);
  const double plastic = body.shell[M1] + kArea * 18;
  const Goal goal = float_goal(plastic + 5 * kArea * 2, {0, 0}, 30);  // 2 mm of core for plastic
  const QuadricSolution solution = solve_quadric(goal, RayIntegrals(body.domain), body.shell);
  EXPECT_FALSE(solution.converged);
  EXPECT_TRUE(solution.infeasible);
  EXPECT_NEAR(solution.filled_mm3, 2 * kArea, 1e-3 * kArea);
  const RayBody more = glass(6, 2.01 * kArea);
  EXPECT_TRUE(solve_quadric(goal, RayIntegrals(more.domain), more.shell).converged);
}

TEST(Scarce, NoInteriorWithinTheBudgetUndercutsTheBound) {
  Random random(11);
  for (int n = 0; n < 20; ++n) {
    const RayBody plain = random_body(random, 30);
    const double c = random.uniform(1.5, 9);
    const double room = ray_moments(plain.domain)[M1];
    const double most = room * random.uniform(0.05, 0.6);
    const RayBody body = with_core(plain, c, most);
    const RayIntegrals rays(body.domain);
    const auto random_q = [&] {
      Moments q;
      for (int k = 0; k < 10; ++k) q[k] = random.uniform(-1, 1) * std::pow(20.0, k == M1 ? 0 : k <= MZ ? -1 : -2);
      return q;
    };
    int compared = 0;
    for (int k = 0; k < 60; ++k) {
      const Moments q = random_q();
      const double price = random.uniform(0, 1);
      const RayIntegrals::Priced other = rays.priced(random_q(), random.uniform(0, 2));
      // By hand: plain where one quadric is negative, core where the other one is.
      if (other.filled_mm3 > most) continue;
      ++compared;
      EXPECT_LE(rays.least(q, price), q.dot(other.pass.moments) + 1e-9 * std::abs(q.dot(rays.full())));
    }
    EXPECT_GT(compared, 3);
    // What is priced is core in one part and plain in the other.
    const Moments q = random_q();
    const double price = random.uniform(0, 0.5);
    Moments dear = q;
    dear[M1] += price;
    RayRep unit = plain.domain;
    const Moments core = ray_moments(negative_part(unit, dear));
    const Moments both = ray_moments(negative_part(unit, q));
    const RayIntegrals::Priced priced = rays.priced(q, price);
    EXPECT_TRUE(moments_near(priced.pass.moments, both + (c - 1) * core, 1e-10, 50));
    EXPECT_NEAR(priced.filled_mm3, core[M1], 1e-10 * room);
    EXPECT_NEAR(priced.cost, (c - 1) * price * core[M1], 1e-9 * room);
  }
}

TEST(Scarce, RandomProblemsUseAllThereIsAndCloseTheGap) {
  int floats = 0, others = 0;
  for (std::uint64_t seed = 0; seed < 120; ++seed) {
    SCOPED_TRACE(seed);
    Random random(seed + 900);
    const RayBody plain = random_body(random, 30);
    const double c = random.uniform(1.5, 9);
    RayBody body = with_core(plain, c, std::numeric_limits<double>::infinity());
    const Moments full = ray_moments(body.domain);
    const double volume = body.shell[M1] + full[M1];
    const int kind = static_cast<int>(seed % 3);
    const Eigen::Vector2d at = (body.shell + 0.4 * full).segment<2>(MX) / (body.shell + 0.4 * full)[M1];
    const Goal goal = kind == 0   ? float_goal(body.shell[M1] + 0.4 * full[M1], at, body.length_mm)
                      : kind == 1 ? stand_goal(at, volume, body.length_mm)
                                  : spin_goal({}, true, false, volume, body.length_mm);
    const QuadricSolution free = solve_quadric(goal, RayIntegrals(body.domain), body.shell);
    if (!free.converged) continue;
    body.domain.grid.most_mm3 = random.uniform(0.3, 0.9) * free.filled_mm3;
    const RayIntegrals rays(body.domain);
    const QuadricSolution solution = solve_quadric(goal, rays, body.shell);
    EXPECT_NE(solution.converged, solution.infeasible);
    if (!solution.converged) continue;
    ++(kind == 0 ? floats : others);
    EXPECT_LE(solution.filled_mm3, body.domain.grid.most_mm3 * (1 + 1e-9));
    EXPECT_GE(solution.filled_mm3, body.domain.grid.most_mm3 * (1 - 1e-5));
    EXPECT_LT(goal.constraint_values(solution.moments).cwiseAbs().maxCoeff(), 1e-8);
    EXPECT_GE(solution.objective, free.objective - 1e-9 * std::abs(free.objective));
    if (kind == 0) {
      EXPECT_NEAR(solution.lower_bound, solution.objective, 1e-5 * std::abs(solution.objective));
    }
    // No worse than the same volume shared out without plain material in between: a mixture of it and of the empty.
    const RayIntegrals::Priced priced = rays.priced(solution.q, solution.price);
    EXPECT_TRUE(moments_near(body.shell + priced.pass.moments, solution.moments, 1e-8, 50));
  }
  EXPECT_GT(floats, 8);
  EXPECT_GT(others, 20);
}

}  // namespace
}  // namespace rayrep::test
