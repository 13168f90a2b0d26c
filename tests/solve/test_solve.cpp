#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <stdexcept>
#include <thread>

#include "rayrep/base/error.h"
#include "rayrep/make/waterline.h"
#include "rayrep/rays/ray_cast.h"
#include "rayrep/rays/ray_interior.h"
#include "rayrep/solve/goals.h"
#include "rayrep/solve/nlp.h"
#include "rayrep/solve/quadric.h"
#include "rayrep/solve/solve.h"
#include "solids.h"

namespace rayrep {
namespace {

using namespace test;

/// Hock and Schittkowski's problem 71 with its inequality as an equality with a slack.
class Hs071 final : public Nlp {
public:
  Eigen::Index variables() const override { return 5; }
  Eigen::Index constraints() const override { return 2; }
  Eigen::VectorXd lower_bounds() const override { return Eigen::Matrix<double, 5, 1>(1, 1, 1, 1, 25); }
  Eigen::VectorXd upper_bounds() const override { return Eigen::Matrix<double, 5, 1>(5, 5, 5, 5, 1e19); }
  Eigen::VectorXd constraint_upper_bounds() const override { return Eigen::Vector2d::Zero(); }
  Eigen::VectorXd start() const override { return Eigen::Matrix<double, 5, 1>(1, 5, 5, 1, 25); }
  double objective(const Eigen::VectorXd& x) const override { return x[0] * x[3] * (x[0] + x[1] + x[2]) + x[2]; }
  Eigen::VectorXd gradient(const Eigen::VectorXd& x) const override {
    return Eigen::Matrix<double, 5, 1>(x[3] * (2 * x[0] + x[1] + x[2]), x[0] * x[3], x[0] * x[3] + 1, x[0] * (x[0] + x[1] + x[2]),
                                       0);
  }
  Eigen::VectorXd constraint_values(const Eigen::VectorXd& x) const override {
    return Eigen::Vector2d(x[0] * x[1] * x[2] * x[3] - x[4], x.head<4>().squaredNorm() - 40);
  }
  Pattern jacobian_pattern() const override { return {{0, 0}, {0, 1}, {0, 2}, {0, 3}, {0, 4}, {1, 0}, {1, 1}, {1, 2}, {1, 3}}; }
  Eigen::VectorXd jacobian_values(const Eigen::VectorXd& x) const override {
    Eigen::VectorXd v(9);
    v << x[1] * x[2] * x[3], x[0] * x[2] * x[3], x[0] * x[1] * x[3], x[0] * x[1] * x[2], -1, 2 * x[0], 2 * x[1], 2 * x[2], 2 * x[3];
    return v;
  }
  Pattern hessian_pattern() const override {
    return {{0, 0}, {1, 0}, {1, 1}, {2, 0}, {2, 1}, {2, 2}, {3, 0}, {3, 1}, {3, 2}, {3, 3}};
  }
  Eigen::VectorXd hessian_values(const Eigen::VectorXd& x, double f, const Eigen::VectorXd& mu) const override {
    Eigen::VectorXd v(10);
    v << 2 * f * x[3] + 2 * mu[1], f * x[3] + mu[0] * x[2] * x[3], 2 * mu[1], f * x[3] + mu[0] * x[1] * x[3], mu[0] * x[0] * x[3],
        2 * mu[1], f * (2 * x[0] + x[1] + x[2]) + mu[0] * x[1] * x[2], f * x[0] + mu[0] * x[0] * x[2],
        f * x[0] + mu[0] * x[0] * x[1], 2 * mu[1];
    return v;
  }
  bool quadratic() const override { return false; }
};

TEST(Ipopt, SolvesHs071) {
  const SolveReport report = solve_ipopt(Hs071());
  ASSERT_EQ(report.status, SolveStatus::converged) << report.solver_status;
  EXPECT_EQ(report.solver_status, "Solve_Succeeded");
  EXPECT_NEAR(report.objective, 17.0140173, 1e-6);
  EXPECT_TRUE(near(report.x.head<4>(), Eigen::Vector4d(1, 4.7429994, 3.8211503, 1.3794082), 1e-5));
  EXPECT_LT(report.constraint_violation, 1e-7);
}

TEST(Ipopt, IgnoresAnOptionsFileInTheFolder) {
  const auto before = std::filesystem::current_path();
  const auto folder = own_file("ipopt_options");
  std::filesystem::create_directories(folder);
  std::filesystem::current_path(folder);
  std::ofstream("ipopt.opt") << "max_iter 1\n";
  const SolveReport report = solve_ipopt(Hs071());
  std::filesystem::current_path(before);
  std::filesystem::remove_all(folder);
  EXPECT_EQ(report.status, SolveStatus::converged) << report.solver_status;
}

TEST(Ipopt, SaysWhenItStopsEarly) {
  SolveOptions options;
  options.max_iterations = 2;
  const SolveReport report = solve_ipopt(Hs071(), options);
  EXPECT_EQ(report.status, SolveStatus::iteration_limit);
  EXPECT_EQ(report.solver_status, "Maximum_Iterations_Exceeded");
}

TEST(Ipopt, StopsWhenCancelled) {
  Progress progress;
  int calls = 0;
  progress.cancelled = [&calls] { return ++calls > 2; };
  try {
    solve_ipopt(Hs071(), {}, progress);
    FAIL() << "was not interrupted";
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), ErrorCode::interrupted);
  }
  EXPECT_LE(calls, 5);
}

