#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <Eigen/Eigenvalues>
#include <cmath>
#include <string>

#include "ray_problems.h"
#include "rayrep/rays/ray_integrals.h"

namespace rayrep {
namespace {

using namespace test;

/// Quadrics of one kind that cut a body in two.
struct QuadricKind {
  std::string name;
  double zz;          ///< sign of q_zz
  bool second;        ///< has other second-order terms
  bool depends_on_z;  ///< has terms in z at all
};

Moments random_quadric(Random& random, const QuadricKind& kind, const Moments& full) {
  const double length = std::sqrt(full.segment<3>(MXX).sum() / full[M1]);
  Moments q = Moments::Zero();
  for (int k = MX; k <= MZ; ++k) q[k] = random.uniform(-1, 1) / length;
  for (int k = MXX; k <= MXZ && kind.second; ++k) q[k] = random.uniform(-1, 1) / (length * length);
  q[MZZ] = kind.zz * random.uniform(0.1, 1) / (length * length);
  if (!kind.depends_on_z) q[MZ] = q[MYZ] = q[MXZ] = 0;
  // Its zero set passes near the centre of the domain.
  q[M1] = 0.2 * random.uniform(-1, 1) * length * q.segment<3>(MX).norm() - q.dot(full) / full[M1];
  return q;
}

class OfQuadrics : public ::testing::TestWithParam<QuadricKind> {};

TEST_P(OfQuadrics, MomentsAreThoseOfTheClippedRays) {
  Random random(5);
  bool several = false;
  for (int n = 0; n < 40; ++n) {
    const RayBody body = random_body(random, 40);
    const RayIntegrals rays(body.domain);
    for (std::size_t ray = 0; ray < body.domain.grid.size(); ++ray)
      several |= body.domain.first[ray + 1] - body.domain.first[ray] > 1;
    const Moments q = random_quadric(random, GetParam(), rays.full());
    const Moments clipped = ray_moments(negative_part(body.domain, q));
    const Moments s = rays.moments(q);
    // Rounding of a root is that of the discriminant over its root: rays next to a tangent one cost some digits.
    EXPECT_TRUE(moments_near(s - clipped + rays.full(), rays.full(), 1e-12, 50)) << n;
    EXPECT_EQ(s, rays.pass(q).moments);
    EXPECT_GT(clipped[M1], 0);
    EXPECT_LT(clipped[M1], rays.full()[M1]);

    // Only the direction of q counts, and -q takes the rest.
    EXPECT_EQ(rays.moments(0x1p-70 * q), s);
    EXPECT_TRUE(moments_near(rays.moments(3e11 * q), s, 1e-12, 50)) << n;
    EXPECT_TRUE(moments_near(s + rays.moments(-q), rays.full(), 1e-13, 50)) << n;

    // S(q) minimises q.s over all interiors.
    const Moments other = random_quadric(random, GetParam(), rays.full());
    EXPECT_LE(q.dot(s), q.dot(rays.moments(other)) + 1e-12 * rays.full()[M1]);
  }
  EXPECT_TRUE(several) << "no ray had two intervals";
}

TEST_P(OfQuadrics, SpreadIsMinusTheDerivativeOfTheMoments) {
  Random random(7);
  int free_ends = 0;
  for (int n = 0; n < 20; ++n) {
    const RayBody body = random_body(random, 40);
    const RayIntegrals rays(body.domain);
    const Moments q = random_quadric(random, GetParam(), rays.full());
    const Eigen::Matrix<double, 10, 10> spread = rays.pass(q).spread;
    // In units that make all moments alike.
    Moments unit;
    unit << 1, Eigen::Vector3d::Constant(25), Eigen::Matrix<double, 6, 1>::Constant(625);
    const Eigen::Matrix<double, 10, 10> P = unit.cwiseInverse().asDiagonal() * spread * unit.cwiseInverse().asDiagonal();
    const double size = P.diagonal().maxCoeff();
    if (!GetParam().depends_on_z) {
      EXPECT_TRUE(spread.isZero(0)) << "no end is free";
      continue;
    }
    free_ends += size > 0;
    if (size == 0) continue;
    EXPECT_EQ(spread, spread.transpose());
    EXPECT_GE(Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd>(P).eigenvalues()[0], -1e-13 * size);
    // phi vanishes against q at every free end, as S does not change with the length of q.
    EXPECT_LT((P * q.cwiseProduct(unit)).norm(), 1e-11 * size * q.cwiseProduct(unit).norm());
    for (int k = 0; k < 10; ++k) {
      const double step = 1e-7 * q.cwiseProduct(unit).cwiseAbs().maxCoeff() / unit[k];
      Moments above = q;
      Moments below = q;
      above[k] += step;
      below[k] -= step;
      const Moments d = (rays.moments(above) - rays.moments(below)) / (2 * step);
      EXPECT_LT((d + spread.col(k)).cwiseQuotient(unit).norm() / unit[k], 2e-6 * size) << n << ", " << k;
    }
  }
  EXPECT_GE(free_ends, GetParam().depends_on_z ? 15 : 0);
}

INSTANTIATE_TEST_SUITE_P(Kinds, OfQuadrics,
                         ::testing::Values(QuadricKind{"bowl", 1, true, true}, QuadricKind{"dome", -1, true, true},
                                           QuadricKind{"linear_in_z", 0, true, true}, QuadricKind{"plane", 0, false, true},
                                           QuadricKind{"upright_cylinder", 0, true, false},
                                           QuadricKind{"upright_plane", 0, false, false}),
                         [](const auto& kind) { return kind.param.name; });

/// Every ray of a grid of 13 x 13, 1 mm apart, from z = -8 to 8. All numbers are exact in binary, also over 8 mm.
RayRep block() {
  RayGrid grid;
  grid.nx = grid.ny = 13;
  grid.origin_mm.setConstant(-6);
  return ray_rep(grid, [](const Eigen::Vector2d&) { return std::vector<Interval>{{-8, 8}}; });
}

TEST(RayRep, ThinnedKeepsEveryNthRay) {
  Random random(3);
  const RayBody body = random_body(random, 31);
  for (const int step : {1, 2, 3, 7}) {
    const RayRep thin = body.domain.thinned(step);
    ASSERT_EQ(thin.first.size(), thin.grid.size() + 1);
    for (std::size_t ray = 0; ray < thin.grid.size(); ++ray) {
      const std::size_t nx = static_cast<std::size_t>(thin.grid.nx);
      const std::size_t old =
          (ray / nx) * static_cast<std::size_t>(step * body.domain.grid.nx) + (ray % nx) * static_cast<std::size_t>(step);
      EXPECT_LT((thin.grid.at(ray) - body.domain.grid.at(old)).norm(), 1e-12);
      ASSERT_EQ(thin.first[ray + 1] - thin.first[ray], body.domain.first[old + 1] - body.domain.first[old]);
      for (std::uint32_t n = 0; n < thin.first[ray + 1] - thin.first[ray]; ++n) {
        EXPECT_EQ(thin.intervals[thin.first[ray] + n].lo, body.domain.intervals[body.domain.first[old] + n].lo);
        EXPECT_EQ(thin.intervals[thin.first[ray] + n].hi, body.domain.intervals[body.domain.first[old] + n].hi);
      }
    }
  }
}

TEST(RayIntegrals, ConstantsTakeAllOrNothing) {
  const RayRep domain = block();
  const RayIntegrals rays(domain);
  Moments q = Moments::Zero();
  q[M1] = 2;
  EXPECT_TRUE(rays.moments(q).isZero(0));
  EXPECT_TRUE(rays.pass(q).spread.isZero(0));
  expect_moments_near(rays.moments(-q), rays.full(), 1e-15, 8);
  expect_moments_near(rays.full(), ray_moments(domain), 0, 8);
  EXPECT_TRUE(rays.pass(-q).spread.isZero(0));
}

TEST(RayIntegrals, AnEmptyDomainHoldsNothing) {
  RayGrid grid;
  grid.nx = 3;
  grid.ny = 2;
  const RayIntegrals rays(ray_rep(grid, [](const Eigen::Vector2d&) { return std::vector<Interval>{}; }));
  const RayIntegrals::Pass pass = rays.pass(Moments::Ones());
  EXPECT_TRUE(pass.moments.isZero(0));
  EXPECT_TRUE(pass.spread.isZero(0));
  EXPECT_TRUE(rays.full().isZero(0));
  EXPECT_EQ(rays.intervals(), 0U);
}

TEST(RayIntegrals, TangentRaysGrowLikeARoot) {
  // A ball of radius 5 mm touches the twelve rays that are 5 mm off its centre: (5, 0), (4, 3) and so on.
  const RayRep domain = block();
  const RayIntegrals rays(domain);
  Moments q = Moments::Zero();
  q[MXX] = q[MYY] = q[MZZ] = 1;
  q[M1] = -25;
  const RayIntegrals::Pass ball = rays.pass(q);
  expect_moments_near(ball.moments, ray_moments(negative_part(domain, q)), 1e-14, 8);
  EXPECT_TRUE(ball.spread.allFinite());
  for (const double t : {1e-6, 1e-8, 1e-10}) {
    Moments larger = q;
    larger[M1] -= t;
    Moments smaller = q;
    smaller[M1] += t;
    // Each gains 2 sqrt(t), and nothing is lost but smoothly.
    EXPECT_NEAR((rays.moments(larger)[M1] - ball.moments[M1]) / std::sqrt(t), 24, 40 * std::sqrt(t) + 1e-4);
    EXPECT_LT(std::abs(rays.moments(smaller)[M1] - ball.moments[M1]), 40 * t);
  }
}

TEST(RayIntegrals, BlurIsTheMeanOverTheDiscriminant) {
  // One ray with q.phi = z^2 - c, whose discriminant over the ray's half length, 2 mm, is c / 1 mm^2: a free end at -sqrt(c) and
  // sqrt(c), each with weight A / (2 sqrt(c)), and its mean over c - blur ... c + blur.
  RayGrid grid;
  grid.nx = grid.ny = 1;
  const RayIntegrals rays(ray_rep(grid, [](const Eigen::Vector2d&) { return std::vector<Interval>{{-2, 2}}; }));
  for (const double c : {1.0, 0.3, 0.1, 0.01, 0.0, -0.02, -0.05, -0.2}) {
    Moments q = Moments::Zero();
    q[MZZ] = 1;
    q[M1] = -c;
    for (const double blur : {0.1, 0.001}) {
      const double mean = (std::sqrt(std::max(c + blur, 0.0)) - std::sqrt(std::max(c - blur, 0.0))) / blur;
      EXPECT_NEAR(rays.pass(q, blur).spread(M1, M1), mean, 1e-12 * mean) << c << ", " << blur;
    }
    if (c > 0) {
      EXPECT_NEAR(rays.pass(q).spread(M1, M1), 1 / std::sqrt(c), 1e-12 / std::sqrt(c)) << c;
    }
  }
}

TEST(RayIntegrals, TheNumberOfThreadsDoesNotMatter) {
  Random random(3);
  const RayBody body = random_body(random, 500);
  const RayIntegrals rays(body.domain);
  ASSERT_GT(rays.intervals(), 3 * 8192U) << "less than four tasks";
  const Moments q = random_quadric(random, {"bowl", 1, true, true}, rays.full());
  const auto with_threads = [&](std::size_t threads) {
    const tbb::global_control control(tbb::global_control::max_allowed_parallelism, threads);
    return rays.pass(q);
  };
  const RayIntegrals::Pass one = with_threads(1);
  for (int n = 0; n < 5; ++n) {
    const RayIntegrals::Pass two = with_threads(2);
    EXPECT_EQ(one.moments, two.moments);
    EXPECT_EQ(one.spread, two.spread);
  }
}

}  // namespace
}  // namespace rayrep
