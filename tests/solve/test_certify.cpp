#include <gtest/gtest.h>

#include "ray_problems.h"
#include "rayrep/base/error.h"
#include "rayrep/solve/certify.h"
#include "rayrep/solve/quadric.h"

namespace rayrep {
namespace {

using namespace test;

Interval heights_of(const RayBody& body) {
  Interval heights{1e9, -1e9};
  for (const Interval& interval : body.domain.intervals) {
    heights.lo = std::min(heights.lo, interval.lo - 4);  // the thickest wall of random_body
    heights.hi = std::max(heights.hi, interval.hi + 4);
  }
  return heights;
}

CertifiedSpin problem_of(const RayBody& body, double lambda) {
  return {.lambda = lambda, .gamma_i = 1, .yoyo = false, .volume_mm3 = body.solid()[M1], .length_mm = body.length_mm};
}

class CertifyRandom : public ::testing::TestWithParam<int> {};

TEST_P(CertifyRandom, NothingAttainableIsBelowTheBound) {
  Random random(static_cast<std::uint64_t>(1000 + GetParam()));
  int proven = 0;
  int refused = 0;
  for (int n = 0; n < 12; ++n) {
    const RayBody body = random_body(random, 30);
    const RayIntegrals rays(body.domain);
    const CertifiedSpin problem = problem_of(body, random.uniform(0.02, 0.5));
    const SpinCertificate certificate = certify_spin(problem, rays, body.shell, {.heights = heights_of(body)});
    if (certificate.infeasible) {
      ++refused;
      continue;
    }
    ++proven;
    EXPECT_TRUE(certificate.closed) << n << ": gap " << certificate.gap;
    EXPECT_LE(certificate.gap, 1e-4);
    EXPECT_TRUE(certificate.best.converged);
    EXPECT_LE(certificate.lower_bound, certificate.best.objective);
    // The optima for other weights are interiors that meet the same constraints, and so are mixtures of two.
    const Goal goal = spin_goal({.lambda = problem.lambda}, true, false, problem.volume_mm3, problem.length_mm);
    Moments last = certificate.best.moments;
    for (const double lambda : {0.0, 0.05, 0.2, 1.0, 5.0}) {
      const Goal other = spin_goal({.lambda = lambda}, random.uniform() < 0.5, false, problem.volume_mm3, problem.length_mm);
      const QuadricSolution solution = solve_quadric(other, rays, body.shell);
      if (!solution.converged) continue;
      const double share = random.uniform();
      for (const Moments& s : {solution.moments, Moments(share * solution.moments + (1 - share) * last)})
        EXPECT_GE(goal.objective(s), certificate.lower_bound - 1e-9);
      last = solution.moments;
    }
  }
  EXPECT_GT(proven, 0);
  EXPECT_GT(refused, 0);
}

INSTANTIATE_TEST_SUITE_P(Seeds, CertifyRandom, ::testing::Range(0, 4));

TEST(Certify, NoHeightIsBelowTheBoundOfItsRange) {
  // At other heights of the range the problem is solved by itself: none of the optima is below the bound, or at a height ruled out.
  // Ranges of every width on both sides, so that a term of first or second order in the width that is missing shows.
  Random random(77);
  int compared = 0;
  int shortened = 0;
  double closest = 1e300;
  for (int n = 0; n < 40; ++n) {
    const RayBody body = random_body(random, 24);
    const RayIntegrals rays(body.domain);
    const CertifiedSpin problem = problem_of(body, random.uniform(0, 0.05));
    const Goal top = spin_goal({.lambda = problem.lambda}, true, false, problem.volume_mm3, problem.length_mm);
    const QuadricSolution best = solve_quadric(top, rays, body.shell);
    if (!best.converged) continue;
    const double centre = best.moments[MZ] / best.moments[M1];
    const Goal fixed = spin_goal({.lambda = 0}, true, true, problem.volume_mm3, problem.length_mm);
    for (const double from : {-3.0, -0.5, 0.0, 0.5, 3.0, 15.0})
      for (const double width : {-12.0, -3.0, -0.3, 0.3, 3.0, 12.0}) {
        const double l = centre + from;
        const HeightBound range = bound_heights(problem, rays, body.shell, l, l + width);
        shortened += range.heights.length() < 0.999 * std::abs(width);
        for (const double part : {0.05, 0.3, 0.7, 1.0}) {
          const double at = l + part * width;
          const Goal goal = mapped(fixed, moment_map(Eigen::Affine3d(Eigen::Translation3d(0, 0, -at))));
          const QuadricSolution solution = solve_quadric(goal, rays, body.shell);
          if (!solution.converged) continue;
          ++compared;
          const double objective = top.objective(solution.moments);
          EXPECT_GE(at, range.heights.lo - 1e-9);
          EXPECT_LE(at, range.heights.hi + 1e-9);
          EXPECT_GE(objective, range.bound - 1e-9) << n << ": from " << from << ", width " << width << ", part " << part;
          closest = std::min(closest, (objective - range.bound) / std::abs(width));
        }
      }
  }
  EXPECT_GT(compared, 500);
  EXPECT_GT(shortened, 20);
  EXPECT_LT(closest, 3e-3);  // per mm: and the bound is not empty, it loses lambda / L at most where the range is narrow
}

TEST(Certify, ABoundOfFewNodesIsLowerAndStillTrue) {
  Random random(5);
  for (int n = 0; n < 6; ++n) {
    const RayBody body = random_body(random, 30);
    const RayIntegrals rays(body.domain);
    const CertifiedSpin problem = problem_of(body, 0.1);
    const SpinCertificate full = certify_spin(problem, rays, body.shell, {.heights = heights_of(body)});
    if (full.infeasible) continue;
    double before = -1e300;
    for (const int nodes : {1, 3, 9, 27}) {
      const SpinCertificate some =
          certify_spin(problem, rays, body.shell, {.heights = heights_of(body), .gap = 1e-4, .max_nodes = nodes});
      EXPECT_LE(some.lower_bound, full.best.objective);
      EXPECT_GE(some.lower_bound, before - 1e-12);
      EXPECT_LE(some.nodes, nodes);
      before = some.lower_bound;
    }
  }
}

TEST(Certify, AYoyosStationaryPointIsItsOptimum) {
  // The problem is quasiconvex: the multipliers alone close the gap.
  Random random(9);
  int closed = 0;
  for (int n = 0; n < 60; ++n) {
    RayBody body = random_body(random, 24);
    const Moments solid = body.solid();
    const Eigen::Vector3d centre = solid.segment<3>(MX) / solid[M1] + random.in_box(0.5);
    body.domain = moved(body.domain, -centre);
    body.shell = translated(body.shell, -centre);
    CertifiedSpin problem = problem_of(body, 0);
    problem.yoyo = true;
    const SpinCertificate certificate = certify_spin(problem, RayIntegrals(body.domain), body.shell, {});
    if (certificate.infeasible) continue;
    ++closed;
    EXPECT_LT(certificate.gap, 1e-8) << n;
    EXPECT_EQ(certificate.nodes, 1);
  }
  EXPECT_GT(closed, 5);
}

/// The best over a grid of heights, each solved by itself; with a volume of material where one is given.
double least_over_heights(const CertifiedSpin& problem, const RayBody& body, const RayIntegrals& rays, const Interval& heights) {
  const Goal top = spin_goal({.lambda = problem.lambda}, true, false, problem.volume_mm3, problem.length_mm);
  double least = 1e300;
  constexpr int steps = 40;
  for (int n = 0; n <= steps; ++n) {
    const double at = heights.lo + heights.length() * n / steps;
    Goal goal = mapped(spin_goal({.lambda = 0}, true, true, problem.volume_mm3, problem.length_mm),
                       moment_map(Eigen::Affine3d(Eigen::Translation3d(0, 0, -at))));
    if (problem.material_mm3) goal = with_equation(goal, Moments::Unit(M1) / *problem.material_mm3, -1);
    const QuadricSolution solution = solve_quadric(goal, rays, body.shell);
    if (solution.converged) least = std::min(least, top.objective(solution.moments));
  }
  return least;
}

TEST(Certify, WithinHeightsTheBestOfThoseIsFound) {
  Random random(751);
  int at_an_end = 0;
  int inside = 0;
  int impossible = 0;
  for (int n = 0; n < 40; ++n) {
    const RayBody body = random_body(random, 24);
    const RayIntegrals rays(body.domain);
    CertifiedSpin problem = problem_of(body, random.uniform(0.02, 0.3));
    const SpinCertificate free = certify_spin(problem, rays, body.shell, {.heights = heights_of(body)});
    if (free.infeasible) continue;
    if (n % 2) problem.material_mm3 = free.best.moments[M1] * random.uniform(0.97, 1.05);
    const double centre = free.best.moments[MZ] / free.best.moments[M1];
    const double from = centre + random.uniform(-3, 1.5);
    const Interval heights{from, from + random.uniform(0, 2)};
    const SpinCertificate within = certify_spin(problem, rays, body.shell, {.heights = heights, .within = true});
    const double twin = least_over_heights(problem, body, rays, heights);
    if (within.infeasible) {
      ++impossible;
      EXPECT_GT(twin, 1e299);
      continue;
    }
    ASSERT_TRUE(within.best.converged);
    const double height = within.best.moments[MZ] / within.best.moments[M1];
    EXPECT_GE(height, heights.lo - 1e-7);
    EXPECT_LE(height, heights.hi + 1e-7);
    const double material = problem.material_mm3.value_or(within.best.moments[M1]);
    EXPECT_NEAR(within.best.moments[M1], material, 1e-6 * material);
    EXPECT_TRUE(within.closed) << n << " " << within.gap;
    EXPECT_GE(twin, within.lower_bound - 1e-9);
    EXPECT_GE(within.best.objective, free.lower_bound - 1e-9);
    EXPECT_NEAR(within.best.objective, twin, 2e-3 * twin);  // of 41 heights
    const Goal top = spin_goal({.lambda = problem.lambda}, true, false, problem.volume_mm3, problem.length_mm);
    EXPECT_NEAR(top.objective(within.best.moments), within.best.objective, 1e-8);
    (std::min(height - heights.lo, heights.hi - height) < 1e-3 ? at_an_end : inside) += 1;
  }
  EXPECT_GT(at_an_end, 3);
  EXPECT_GT(inside, 1);
  EXPECT_GT(impossible, 0);
}

TEST(Certify, StopsWhenCancelled) {
  Random random(5);
  for (;;) {
    const RayBody body = random_body(random, 24);
    const RayIntegrals rays(body.domain);
    const CertifiedSpin problem = problem_of(body, 0.1);
    if (certify_spin(problem, rays, body.shell, {.heights = heights_of(body)}).infeasible) continue;
    Progress progress;
    progress.cancelled = [] { return true; };
    EXPECT_THROW(certify_spin(problem, rays, body.shell, {.heights = heights_of(body), .gap = 1e-12}, progress), Error);
    break;
  }
}

TEST(MomentMap, IsTheMotionOfABody) {
  const Mesh solid = rotated(box({-3, -2, -1}, {5, 4, 7}), random_rotation(3));
  Eigen::Affine3d motion(random_rotation(8));
  motion.translation() = Eigen::Vector3d(4, -7, 2);
  const Moments expected = mesh_moments(transformed(solid, motion));
  EXPECT_LT((moment_map(motion) * mesh_moments(solid) - expected).norm(), 1e-10 * expected.norm());
}

}  // namespace
}  // namespace rayrep