TEST(Ipopt, SolvesFromTwoThreadsAtOnce) {
  SolveReport a;
  SolveReport b;
  std::thread first([&a] { a = solve_ipopt(Hs071()); });
  std::thread second([&b] { b = solve_ipopt(Hs071()); });
  first.join();
  second.join();
  EXPECT_EQ(a.status, SolveStatus::converged);
  EXPECT_EQ(a.x, b.x);
}

/// A float problem on the rays of an ellipsoid standing off its axes.
struct Problem {
  RayRep domain;
  Moments shell;
  double solid_mm3;

  explicit Problem(double spacing, std::uint64_t seed = 8) {
    const Mesh solid = rotated(uv_ellipsoid(12, 9, 15, 24), random_rotation(seed));
    const Mesh inner = scaled(solid, 0.85);
    domain = cast_rays(SurfaceQuery(inner), covering_grid(bounding_box(inner), spacing), Region::solid);
    shell = mesh_moments(solid) - ray_moments(domain);
    solid_mm3 = mesh_moments(solid)[M1];
  }
};

/// Central differences of f at x along every direction.
template <typename F>
Eigen::VectorXd finite_differences(const F& f, Eigen::VectorXd x, double step) {
  Eigen::VectorXd d(x.size());
  for (Eigen::Index n = 0; n < x.size(); ++n) {
    const double x_n = x[n];
    x[n] = x_n + step;
    const double above = f(x);
    x[n] = x_n - step;
    d[n] = (above - f(x)) / (2 * step);
    x[n] = x_n;
  }
  return d;
}

TEST(BottomFilledRays, MomentsOfTheFullRaysAreThoseOfTheDomain) {
  const Problem p(2);
  const BottomFilledRays interior(p.domain);
  expect_moments_near(interior.moments(interior.upper_bounds()), ray_moments(p.domain), 1e-14, 15);
  EXPECT_TRUE(interior.moments(interior.lower_bounds()).isZero());
}

/// Jacobian, Hessian and separability of an interior at x, against central differences of its moments.
void expect_derivatives_of(const Interior& interior, const Eigen::VectorXd& x) {
  ASSERT_GT(interior.variables(), 10);
  const auto J = interior.jacobian(x);
  for (Eigen::Index row = 0; row < 10; ++row) {
    const auto s = [&](const Eigen::VectorXd& z) { return interior.moments(z)[row]; };
    const Eigen::VectorXd d = finite_differences(s, x, 1e-4);
    EXPECT_LT((J.row(row).transpose() - d).norm(), 1e-6 * d.norm() + 1e-7) << row;
  }
  Moments w;
  w << 1, -2, 0.5, 3, 0.1, 0.2, -0.3, 0.4, -0.5, 0.6;
  const auto gradient = [&](const Eigen::VectorXd& z) -> Eigen::VectorXd { return interior.jacobian(z).transpose() * w; };
  const Eigen::VectorXd h = interior.hessian_diagonal(x, w, 0, x.size());
  EXPECT_EQ(interior.hessian_diagonal(x, w, 3, 5), h.segment(3, 5));
  const bool paired = interior.pair_lengths().size() > 0;
  const Eigen::VectorXd of_pairs = interior.hessian_of_pairs(x, w, 0, x.size());
  ASSERT_EQ(of_pairs.size(), paired ? x.size() / 2 : 0);
  if (paired) {
    EXPECT_EQ(interior.hessian_of_pairs(x, w, 4, 6), of_pairs.segment(2, 3));
  }
  for (Eigen::Index n = 0; n < x.size(); ++n) {
    Eigen::VectorXd above = x;
    above[n] += 1e-4;
    Eigen::VectorXd below = x;
    below[n] -= 1e-4;
    Eigen::VectorXd column = (gradient(above) - gradient(below)) / 2e-4;
    EXPECT_NEAR(h[n], column[n], 1e-6 * std::abs(h[n]) + 1e-8);
    column[n] = 0;
    if (paired) {
      const Eigen::Index other = n % 2 == 0 ? n + 1 : n - 1;
      EXPECT_NEAR(of_pairs[n / 2], column[other], 1e-6 * std::abs(h[n]) + 1e-8);
      EXPECT_LE(of_pairs[n / 2] * of_pairs[n / 2], h[n] * h[other] * (1 + 1e-12)) << "not semidefinite";
      column[other] = 0;
    }
    EXPECT_NEAR(column.cwiseAbs().sum(), 0, 1e-8) << "a variable acts on another's derivative";
  }
}

