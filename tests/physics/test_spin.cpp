#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <random>
#include <vector>

#include "rayrep/base/error.h"
#include "rayrep/physics/spin.h"
#include "solids.h"

namespace rayrep {
namespace {

constexpr double kGravity = 9806.65;
constexpr double kInfinity = std::numeric_limits<double>::infinity();

bool in_ranges(const std::vector<SpeedRange>& ranges, double w) {
  for (const SpeedRange& r : ranges)
    if (w > r.lo_rad_s && w < r.hi_rad_s) return true;
  return false;
}

double relative_distance_to_ends(const std::vector<SpeedRange>& ranges, double w) {
  double d = 1;
  for (const SpeedRange& r : ranges)
    for (double end : {r.lo_rad_s, r.hi_rad_s})
      if (std::isfinite(end)) d = std::min(d, std::abs(w - end) / w);
  return d;
}

// The linearised equations of motion as they come from Euler's, in body axes: the vertical is (u, v, 1), the angular velocity
// (p, q, w). Nothing of the quartic's coefficients is used.
Eigen::Matrix4d motion_of(const Top& top, Tip tip, double w, double gravity) {
  const double shift = tip == Tip::fixed ? top.mass_g * top.height_mm * top.height_mm : 0;
  const double i1 = top.lateral_1_g_mm2 + shift, i2 = top.lateral_2_g_mm2 + shift, i3 = top.axial_g_mm2;
  const double torque = top.mass_g * gravity * top.height_mm;
  Eigen::Matrix4d m = Eigen::Matrix4d::Zero();  // of (u, v, p / w, q / w), time in units of 1 / w
  m(0, 1) = 1;
  m(0, 3) = -1;
  m(1, 0) = -1;
  m(1, 2) = 1;
  m(2, 3) = (i2 - i3) / i1;
  m(2, 1) = torque / (i1 * w * w);
  m(3, 2) = (i3 - i1) / i2;
  m(3, 0) = -torque / (i2 * w * w);
  return m;
}

double growth_rate(const Top& top, Tip tip, double w, double gravity) {
  return Eigen::EigenSolver<Eigen::Matrix4d>(motion_of(top, tip, w, gravity), false).eigenvalues().real().cwiseAbs().maxCoeff();
}

Top random_top(std::mt19937& random) {
  std::uniform_real_distribution<double> exponent(-1, 1);
  const auto log_uniform = [&](double decades) { return std::pow(10, decades * exponent(random)); };
  const double xx = log_uniform(0.5), yy = log_uniform(0.5), zz = log_uniform(0.5);  // second moments per mass, mm^2
  Top top;
  top.mass_g = log_uniform(1);
  top.height_mm = log_uniform(1.5);
  top.lateral_1_g_mm2 = top.mass_g * (std::min(xx, yy) + zz);
  top.lateral_2_g_mm2 = top.mass_g * (std::max(xx, yy) + zz);
  top.axial_g_mm2 = top.mass_g * (xx + yy);
  return top;
}

AxisClass class_of(const Top& t) {
  if (t.axial_g_mm2 > t.lateral_2_g_mm2) return AxisClass::largest;
  return t.axial_g_mm2 < t.lateral_1_g_mm2 ? AxisClass::smallest : AxisClass::middle;
}

TEST(StableSpeeds, SleepingTopHasLagrangesMinimum) {
  // w^2 >= 4 I1 M g l / I3^2 about the tip, for disk-like and rod-like tops alike.
  for (double axial : {30.0, 100.0, 150.0, 199.0, 200.0}) {
    const Top top{5, 4, 100, 100, axial};
    for (Tip tip : {Tip::sliding, Tip::fixed}) {
      const double i1 = 100 + (tip == Tip::fixed ? 5 * 4 * 4 : 0);
      const auto ranges = stable_speeds(top, tip);
      ASSERT_EQ(ranges.size(), 1u) << axial;
      EXPECT_NEAR(ranges[0].lo_rad_s, std::sqrt(4 * i1 * 5 * kGravity * 4) / axial, 1e-12 * ranges[0].lo_rad_s) << axial;
      EXPECT_EQ(ranges[0].hi_rad_s, kInfinity);
    }
  }
}

TEST(StableSpeeds, NearlySymmetricTopHasASymmetricTopsMinimum) {
  const Top round{5, 4, 100, 100, 130};
  const double lagrange = stable_speeds(round, Tip::fixed)[0].lo_rad_s;
  for (double e : {1e-15, 1e-12, 1e-8, 1e-4}) {
    const auto ranges = stable_speeds({5, 4, 100, 100 * (1 + e), 130}, Tip::fixed);
    const auto first_above = std::find_if(ranges.begin(), ranges.end(), [&](const SpeedRange& r) { return r.hi_rad_s > lagrange; });
    ASSERT_NE(first_above, ranges.end()) << e;
    EXPECT_NEAR(first_above->lo_rad_s, lagrange, (1e-12 + e) * lagrange) << e;
    if (e <= 1e-12) {
      EXPECT_EQ(ranges.size(), 1u) << "rounding opened a gap";
    }
  }
}

TEST(StableSpeeds, LargestAxisIsStableFromSpinItsEquation1Up) {
  std::mt19937 random(1);
  int count = 0;
  while (count < 500) {
    const Top top = random_top(random);
    if (class_of(top) != AxisClass::largest) continue;
    ++count;
    const auto ranges = stable_speeds(top, Tip::sliding);
    ASSERT_FALSE(ranges.empty());
    const double eq1 = std::sqrt(top.mass_g * kGravity * top.height_mm / (top.axial_g_mm2 - top.lateral_2_g_mm2));
    EXPECT_NEAR(ranges.back().lo_rad_s, eq1, 1e-12 * eq1);
    EXPECT_EQ(ranges.back().hi_rad_s, kInfinity);
  }
}

TEST(StableSpeeds, SmallestAxisIsStableOnlyAboveSomeSpeedAndTheMiddleOneNotAtHighSpeed) {
  std::mt19937 random(2);
  int smallest = 0, middle = 0, middle_with_a_range = 0;
  for (int k = 0; k < 5000; ++k) {
    const Top top = random_top(random);
    const auto ranges = stable_speeds(top, Tip::sliding);
    if (class_of(top) == AxisClass::smallest) {
      ++smallest;
      ASSERT_EQ(ranges.size(), 1u);
      EXPECT_GT(ranges[0].lo_rad_s, 0);
      EXPECT_EQ(ranges[0].hi_rad_s, kInfinity);
    } else if (class_of(top) == AxisClass::middle) {
      ++middle;
      middle_with_a_range += !ranges.empty();
      for (const SpeedRange& r : ranges) {
        const double top_speed = std::sqrt(top.mass_g * kGravity * top.height_mm / (top.axial_g_mm2 - top.lateral_1_g_mm2));
        EXPECT_LE(r.hi_rad_s, top_speed * (1 + 1e-12));
      }
    }
  }
  EXPECT_GT(smallest, 500);
  EXPECT_GT(middle, 500);
  EXPECT_GT(middle_with_a_range, 10) << "gyroscopic terms can hold a middle axis at low speed";
}

TEST(StableSpeeds, AgreeWithTheEigenvaluesOfTheEquationsOfMotion) {
  std::mt19937 random(3);
  std::uniform_real_distribution<double> exponent(-2, 2);
  int stable = 0, unstable = 0;
  for (int k = 0; k < 4000; ++k) {
    const Top top = random_top(random);
    for (Tip tip : {Tip::sliding, Tip::fixed}) {
      const auto ranges = stable_speeds(top, tip);
      const double natural = std::sqrt(top.mass_g * kGravity * top.height_mm / top.axial_g_mm2);
      std::vector<double> speeds;
      for (int n = 0; n < 4; ++n) speeds.push_back(natural * std::pow(10, exponent(random)));
      for (const SpeedRange& r : ranges) {
        for (double end : {r.lo_rad_s, r.hi_rad_s}) {
          if (!std::isfinite(end)) continue;
          speeds.push_back(end * (1 - 1e-5));
          speeds.push_back(end * (1 + 1e-5));
        }
      }
      for (double w : speeds) {
        if (relative_distance_to_ends(ranges, w) < 5e-6) continue;
        const double growth = growth_rate(top, tip, w, kGravity);
        const bool predicted = in_ranges(ranges, w);
        (predicted ? stable : unstable) += 1;
        ASSERT_EQ(growth < 1e-6, predicted) << "growth " << growth << " per radian at " << w << " rad/s; m " << top.mass_g << " l "
                                            << top.height_mm << " I " << top.lateral_1_g_mm2 << " " << top.lateral_2_g_mm2 << " "
                                            << top.axial_g_mm2;
      }
    }
  }
  EXPECT_GT(stable, 5000);
  EXPECT_GT(unstable, 5000);
}

TEST(StableSpeeds, ScaleWithTheRootOfGravityOverLength) {
  std::mt19937 random(4);
  const double s = 3.7, density = 2.2, gravity = 1620;  // larger, heavier, on the moon
  for (int k = 0; k < 300; ++k) {
    const Top top = random_top(random);
    const double m = density * s * s * s, i = m * s * s;
    const Top scaled{top.mass_g * m, top.height_mm * s, top.lateral_1_g_mm2 * i, top.lateral_2_g_mm2 * i, top.axial_g_mm2 * i};
    for (Tip tip : {Tip::sliding, Tip::fixed}) {
      const auto a = stable_speeds(top, tip), b = stable_speeds(scaled, tip, gravity);
      const double factor = std::sqrt(gravity / kGravity / s);
      ASSERT_EQ(a.size(), b.size());
      for (size_t r = 0; r < a.size(); ++r) {
        EXPECT_NEAR(b[r].lo_rad_s, factor * a[r].lo_rad_s, 1e-9 * b[r].lo_rad_s);
        if (std::isfinite(a[r].hi_rad_s)) {
          EXPECT_NEAR(b[r].hi_rad_s, factor * a[r].hi_rad_s, 1e-9 * b[r].hi_rad_s);
        } else {
          EXPECT_EQ(b[r].hi_rad_s, kInfinity);
        }
      }
    }
  }
}

TEST(StableSpeeds, RangesAreAscendingAndDisjoint) {
  std::mt19937 random(5);
  for (int k = 0; k < 3000; ++k) {
    const Top top = random_top(random);
    for (Tip tip : {Tip::sliding, Tip::fixed}) {
      double last = -1;
      for (const SpeedRange& r : stable_speeds(top, tip)) {
        EXPECT_GT(r.lo_rad_s, last);
        EXPECT_GT(r.hi_rad_s, r.lo_rad_s);
        last = r.hi_rad_s;
      }
    }
  }
}

TEST(StableSpeeds, FreeBodyIsStableAboutItsLargestAndSmallestAxisAtAnySpeed) {
  for (Tip tip : {Tip::sliding, Tip::fixed}) {
    for (double axial : {3.0, 1.0}) {
      const auto ranges = stable_speeds({1, 0, 1.5, 2.5, axial}, tip);
      ASSERT_EQ(ranges.size(), 1u);
      EXPECT_EQ(ranges[0].lo_rad_s, 0);
      EXPECT_EQ(ranges[0].hi_rad_s, kInfinity);
    }
    EXPECT_TRUE(stable_speeds({1, 0, 1.5, 2.5, 2}, tip).empty());
    // neutral: no distinct axis
    EXPECT_TRUE(stable_speeds({1, 0, 1.5, 2.5, 1.5}, tip).empty());
    EXPECT_TRUE(stable_speeds({1, 0, 1.5, 2.5, 2.5}, tip).empty());
    EXPECT_TRUE(stable_speeds({1, 0, 2, 2, 2}, tip).empty());
  }
}

TEST(StableSpeeds, PendulumHangsStablyAtRest) {
  // Centre of mass below a fixed point: stable from standstill on; the middle axis loses it where the centrifugal torque wins.
  const Top pendulum{2, -5, 20, 30, 10};
  const auto ranges = stable_speeds(pendulum, Tip::fixed);
  ASSERT_FALSE(ranges.empty());
  EXPECT_EQ(ranges[0].lo_rad_s, 0);
  const double leave = std::sqrt(2 * kGravity * 5 / (30 + 2 * 25 - 10));
  EXPECT_NEAR(ranges[0].hi_rad_s, leave, 1e-12 * leave);
  std::mt19937 random(6);
  std::uniform_real_distribution<double> exponent(-2, 2);
  for (int k = 0; k < 1000; ++k) {
    Top top = random_top(random);
    top.height_mm = -top.height_mm;
    for (Tip tip : {Tip::sliding, Tip::fixed}) {
      const auto r = stable_speeds(top, tip);
      const double w = std::sqrt(-top.mass_g * kGravity * top.height_mm / top.axial_g_mm2) * std::pow(10, exponent(random));
      if (relative_distance_to_ends(r, w) < 1e-5) continue;
      ASSERT_EQ(growth_rate(top, tip, w, kGravity) < 1e-6, in_ranges(r, w)) << w;
    }
  }
}

TEST(StableSpeeds, RefusesImpossibleTops) {
  EXPECT_THROW(stable_speeds({0, 1, 1, 1, 1}, Tip::fixed), Error);
  EXPECT_THROW(stable_speeds({1, 1, -1, 1, 1}, Tip::fixed), Error);
  EXPECT_THROW(stable_speeds({1, 1, 1, 1, std::nan("")}, Tip::fixed), Error);
  EXPECT_THROW(stable_speeds({1, kInfinity, 1, 1, 1}, Tip::fixed), Error);
}

TEST(OffBalanceTilt, IsTheSteadyLeanInTheWorstDirection) {
  // A centre of mass beside the axis turns the top by M g e about the other lateral axis: where do the equations of motion rest?
  std::mt19937 random(21);
  for (int n = 0; n < 200; ++n) {
    Top top = random_top(random);
    if (n % 4 == 0) top.height_mm = -top.height_mm;
    if (n % 4 == 1) top.height_mm = 0;
    const double offset = 0.01, w = std::uniform_real_distribution<double>(5, 200)(random);
    const double turn = top.mass_g * kGravity * offset / (w * w);
    Eigen::Matrix<double, 4, 2> forcing = Eigen::Matrix<double, 4, 2>::Zero();
    forcing(3, 0) = turn / top.lateral_2_g_mm2;
    forcing(2, 1) = -turn / top.lateral_1_g_mm2;
    const Eigen::Matrix<double, 4, 2> rest = motion_of(top, Tip::sliding, w, kGravity).fullPivLu().solve(-forcing);
    const double lean = std::max(rest.col(0).head<2>().norm(), rest.col(1).head<2>().norm());
    EXPECT_NEAR(off_balance_tilt_rad(top, offset, w), lean, 1e-8 * lean) << n;
  }
}

// A box with edges 20, 30, 40 mm; its centre at `centre`, turned by `turn`.
MassProperties turned_box(const Eigen::Vector3d& centre, const Eigen::Matrix3d& turn) {
  const Mesh box = test::box({-10, -15, -20}, {10, 15, 20});
  return mass_properties(mesh_moments(test::moved(test::rotated(box, turn), centre)), 1.2);
}

TEST(SpinState, BoxAboutEachOfItsAxes) {
  const MassProperties box = turned_box({0, 0, 0}, Eigen::Matrix3d::Identity());
  const double m = 24 * 1.2;
  EXPECT_NEAR(box.mass_g, m, 1e-10);
  const double ix = m * (900 + 1600) / 12, iy = m * (400 + 1600) / 12, iz = m * (400 + 900) / 12;
  const struct {
    Eigen::Vector3d axis;
    AxisClass axis_class;
    double ratio_larger, ratio_smaller, height;
  } cases[] = {{Eigen::Vector3d::UnitX(), AxisClass::largest, ix / iy, ix / iz, 10},
               {Eigen::Vector3d::UnitY(), AxisClass::middle, iy / ix, iy / iz, 15},
               {Eigen::Vector3d::UnitZ(), AxisClass::smallest, iz / ix, iz / iy, 20}};
  for (const auto& c : cases) {
    const SpinState s = spin_state(box, -c.height * c.axis, c.axis);
    EXPECT_NEAR(s.offset_mm, 0, 1e-12);
    EXPECT_NEAR(s.height_mm, c.height, 1e-12);
    EXPECT_NEAR(s.axis_angle_rad, 0, 1e-12);
    EXPECT_EQ(s.axis_class, c.axis_class);
    EXPECT_NEAR(s.ratio_larger, c.ratio_larger, 1e-12);
    EXPECT_NEAR(s.ratio_smaller, c.ratio_smaller, 1e-12);
    const SpinState free = spin_state(box, -c.height * c.axis, c.axis, true);
    EXPECT_NEAR(free.height_mm, c.height, 1e-12);
    EXPECT_EQ(free.sliding.empty(), c.axis_class == AxisClass::middle);
    EXPECT_EQ(free.fixed.empty(), c.axis_class == AxisClass::middle);
  }
  const SpinState s = spin_state(box, {-10, 0, 0}, Eigen::Vector3d::UnitX());
  const double eq1 = std::sqrt(m * kGravity * 10 / (ix - iy));
  EXPECT_NEAR(s.sliding.back().lo_rad_s, eq1, 1e-10 * eq1);
  EXPECT_EQ(spin_state(box, {-10, 0, 0}, Eigen::Vector3d::UnitX(), true).sliding[0].lo_rad_s, 0);
}

TEST(SpinState, DoesNotDependOnTheFrame) {
  const Eigen::Matrix3d turn = Eigen::AngleAxisd(2.1, Eigen::Vector3d(1, -2, 0.5).normalized()).toRotationMatrix();
  const Eigen::Vector3d shift(40, -25, 60), contact(-10, 2, -3);
  const Eigen::Vector3d axis = Eigen::Vector3d(1, 0.1, 0.2).normalized();
  const SpinState a = spin_state(turned_box({0, 0, 0}, Eigen::Matrix3d::Identity()), contact, axis);
  const SpinState b = spin_state(turned_box(shift, turn), turn * contact + shift, turn * axis);
  EXPECT_NEAR(a.offset_mm, b.offset_mm, 1e-11);
  EXPECT_NEAR(a.height_mm, b.height_mm, 1e-11);
  EXPECT_NEAR(a.axis_angle_rad, b.axis_angle_rad, 1e-11);
  EXPECT_EQ(a.axis_class, b.axis_class);
  EXPECT_NEAR(a.ratio_larger, b.ratio_larger, 1e-11);
  EXPECT_NEAR(a.ratio_smaller, b.ratio_smaller, 1e-11);
  ASSERT_EQ(a.fixed.size(), b.fixed.size());
  ASSERT_FALSE(a.fixed.empty());
  EXPECT_NEAR(a.fixed[0].lo_rad_s, b.fixed[0].lo_rad_s, 1e-9 * a.fixed[0].lo_rad_s);
}

TEST(SpinState, OffsetAndAngleAreThoseOfTheConstruction) {
  const MassProperties box = turned_box({3, 4, 50}, Eigen::AngleAxisd(0.3, Eigen::Vector3d::UnitX()).toRotationMatrix());
  const SpinState s = spin_state(box, {0, 0, 8}, Eigen::Vector3d::UnitZ());
  EXPECT_NEAR(s.offset_mm, 5, 1e-11);
  EXPECT_NEAR(s.height_mm, 42, 1e-11);
  EXPECT_NEAR(s.axis_angle_rad, 0.3, 1e-11);
  // A small angle keeps its digits, and so does one beyond 45 degrees, next to another axis.
  const auto turned = [](double angle) {
    return spin_state(turned_box({0, 0, 0}, Eigen::AngleAxisd(angle, Eigen::Vector3d::UnitX()).toRotationMatrix()), {0, 0, -20},
                      Eigen::Vector3d::UnitZ())
        .axis_angle_rad;
  };
  EXPECT_NEAR(turned(1e-7), 1e-7, 1e-13);
  EXPECT_NEAR(turned(1.4), test::kPi / 2 - 1.4, 1e-11);
}

TEST(SpinState, EveryAxisOfACubeIsAPrincipalAxis) {
  const MassProperties cube = mass_properties(mesh_moments(test::box({-5, -5, -5}, {5, 5, 5})), 1);
  const SpinState s = spin_state(cube, {0, 0, -5}, Eigen::Vector3d(1, 2, 3).normalized());
  EXPECT_NEAR(s.axis_angle_rad, 0, 1e-6);
  EXPECT_NEAR(s.ratio_larger, 1, 1e-12);
  EXPECT_NEAR(s.ratio_smaller, 1, 1e-12);
  EXPECT_NE(s.axis_class, AxisClass::largest);
  // A square prism: any axis across it is principal, whatever the eigensolver chose.
  const MassProperties prism = mass_properties(mesh_moments(test::box({-5, -5, -8}, {5, 5, 8})), 1);
  EXPECT_NEAR(spin_state(prism, {0, 0, 0}, Eigen::Vector3d(0.6, 0.8, 0)).axis_angle_rad, 0, 1e-12);
  EXPECT_NEAR(spin_state(prism, {0, 0, 0}, Eigen::Vector3d(0.6, 0, 0.8)).axis_angle_rad, std::asin(0.6), 1e-12);
}

TEST(SpinState, MomentsThatDifferByRoundingAreTheSame) {
  const auto class_of = [](double excess) {
    MassProperties body = mass_properties(mesh_moments(test::box({-5, -5, -5}, {5, 5, 5})), 1);
    body.inertia_g_mm2(2, 2) *= 1 + excess;
    body.principal_moments_g_mm2[2] = body.inertia_g_mm2(2, 2);
    return spin_state(body, {0, 0, -5}, Eigen::Vector3d::UnitZ()).axis_class;
  };
  EXPECT_EQ(class_of(1e-11), class_of(0));
  EXPECT_NE(class_of(1e-11), AxisClass::largest);
  EXPECT_EQ(class_of(1e-7), AxisClass::largest);
}

TEST(SpinState, RefusesAnAxisThatIsNotUnit) {
  const MassProperties box = turned_box({0, 0, 0}, Eigen::Matrix3d::Identity());
  EXPECT_THROW(spin_state(box, {0, 0, 0}, {0, 0, 2}), Error);
  EXPECT_THROW(spin_state(box, {0, 0, 0}, {0, 0, 0}), Error);
}

TEST(Rpm, OneRevolutionPerSecondIsSixty) {
  EXPECT_NEAR(rpm(2 * test::kPi), 60, 1e-12);
  EXPECT_EQ(rpm(kInfinity), kInfinity);
}

}  // namespace
}  // namespace rayrep
