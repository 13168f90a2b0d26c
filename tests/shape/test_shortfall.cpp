#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "ray_problems.h"
#include "rayrep/solve/quadric.h"
#include "shape/shortfall.h"

namespace rayrep {
namespace {

using namespace test;

/// Distance from what is wanted, without the method that is tested.
double distance(const detail::Wanted& wanted, const Moments& s) {
  Eigen::VectorXd values = wanted.values(s);
  const Eigen::Index inequalities = wanted.inequalities();
  values.segment(wanted.equations, inequalities) = values.segment(wanted.equations, inequalities).cwiseMax(0.0).eval();
  if (wanted.matrix) {
    const Eigen::Vector3d m = values.tail<3>();
    const double half = 0.5 * (m[0] + m[1]);
    const double radius = std::hypot(0.5 * (m[0] - m[1]), m[2] / std::numbers::sqrt2);
    values.tail<3>() = Eigen::Vector3d(std::hypot(std::max(0.0, half + radius), std::max(0.0, half - radius)), 0, 0);
  }
  return values.norm();
}

detail::Wanted random_wanted(Random& random, const RayBody& body, bool matrix) {
  const Moments unit = moment_units(body.solid()[M1], body.length_mm);
  detail::Wanted wanted;
  wanted.equations = 2;
  wanted.matrix = matrix;
  wanted.rows = Eigen::Matrix<double, Eigen::Dynamic, 10>::Zero(matrix ? 5 : 6, 10);
  for (Eigen::Index i = 0; i < wanted.rows.rows(); ++i)
    for (Eigen::Index k = 0; k < 10; ++k) wanted.rows(i, k) = random.uniform(-1, 1) / unit[k];
  wanted.offset = 0.2 * Eigen::VectorXd::NullaryExpr(wanted.rows.rows(), [&] { return random.uniform(-1, 1); });
  wanted.offset -= wanted.rows * (body.shell + 0.5 * ray_moments(body.domain));
  return wanted;
}

/// What is found is as near as its own moments say, and a bound from one pass proves that nothing is nearer.
TEST(Shortfall, IsProvenByItsNormal) {
  int attained = 0;
  int missed = 0;
  for (std::uint64_t n = 0; n < 200; ++n) {
    SCOPED_TRACE(n);
    Random random(n);
    const RayBody body = random_body(random, 30);
    const RayIntegrals rays(body.domain);
    const detail::Wanted wanted = random_wanted(random, body, n % 2 == 1);
    const detail::Shortfall found = detail::shortfall(wanted, rays, body.shell, 1e-7);
    EXPECT_NEAR(distance(wanted, found.moments), found.distance, 1e-7);
    if (found.distance < 1e-7) {
      ++attained;
      continue;
    }
    ++missed;
    EXPECT_NEAR(found.normal.norm(), 1, 1e-9);
    for (Eigen::Index k = 0; k < wanted.inequalities(); ++k) EXPECT_GE(found.normal[2 + k], 0);
    EXPECT_NEAR(detail::support(wanted, found.normal, rays, body.shell).value, found.distance, 1e-6 * found.distance + 1e-9);
  }
  EXPECT_GT(attained, 4);
  EXPECT_GT(missed, 10);
}

TEST(Shortfall, OfEquationsAloneIsThatOfNearestAttainable) {
  for (std::uint64_t n = 0; n < 50; ++n) {
    Random random(n);
    const RayBody body = random_body(random, 30);
    const RayIntegrals rays(body.domain);
    const Goal goal = stand_goal({random.uniform(-30, 30), random.uniform(-30, 30)}, body.solid()[M1], body.length_mm);
    const NearestSolution nearest = nearest_attainable(goal, rays, body.shell, 1e-7);
    const detail::Shortfall found = detail::shortfall({goal.J, goal.c_0, 2, false}, rays, body.shell, 1e-7);
    EXPECT_NEAR(found.distance, nearest.distance, 1e-6);
  }
}

}  // namespace
}  // namespace rayrep