TEST(BottomFilledRays, DerivativesAreThoseOfTheMoments) {
  const BottomFilledRays interior(Problem(4).domain);
  expect_derivatives_of(interior, interior.start(0.7));
}

/// Random segments z0 <= z1, among them full ones, void ones, and ones that end at one end of their interval.
Eigen::VectorXd random_ends(const RayRep& domain, std::uint64_t seed, bool inside = false) {
  Random random(seed);
  Eigen::VectorXd z(2 * static_cast<Eigen::Index>(domain.intervals.size()));
  for (Eigen::Index v = 0; v < z.size(); v += 2) {
    const Interval& interval = domain.intervals[static_cast<std::size_t>(v / 2)];
    double low = random.uniform(0.02, inside ? 0.4 : 0.98);
    double high = random.uniform(inside ? 0.6 : 0.02, 0.98);
    if (low > high) std::swap(low, high);
    if (!inside && v % 5 == 0) low = 0;
    if (!inside && v % 3 == 0) high = 1;
    if (!inside && v % 14 == 0) high = low;
    z[v] = interval.lo + low * interval.length();
    z[v + 1] = high == 1 ? interval.hi : interval.lo + high * interval.length();
  }
  return z;
}

TEST(SegmentRays, DerivativesAreThoseOfTheMoments) {
  const Problem p(4);
  for (const Between between : {Between::material, Between::cavity}) {
    const CentredSegmentRays centred(p.domain, between);
    expect_derivatives_of(centred, centred.start(0.6));
    const SegmentRays interior(p.domain, between);
    expect_derivatives_of(interior, interior.from_ends(random_ends(p.domain, 5, true)));
  }
}

TEST(SegmentRays, MomentsAreThoseOfTheEndsThatTheVariablesStandFor) {
  const Problem p(2);
  for (const Between between : {Between::material, Between::cavity}) {
    const CentredSegmentRays by_ends(p.domain, between);  // any two ends have moments
    const SegmentRays interior(p.domain, between);
    for (std::uint64_t seed = 0; seed < 5; ++seed) {
      const Eigen::VectorXd z = random_ends(p.domain, seed);
      const Eigen::VectorXd ab = interior.from_ends(z);
      expect_moments_near(interior.moments(ab), by_ends.moments(z), 1e-13, 15);
      const Eigen::VectorXd again = interior.ends(ab);
      for (Eigen::Index v = 0; v < z.size(); v += 2) {
        EXPECT_LE(again[v], again[v + 1]);
        EXPECT_GE(again[v], p.domain.intervals[static_cast<std::size_t>(v / 2)].lo);
        EXPECT_LE(again[v + 1], p.domain.intervals[static_cast<std::size_t>(v / 2)].hi);
        if (z[v] < z[v + 1]) {
          EXPECT_NEAR(again[v], z[v], 1e-12);
          EXPECT_NEAR(again[v + 1], z[v + 1], 1e-12);
        }
      }
    }
  }
}

/// What pairs must keep, see Interior::pair_lengths, divided by the length.
Eigen::VectorXd margins(const Interior& interior, const Eigen::VectorXd& ab) {
  const Eigen::VectorXd L = interior.pair_lengths();
  Eigen::VectorXd c(ab.size());
  for (Eigen::Index v = 0; v < ab.size(); ++v) {
    const Eigen::Index k = v / 2;
    c[v] = 2 * ab[v] - std::pow(ab[2 * k] + ab[2 * k + 1], 2) / L[k];
  }
  return c;
}

