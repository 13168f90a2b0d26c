#include <gtest/gtest.h>

#include "ray_problems.h"
#include "rayrep/certify.h"
#include "rayrep/error.h"
#include "rayrep/quadric.h"

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
    const SpinCertificate certificate = certify_spin(problem, rays, body.shell, heights_of(body));
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
    const SpinGoal goal({.lambda = problem.lambda}, true, false, problem.volume_mm3, problem.length_mm);
    Moments last = certificate.best.moments;
    for (const double lambda : {0.0, 0.05, 0.2, 1.0, 5.0}) {
      const SpinGoal other({.lambda = lambda}, random.uniform() < 0.5, false, problem.volume_mm3, problem.length_mm);
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

TEST(Certify, ABoundOfFewNodesIsLowerAndStillTrue) {
  Random random(5);
  for (int n = 0; n < 6; ++n) {
    const RayBody body = random_body(random, 30);
    const RayIntegrals rays(body.domain);
    const CertifiedSpin problem = problem_of(body, 0.1);
    const SpinCertificate full = certify_spin(problem, rays, body.shell, heights_of(body));
    if (full.infeasible) continue;
    double before = -1e300;
    for (const int nodes : {1, 3, 9, 27}) {
      const SpinCertificate some = certify_spin(problem, rays, body.shell, heights_of(body), {.gap = 1e-4, .max_nodes = nodes});
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
    const SpinCertificate certificate = certify_spin(problem, RayIntegrals(body.domain), body.shell, {0, 0});
    if (certificate.infeasible) continue;
    ++closed;
    EXPECT_LT(certificate.gap, 1e-8) << n;
    EXPECT_EQ(certificate.nodes, 1);
  }
  EXPECT_GT(closed, 5);
}

TEST(Certify, StopsWhenCancelled) {
  Random random(5);
  for (;;) {
    const RayBody body = random_body(random, 24);
    const RayIntegrals rays(body.domain);
    const CertifiedSpin problem = problem_of(body, 0.1);
    if (certify_spin(problem, rays, body.shell, heights_of(body)).infeasible) continue;
    Progress progress;
    progress.cancelled = [] { return true; };
    EXPECT_THROW(certify_spin(problem, rays, body.shell, heights_of(body), {.gap = 1e-12}, progress), Error);
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
