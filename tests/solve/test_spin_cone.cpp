// The moment about an axis over the larger one across it, as a cone: theory.md (76)

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "ray_problems.h"
#include "rayrep/rays/ray_integrals.h"
#include "rayrep/rays/ray_interior.h"
#include "rayrep/solve/nlp.h"
#include "rayrep/solve/quadric.h"
#include "rayrep/solve/solve.h"
#include "rayrep/solve/solve_target.h"
#include "solids.h"

namespace rayrep::test {
namespace {

/// A body with its wanted centre of mass at the origin, and what is asked of it but for the cone.
struct Case {
  RayBody body;
  TargetGoal::Setup setup;
};

Case random_case(Random& random, int across) {
  Case c;
  c.body = random_body(random, across);
  const Moments middle = c.body.shell + random.uniform(0.4, 0.9) * ray_moments(c.body.domain);
  const Eigen::Vector3d centre = middle.segment<3>(MX) / middle[M1] + random.in_box(0.3);
  c.body.domain = moved(c.body.domain, -centre);
  c.body.shell = translated(c.body.shell, -centre);
  for (int k = MX; k <= MZ; ++k) c.setup.wanted[static_cast<std::size_t>(k)] = 0;
  c.setup.volume_mm3 = c.body.solid()[M1];
  c.setup.length_mm = c.body.length_mm;
  if (random.uniform() < 0.5) c.setup.axes = random_rotation(static_cast<std::uint64_t>(1e9 * random.uniform()));
  c.setup.up = c.setup.axes.col(2);
  return c;
}

/// Moment about a unit vector through the origin, unit density.
double moment_about(const Moments& s, const Eigen::Vector3d& u) {
  Eigen::Matrix3d M;
  M << s[MXX], s[MXY], s[MXZ], s[MXY], s[MYY], s[MYZ], s[MXZ], s[MYZ], s[MZZ];
  return M.trace() - u.dot(M * u);
}

/// Over directions across, one by one.
double ratio_by_trying(const Moments& s, const TargetGoal::Setup& setup) {
  double larger = 0;
  constexpr int directions = 20000;
  for (int n = 0; n < directions; ++n) {
    const double angle = kPi * n / directions;
    larger = std::max(larger, moment_about(s, std::cos(angle) * setup.axes.col(0) + std::sin(angle) * setup.axes.col(1)));
  }
  return moment_about(s, setup.up) / larger;
}

/// With a half-space for each of many directions in place of the cone, which lies within all of them.
Goal with_many_cuts(Goal goal, const TargetGoal::Setup& setup, int directions) {
  goal.cone.reset();
  for (int n = 0; n < directions; ++n) {
    const double angle = kPi * n / directions;
    const Eigen::Vector3d u = std::cos(angle) * setup.axes.col(0) + std::sin(angle) * setup.axes.col(1);
    Moments a;
    for (int k = 0; k < 10; ++k)
      a[k] = *setup.least_spin_ratio * moment_about(Moments::Unit(k), u) - moment_about(Moments::Unit(k), setup.up);
    goal = with_at_most(std::move(goal), a / (setup.volume_mm3 * setup.length_mm * setup.length_mm), 0);
  }
  return goal;
}

TEST(SpinCone, IsMetInEveryDirectionAndNoMoreThanThat) {
  Random random(760);
  int active = 0;
  int refused = 0;
  int unsolved = 0;
  for (int n = 0; n < 60; ++n) {
    Case c = random_case(random, 24);
    const RayIntegrals rays(c.body.domain);
    const TargetSolution free = solve_target(c.setup, rays, c.body.shell);
    if (!free.solution.converged) continue;
    const double before = ratio_by_trying(free.solution.moments, c.setup);
    c.setup.least_spin_ratio = before * random.uniform(0.97, 1.12);
    const TargetSolution found = solve_target(c.setup, rays, c.body.shell);
    if (found.solution.infeasible) {
      ++refused;
      const Goal rows = with_cuts(found.goal, found.solution.cuts);
      EXPECT_GT(separation_margin(rows, found.solution.separation, rays, c.body.shell), 0);
      continue;
    }
    if (!found.solution.converged) {
      ++unsolved;
      continue;
    }
    const double after = ratio_by_trying(found.solution.moments, c.setup);
    EXPECT_GE(after, *c.setup.least_spin_ratio * (1 - 1e-7));  // 1e-9 of V L^2
    EXPECT_NEAR(found.solution.objective, found.solution.lower_bound, 1e-8 * std::abs(found.solution.lower_bound));
    if (before >= *c.setup.least_spin_ratio) {
      EXPECT_TRUE(found.solution.cuts.empty());
      EXPECT_NEAR(found.solution.objective, free.goal.objective(free.solution.moments), 1e-9);
      continue;
    }
    ++active;
    EXPECT_NEAR(after, *c.setup.least_spin_ratio, 2e-7);
    // The polygon of many half-spaces around the cone lets a little more, and never less.
    const QuadricSolution twin = solve_quadric(with_many_cuts(found.goal, c.setup, 60), rays, c.body.shell);
    if (!twin.converged) continue;
    EXPECT_LE(found.goal.objective(twin.moments), found.solution.objective + 1e-8);
    EXPECT_NEAR(found.goal.objective(twin.moments), found.solution.objective, 1e-3 * std::abs(found.solution.objective)) << n;
  }
  EXPECT_GT(active, 30);
  EXPECT_GT(refused, 2);
  EXPECT_EQ(unsolved, 0);
}

TEST(SpinCone, TheMultipliersBoundWhateverLiesInIt) {
  // Of a concave dual any multipliers that are not negative give a bound: those of the cuts found, too. Interiors for other weights
  // that meet the constraints do no better.
  Random random(761);
  int compared = 0;
  for (int n = 0; n < 40; ++n) {
    Case c = random_case(random, 20);
    const RayIntegrals rays(c.body.domain);
    const TargetSolution free = solve_target(c.setup, rays, c.body.shell);
    if (!free.solution.converged) continue;
    c.setup.least_spin_ratio = ratio_by_trying(free.solution.moments, c.setup) * 1.02;
    const TargetSolution best = solve_target(c.setup, rays, c.body.shell);
    if (!best.solution.converged) continue;
    const Goal rows = with_cuts(best.goal, best.solution.cuts);
    ASSERT_EQ(rows.constraints(), best.solution.multipliers.size());
    EXPECT_GE(best.solution.multipliers.tail(rows.at_most).minCoeff(), 0);
    for (const MomentIndex other : {MXX, MYY, MZZ, M1}) {
      TargetGoal::Setup more = c.setup;
      more.order = {{other, true}};
      more.least_spin_ratio = *c.setup.least_spin_ratio * random.uniform(1, 1.02);
      const TargetSolution solution = solve_target(more, rays, c.body.shell);
      if (!solution.solution.converged) continue;
      ++compared;
      EXPECT_GE(best.goal.objective(solution.solution.moments), best.solution.lower_bound - 1e-9);
    }
  }
  EXPECT_GT(compared, 40);
}

TEST(SpinCone, AgreesWithIpoptOnTheSameRays) {
  Random random(762);
  int compared = 0;
  double nearest = 1;
  for (int n = 0; n < 12; ++n) {
    Case c = random_case(random, 14);
    c.setup.axes.setIdentity();
    c.setup.up = Eigen::Vector3d::UnitZ();
    const RayIntegrals rays(c.body.domain);
    const TargetSolution free = solve_target(c.setup, rays, c.body.shell);
    if (!free.solution.converged) continue;
    c.setup.least_spin_ratio = ratio_by_trying(free.solution.moments, c.setup) * 1.03;
    const TargetSolution exact = solve_target(c.setup, rays, c.body.shell);
    if (!exact.solution.converged) continue;
    const Goal many = with_many_cuts(exact.goal, c.setup, 90);
    const SegmentRays interior(c.body.domain, Between::material);
    const InteriorNlp nlp(many, interior, c.body.shell, {c.body.solid()[M1], c.body.length_mm});
    SolveOptions options;
    options.tolerance = 1e-6;
    options.barrier_target = 1e-8;
    const SolveReport report = solve_ipopt(nlp, options);
    if (report.status != SolveStatus::converged) continue;
    const Moments s = nlp.body(report.x);
    const double difference = exact.goal.objective(s) / exact.solution.objective - 1;
    EXPECT_GT(difference, -2e-3) << n;  // the polygon's corners, and one segment a ray
    nearest = std::min(nearest, std::abs(difference));
    ++compared;
  }
  EXPECT_GE(compared, 3);
  EXPECT_LT(nearest, 2e-3);
}

}  // namespace
}  // namespace rayrep::test