TEST(SegmentRays, TheVariablesThatPairsMayTakeAreTheSegmentsWithinTheInterval) {
  const Problem p(2);
  const SegmentRays interior(p.domain);
  const Eigen::VectorXd L = interior.pair_lengths();
  ASSERT_EQ(2 * L.size(), interior.variables());
  // The full ray, the void ray and rays filled from one end lie on the rim, exactly.
  const Eigen::VectorXd z = random_ends(p.domain, 11);
  const Eigen::VectorXd c = margins(interior, interior.from_ends(z));
  Eigen::Index on_the_rim = 0;
  for (Eigen::Index v = 0; v < z.size(); v += 2) {
    const Interval& interval = p.domain.intervals[static_cast<std::size_t>(v / 2)];
    const double length = z[v + 1] - z[v];
    // (26e): 2 L a - (a + b)^2 = 2 (z1 - z0)(z0 - lo), 2 L b - (a + b)^2 = 2 (z1 - z0)(hi - z1).
    EXPECT_NEAR(c[v], 2 * length * (z[v] - interval.lo) / interval.length(), 1e-13);
    EXPECT_NEAR(c[v + 1], 2 * length * (interval.hi - z[v + 1]) / interval.length(), 1e-13);
    on_the_rim += std::abs(c[v]) < 1e-13 || std::abs(c[v + 1]) < 1e-13;
  }
  EXPECT_GT(on_the_rim, L.size() / 4);
  EXPECT_TRUE(margins(interior, interior.start(1)).isZero(1e-14));
  EXPECT_TRUE(margins(interior, interior.start(0)).isZero(0));
  // Other variables have ends beyond the interval.
  Random random(12);
  Eigen::VectorXd ab(interior.variables());
  for (Eigen::Index v = 0; v < ab.size(); ++v) ab[v] = random.uniform(0.01, 0.6) * L[v / 2];
  const Eigen::VectorXd beyond = margins(interior, ab);
  const Eigen::VectorXd again = interior.from_ends(interior.ends(ab));
  int outside = 0;
  for (Eigen::Index v = 0; v < ab.size(); v += 2) {
    const bool within = beyond[v] >= 0 && beyond[v + 1] >= 0;
    outside += within ? 0 : 1;
    EXPECT_EQ((again.segment<2>(v) - ab.segment<2>(v)).norm() < 1e-12, within) << v;
  }
  EXPECT_GT(outside, L.size() / 4);
  EXPECT_LT(outside, 3 * L.size() / 4);
}

TEST(SegmentRays, SecondMomentsAreConvexAndTheOthersLinear) {
  const Problem p(3);
  const SegmentRays interior(p.domain);
  const Eigen::VectorXd u = interior.from_ends(random_ends(p.domain, 21));
  const Eigen::VectorXd v = interior.from_ends(random_ends(p.domain, 22));
  const auto at_u = interior.contributions(u);
  const auto at_v = interior.contributions(v);
  double most = 0;
  for (const double part : {0.2, 0.5, 0.9}) {
    const auto between = interior.contributions((1 - part) * u + part * v);
    const Eigen::Matrix<double, 10, Eigen::Dynamic> sag = (1 - part) * at_u + part * at_v - between;
    for (Eigen::Index k = 0; k < sag.cols(); ++k)
      for (int moment = 0; moment < 10; ++moment) {
        if (moment != MZZ) {
          EXPECT_NEAR(sag(moment, k), 0, 1e-9);
        } else {
          EXPECT_GT(sag(moment, k), -1e-9);
          most = std::max(most, sag(moment, k));
        }
      }
  }
  EXPECT_GT(most, 10);
  // So are the segments within an interval.
  EXPECT_GT(margins(interior, 0.3 * u + 0.7 * v).minCoeff(), -1e-13);
}

TEST(SegmentRays, MaterialAndCavityBetweenTheSameEndsFillTheDomain) {
  const Problem p(2);
  const SegmentRays material(p.domain, Between::material);
  const SegmentRays cavity(p.domain, Between::cavity);
  const Eigen::VectorXd ab = material.from_ends(random_ends(p.domain, 6));
  EXPECT_GT(cavity.moments(ab)[M1], 0);
  expect_moments_near(material.moments(ab) + cavity.moments(ab), ray_moments(p.domain), 1e-13, 15);
}

TEST(SegmentRays, StartsAreVoidSolidAndWithinTheBounds) {
  const Problem p(2);
  const auto check = [&p](const Interior& interior) {
    expect_moments_near(interior.moments(interior.start(1)), ray_moments(p.domain), 1e-13, 15);
    EXPECT_LT(interior.moments(interior.start(0)).norm(), 1e-9);
    for (const double fill : {0.0, 0.5, 1.0}) {
      const Eigen::VectorXd x = interior.start(fill);
      EXPECT_NEAR(interior.moments(x)[M1], fill * ray_moments(p.domain)[M1], 1e-9);
      EXPECT_TRUE((x.array() >= interior.lower_bounds().array() - 1e-12).all());
      EXPECT_TRUE((x.array() <= interior.upper_bounds().array() + 1e-12).all());
      if (interior.pair_lengths().size() > 0) {
        EXPECT_GT(margins(interior, x).minCoeff(), -1e-12);
      }
    }
  };
  for (const Between between : {Between::material, Between::cavity}) {
    check(CentredSegmentRays(p.domain, between));
    check(SegmentRays(p.domain, between));
  }
}

TEST(SegmentRays, BottomFilledRaysAreASpecialCase) {
  const Problem p(2);
  const BottomFilledRays bottom(p.domain);
  const SegmentRays segments(p.domain);
  const Eigen::VectorXd z1 = bottom.start(0.3);
  Eigen::VectorXd z(segments.variables());
  for (Eigen::Index n = 0; n < z1.size(); ++n) {
    z[2 * n] = bottom.lower_bounds()[n];
    z[2 * n + 1] = z1[n];
  }
  expect_moments_near(segments.moments(segments.from_ends(z)), bottom.moments(z1), 1e-12, 15);
}

TEST(FloatGoal, DerivativesAreThoseOfTheValues) {
  const Goal goal = float_goal(5000, {0.7, -1.1}, 40);
  Moments s;
  s << 4800, 3000, -5000, 9000, 1e4, 2e4, 3e4, 4e3, 5e3, 6e3;
  const auto f = [&](const Eigen::VectorXd& v) { return goal.objective(v); };
  EXPECT_LT((goal.gradient(s) - finite_differences(f, s, 1)).norm(), 1e-9);
  const auto C = goal.J;
  for (int row = 0; row < goal.constraints(); ++row) {
    const auto c = [&](const Eigen::VectorXd& v) { return goal.constraint_values(v)[row]; };
    EXPECT_LT((C.row(row).transpose() - finite_differences(c, s, 1)).norm(), 1e-9);
  }
  EXPECT_TRUE(goal.affine);
  EXPECT_TRUE(goal.hessian(s).isZero());
}

TEST(FloatGoal, ConstraintsHoldExactlyWhenMassAndCentreDo) {
  const Goal goal = float_goal(5000, {0.7, -1.1}, 40);
  Moments s = Moments::Zero();
  s[M1] = 5000;
  s[MX] = 0.7 * 5000;
  s[MY] = -1.1 * 5000;
  EXPECT_LT(goal.constraint_values(s).norm(), 1e-14);
  s[MX] += 5000 * 0.04;  // 0.04 mm off, over 40 mm
  EXPECT_NEAR(goal.constraint_values(s)[1], 1e-3, 1e-12);
  s[M1] *= 1.01;
  EXPECT_NEAR(goal.constraint_values(s)[0], 0.01, 1e-12);
}

/// Moments of a body that is nothing special.
Moments some_moments() {
  Moments s;
  s << 4800, 300, -500, 90000, 7e5, 8e5, 2.1e6, 4e4, 5e4, -6e4;
  return s;
}

TEST(SpinGoal, DerivativesAreThoseOfTheValues) {
  for (const bool largest : {true, false})
    for (const bool yoyo : {true, false}) {
      const Goal goal = spin_goal({.lambda = 0.3, .gamma_c = 0.7, .gamma_i = 1.2}, largest, yoyo, 5000, 40);
      const Moments s = some_moments();
      Moments step = s.cwiseAbs() * 1e-5;
      const auto central = [&](const auto& f, Eigen::Index n) {
        Moments above = s;
        Moments below = s;
        above[n] += step[n];
        below[n] -= step[n];
        return ((f(above) - f(below)) / (2 * step[n])).eval();
      };
      const Moments gradient = goal.gradient(s);
      const auto hessian = goal.hessian(s);
      for (Eigen::Index n = 0; n < 10; ++n) {
        const auto f = [&](const Moments& t) { return Eigen::Matrix<double, 1, 1>(goal.objective(t)); };
        const auto g = [&](const Moments& t) { return Moments(goal.gradient(t).cwiseProduct(s.cwiseAbs())); };
        EXPECT_NEAR(gradient[n] * s[n], central(f, n)[0] * s[n], 1e-7) << n;
        const Moments column = central(g, n) * s[n];
        EXPECT_LT((hessian.col(n).cwiseProduct(s.cwiseAbs()) * s[n] - column).norm(), 1e-6) << n;
      }
      EXPECT_TRUE(hessian.isApprox(hessian.transpose(), 1e-14));
      EXPECT_FALSE(goal.affine);
    }
}

TEST(StandGoal, DerivativesAreThoseOfTheValues) {
  const Goal goal = stand_goal({0.7, -1.1}, 5000, 40);
  const Moments s = some_moments();
  EXPECT_FALSE(goal.affine);
  const auto f = [&](const Eigen::VectorXd& v) { return goal.objective(v); };
  EXPECT_LT((goal.gradient(s) - finite_differences(f, s, 1e-2)).norm(), 1e-6 * goal.gradient(s).norm());
  for (Eigen::Index row = 0; row < 10; ++row) {
    const auto gradient = [&](const Eigen::VectorXd& v) { return goal.gradient(v)[row]; };
    EXPECT_LT((goal.hessian(s).row(row).transpose() - finite_differences(gradient, s, 1e-2)).norm(),
              1e-6 * goal.gradient(s).norm());
  }
  for (int row = 0; row < 2; ++row) {
    const auto c = [&](const Eigen::VectorXd& v) { return goal.constraint_values(v)[row]; };
    EXPECT_LT((goal.J.row(row).transpose() - finite_differences(c, s, 1)).norm(), 1e-9);
  }
}

TEST(MappedGoal, IsTheGoalOfTheMovedBody) {
  const Eigen::Affine3d motion =
      Eigen::Translation3d(0.4, -0.2, 1.5) * Eigen::AngleAxisd(0.3, Eigen::Vector3d(1, 2, 3).normalized());
  const Matrix10 T = moment_map(motion);
  const Moments s = some_moments();
  const Goal goals[] = {spin_goal({.lambda = 0.3, .gamma_c = 0.7}, true, false, 5000, 40), stand_goal({0.7, -1.1}, 5000, 40),
                        float_goal(5000, {0.7, -1.1}, 40)};
  for (const Goal& goal : goals) {
    const Goal moved = mapped(goal, T);
    EXPECT_EQ(moved.affine, goal.affine);
    EXPECT_EQ(moved.objective(s), goal.objective(T * s));
    EXPECT_LT((moved.constraint_values(s) - goal.constraint_values(T * s)).norm(), 1e-13);
    const Moments g = moved.gradient(s);
    const Matrix10 H = moved.hessian(s);
    for (int k = 0; k < 10; ++k) {
      const Moments d = 1e-5 * s[k] * Moments::Unit(k);
      const double slope = (moved.objective(s + d) - moved.objective(s - d)) / 2;
      EXPECT_NEAR(g.dot(d), slope, 1e-12) << k;
      const Moments bend = (moved.gradient(s + d) - moved.gradient(s - d)) / 2;
      EXPECT_LT((H * d - bend).cwiseProduct(s).norm(), 1e-10) << k;
    }
  }
  // The same constraints, another objective.
  const Moments q = s.cwiseInverse();
  const Goal linear = linear_goal(q, goals[0]);
  EXPECT_TRUE(linear.affine);
  EXPECT_EQ(linear.objective(s), q.dot(s));
  EXPECT_EQ(linear.constraint_values(s), goals[0].constraint_values(s));
}

TEST(SpinGoal, TheInertiaTermIsThatOfTheTensor) {
  // R = |lateral inertia about the centre of mass|^2 / Izz^2, here from the mass properties of a box whose axis is centred.
  const Moments s = translated(box_moments({-3, -2, 0}, {3, 2, 5}), {0, 0, 4});
  const MassProperties body = mass_properties(s, 1);
  const Goal goal = spin_goal({}, true, false, s[M1], 10);
  const Eigen::Matrix2d lateral = body.inertia_g_mm2.topLeftCorner<2, 2>();
  EXPECT_NEAR(inertia_ratio(s), lateral.squaredNorm() / std::pow(body.inertia_g_mm2(2, 2), 2), 1e-12);
  EXPECT_LT(goal.constraint_values(s).norm(), 1e-12);
  // Moved off the axis, or turned about a horizontal one, a constraint is violated.
  EXPECT_GT(std::abs(goal.constraint_values(translated(s, {0.1, 0, 0}))[0]), 1e-3);
  EXPECT_GT(goal.constraint_values(mesh_moments(rotated(moved(box({-3, -2, 0}, {3, 2, 5}), {0, 0, -2.5}),
                                                        Eigen::AngleAxisd(0.1, Eigen::Vector3d::UnitY()).toRotationMatrix())))
                .norm(),
            1e-4);
}

/// An Nlp's gradient, Jacobian and Hessian, with multipliers from `lowest` to `highest`, at x against central differences. Of the
/// first `convex` variables negative second derivatives shall count as 0.
void expect_derivatives_of(const Nlp& nlp, const Eigen::VectorXd& x, double tolerance, Eigen::Index convex = 0,
                           double lowest = -0.7, double highest = 1.1) {
  const auto dense = [&](const Eigen::VectorXd& values, const Nlp::Pattern& pattern, Eigen::Index rows) {
    EXPECT_EQ(pattern.size(), static_cast<std::size_t>(values.size()));
    Eigen::MatrixXd M = Eigen::MatrixXd::Zero(rows, nlp.variables());
    for (std::size_t n = 0; n < pattern.size(); ++n) M(pattern[n].first, pattern[n].second) += values[static_cast<Eigen::Index>(n)];
    return M;
  };
  const auto jacobian = [&](const Eigen::VectorXd& y) {
    return dense(nlp.jacobian_values(y), nlp.jacobian_pattern(), nlp.constraints());
  };
  const Eigen::VectorXd mu = Eigen::VectorXd::LinSpaced(nlp.constraints(), lowest, highest);
  const double factor = 0.6;
  const auto lagrangian = [&](const Eigen::VectorXd& y) -> Eigen::VectorXd {
    return factor * nlp.gradient(y) + jacobian(y).transpose() * mu;
  };
  const Eigen::VectorXd g = nlp.gradient(x);
  const Eigen::MatrixXd J = jacobian(x);
  const Eigen::MatrixXd lower = dense(nlp.hessian_values(x, factor, mu), nlp.hessian_pattern(), nlp.variables());
  const Eigen::MatrixXd H = lower + Eigen::MatrixXd(lower.triangularView<Eigen::StrictlyLower>()).transpose();
  Eigen::Index negative = 0;
  for (Eigen::Index n = 0; n < x.size(); ++n) {
    const double step = 1e-5 * std::max(1.0, std::abs(x[n]));
    Eigen::VectorXd above = x;
    above[n] += step;
    Eigen::VectorXd below = x;
    below[n] -= step;
    ASSERT_NEAR(g[n], (nlp.objective(above) - nlp.objective(below)) / (2 * step), tolerance * (1 + std::abs(g[n]))) << n;
    const Eigen::VectorXd column = (nlp.constraint_values(above) - nlp.constraint_values(below)) / (2 * step);
    ASSERT_LT((J.col(n) - column).norm(), tolerance * (1 + column.norm())) << n;
    Eigen::VectorXd curvature = (lagrangian(above) - lagrangian(below)) / (2 * step);
    if (n < convex) {
      negative += curvature[n] < 0 ? 1 : 0;
      curvature[n] = std::max(curvature[n], 0.0);
    }
    ASSERT_LT((H.col(n) - curvature).norm(), tolerance * (1 + curvature.norm())) << n;
  }
  EXPECT_GE(negative, convex / 4) << "nothing to leave out";
}

TEST(InteriorNlp, DerivativesAreThoseOfTheValues) {
  const Problem p(3);
  const InteriorNlp::Scale scale{p.solid_mm3, 40};
  const Goal floating = float_goal(0.7 * p.solid_mm3, {0.3, -0.2}, 40);
  const BottomFilledRays bottom(p.domain);
  const InteriorNlp affine(floating, bottom, p.shell, scale, 0.4);
  EXPECT_TRUE(affine.quadratic());
  expect_derivatives_of(affine, affine.start(), 1e-6);

  const Goal spinning = spin_goal({.lambda = 0.3, .gamma_c = 0.2}, true, false, p.solid_mm3, 40);
  const CentredSegmentRays centred(p.domain);
  const InteriorNlp curved(spinning, centred, p.shell, scale, 0.6);
  EXPECT_FALSE(curved.quadratic());
  expect_derivatives_of(curved, curved.start(), 1e-5, centred.variables());

  // Negative multipliers of the chain mean positive weights of s_zz.
  const SegmentRays segments(p.domain);
  const InteriorNlp paired(spinning, segments, p.shell, scale, 0.6);
  EXPECT_EQ(paired.constraints(), paired.variables() + spinning.constraints());
  Eigen::VectorXd x = paired.start();
  x.head(segments.variables()) = segments.from_ends(random_ends(p.domain, 7, true)) / 40;
  expect_derivatives_of(paired, x, 1e-5, 0, -1.1, -0.1);
}

TEST(InteriorNlp, APairWithAConcaveMomentCountsAsFlat) {
  const Problem p(3);
  const Goal goal = spin_goal({.lambda = 0.3, .gamma_c = 0.2}, true, false, p.solid_mm3, 40);
  const SegmentRays segments(p.domain);
  const InteriorNlp nlp(goal, segments, p.shell, {p.solid_mm3, 40}, 0.6);
  Eigen::VectorXd mu = Eigen::VectorXd::Zero(nlp.constraints());
  const Eigen::Index chain = nlp.variables() - segments.variables();
  const auto largest_of_segments = [&](double multiplier) {
    mu.head(chain).setConstant(multiplier);
    const Nlp::Pattern pattern = nlp.hessian_pattern();
    const Eigen::VectorXd h = nlp.hessian_values(nlp.start(), 0.6, mu);
    double largest = 0;
    for (std::size_t n = 0; n < pattern.size(); ++n)
      if (pattern[n].first < segments.variables()) largest = std::max(largest, std::abs(h[static_cast<Eigen::Index>(n)]));
    return largest;
  };
  EXPECT_GT(largest_of_segments(-1), 1e-3);
  EXPECT_EQ(largest_of_segments(1), 0);
}

TEST(InteriorNlp, ItsStartSatisfiesTheChain) {
  const Problem p(1.5);
  const Goal goal = spin_goal({}, true, false, p.solid_mm3, 40);
  const SegmentRays interior(p.domain);
  const InteriorNlp nlp(goal, interior, p.shell, {p.solid_mm3, 40}, 0.6);
  const Eigen::VectorXd c = nlp.constraint_values(nlp.start());
  const Eigen::Index chain = nlp.variables() - interior.variables();
  EXPECT_LT(c.head(chain).cwiseAbs().maxCoeff(), 1e-9);
  // The goal sees the same moments through the chain as from the interior.
  EXPECT_NEAR(nlp.objective(nlp.start()), static_cast<double>(interior.variables()) * goal.objective(nlp.body(nlp.start())), 1e-6);
  // Every row is sparse.
  std::vector<int> per_row(static_cast<std::size_t>(nlp.constraints()));
  for (const auto& [row, column] : nlp.jacobian_pattern()) ++per_row[static_cast<std::size_t>(row)];
  EXPECT_LT(*std::max_element(per_row.begin(), per_row.end()), 70);
}

class FloatOnRays : public ::testing::TestWithParam<double> {};

TEST_P(FloatOnRays, IpoptReachesTheProvenOptimum) {
  const Problem p(1.0);
  const Goal goal = float_goal(GetParam() * p.solid_mm3, {0.2, -0.1}, 40);
  const BottomFilledRays interior(p.domain);
  const InteriorNlp nlp(goal, interior, p.shell, {p.solid_mm3, 40});
  const SolveReport report = solve_ipopt(nlp);
  ASSERT_EQ(report.solver_status, "Solve_Succeeded");
  const Moments body = nlp.body(report.x);
  EXPECT_LT(goal.constraint_values(body).cwiseAbs().maxCoeff(), 1e-7);

  const QuadricSolution exact = solve_quadric(goal, RayIntegrals(p.domain), p.shell);
  ASSERT_TRUE(exact.converged);
  EXPECT_LT(goal.constraint_values(exact.moments).cwiseAbs().maxCoeff(), 1e-10);
  // No interior does better than the dual value, and the quadric attains it.
  EXPECT_NEAR(exact.objective, exact.lower_bound, 1e-10 * std::abs(exact.lower_bound));
  EXPECT_GT(goal.objective(body), exact.lower_bound - 1e-8);
  EXPECT_NEAR(goal.objective(body), exact.objective, 1e-6 * std::abs(exact.objective) + 1e-8);

  // Both describe the same plane, and material is below it: q.phi < 0.
  const Moments q = nlp.switching(report.multipliers);
  EXPECT_GT(q[MZ], 0);
  EXPECT_TRUE(near(q.head<4>() / q[MZ], exact.q.head<4>() / exact.q[MZ], 1e-4));

  // KKT residual of our own: the reduced gradient vanishes on free ends and has the right sign on the others.
  const Eigen::VectorXd x = nlp.interior_variables(report.x);
  const Eigen::VectorXd g = interior.jacobian(x).transpose() * q / q[MZ];
  const Eigen::VectorXd lo = interior.lower_bounds();
  const Eigen::VectorXd hi = interior.upper_bounds();
  const double area = p.domain.grid.cell_area_mm2();
  for (Eigen::Index n = 0; n < x.size(); ++n) {
    if (x[n] - lo[n] > 1e-3) {
      EXPECT_LT(g[n] / area, 2e-3);
    }
    if (hi[n] - x[n] > 1e-3) {
      EXPECT_GT(g[n] / area, -2e-3);
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Fill, FloatOnRays, ::testing::Values(0.45, 0.6, 0.75, 0.9));

TEST(Waterline, SmallestOffsetOfABoxIsAnalytic) {
  // Filling a box of length 20 to a fraction f by one side puts the centre at (1 - f) 10 from the middle at most.
  RayGrid grid;
  grid.spacing_mm = 0.1;
  grid.nx = 200;
  grid.ny = 20;
  grid.origin_mm = {-10 + 0.05, -1 + 0.05};
  const RayRep domain = cast_rays(SurfaceQuery(box({-10, -1, 0}, {10, 1, 5})), grid, Region::solid);
  const double volume = 20 * 2 * 5;
  for (const double f : {0.3, 0.5, 0.8})
    EXPECT_NEAR(smallest_offset_mm(domain, Moments::Zero(), f * volume, {12, 0}), 12 - (1 - f) * 10, 1e-6) << f;
  EXPECT_EQ(smallest_offset_mm(domain, Moments::Zero(), 0.5 * volume, {2, 0}), 0);
}

}  // namespace
}  // namespace rayrep
