// The predicted ranges of stable speeds against nonlinear simulations of the spinning body (physics.h).

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <random>
#include <string>
#include <vector>

#include "physics/spin_simulation.h"
#include "rayrep/physics/moments.h"
#include "rayrep/physics/spin.h"
#include "solids.h"

namespace rayrep {
namespace {

using physics::Body;
using physics::EquationsOfMotion;
using physics::Motion;
using physics::simulate;
using physics::Spin;
using physics::Support;

constexpr double kKick = 1e-5;   // small, so that what grows near an end of a range does so by the linear terms
constexpr double kSmall = 60;    // times the kick: neutral oscillations add up to about 1 / sqrt(distance to the end)
constexpr double kLarge = 1000;  // times the kick
constexpr double kDistance = 0.01;

Support support_of(Tip tip) { return tip == Tip::sliding ? Support::sliding : Support::fixed; }

// An ellipsoid of semi-axes a, b, c that spins about z with its tip at -height, turned as a whole to have a full inertia tensor.
struct Ellipsoid {
  const char* name;
  double a, b, c, height;
};

struct SpinningBody {
  Body body;
  Eigen::Vector3d axis;
  SpinState state;
};

SpinningBody turned(const Ellipsoid& e, bool yoyo = false) {
  const Eigen::Matrix3d turn = Eigen::AngleAxisd(1.1, Eigen::Vector3d(2, -1, 3).normalized()).toRotationMatrix();
  MassProperties m = mass_properties(test::ellipsoid_moments(e.a, e.b, e.c), 1.1);
  m.inertia_g_mm2 = turn * m.inertia_g_mm2 * turn.transpose();
  m.principal_axes = turn * m.principal_axes;
  SpinningBody s;
  s.axis = turn.col(2);
  s.body = {m.mass_g, m.inertia_g_mm2, -e.height * s.axis};
  s.state = spin_state(m, m.centre_of_mass_mm - e.height * s.axis, s.axis, yoyo);
  return s;
}

Motion run(const SpinningBody& s, Support support, double speed, double revolutions) {
  Spin spin;
  spin.axis = s.axis;
  spin.speed_rad_s = speed;
  spin.kick = kKick;
  spin.revolutions = revolutions;
  spin.stop_tilt_rad = 2 * kLarge * kKick;
  const Motion motion = simulate(s.body, support, spin);
  EXPECT_LT(motion.energy_drift, 1e-8);
  EXPECT_LT(motion.momentum_drift, 1e-8);
  return motion;
}

// Speeds inside the ranges at both ends and in the middle must keep the kick small, those just outside must let it grow.
void check(const SpinningBody& s, Tip tip, const std::string& name) {
  const auto& ranges = tip == Tip::sliding ? s.state.sliding : s.state.fixed;
  const auto stays = [&](double w) {
    const Motion m = run(s, support_of(tip), w, 150);
    EXPECT_LT(m.largest_tilt_rad, kSmall * kKick) << name << " should be stable at " << w << " rad/s";
  };
  const auto grows = [&](double w) {
    const Motion m = run(s, support_of(tip), w, 1200);
    EXPECT_GT(m.largest_tilt_rad, kLarge * kKick) << name << " should be unstable at " << w << " rad/s";
  };
  double last_hi = 0;
  for (const SpeedRange& r : ranges) {
    SCOPED_TRACE(name + ": " + std::to_string(r.lo_rad_s) + " to " + std::to_string(r.hi_rad_s) + " rad/s");
    // Near both ends of a narrow range the oscillations add up to more; gaps narrower than the distance are passed over.
    const double lo = r.lo_rad_s, hi = std::isfinite(r.hi_rad_s) ? r.hi_rad_s : 3 * lo;
    if (hi > (1 + 3 * kDistance) * lo) {
      stays(lo * (1 + kDistance));
      stays(0.5 * (lo + hi));
      stays(hi * (1 - kDistance));
    }
    if (lo > (1 + 3 * kDistance) * last_hi) {
      if (last_hi > 0) grows(last_hi * (1 + kDistance));
      grows(lo * (1 - kDistance));
    }
    last_hi = r.hi_rad_s;
  }
  if (std::isfinite(last_hi) && last_hi > 0) {
    grows(last_hi * (1 + kDistance));
    grows(last_hi * 3);
  }
  if (ranges.empty()) {
    const double natural = std::sqrt(9806.65 / s.state.height_mm);
    for (double w : {0.5, 1.0, 2.0, 5.0}) grows(w * natural);
  }
}

void check_all(const std::vector<Ellipsoid>& bodies, AxisClass axis_class) {
  for (const Ellipsoid& e : bodies) {
    const SpinningBody s = turned(e);
    ASSERT_EQ(s.state.axis_class, axis_class) << e.name;
    for (Tip tip : {Tip::sliding, Tip::fixed}) check(s, tip, std::string(e.name) + (tip == Tip::sliding ? ", sliding" : ", fixed"));
  }
}

TEST(Physics, LargestAxis) {
  check_all({{"disk", 20, 20, 8, 12},
             {"bean", 24, 18, 10, 9},
             {"brick", 30, 18, 12, 12},
             {"leaf", 25, 12, 5, 20},
             {"coin", 21, 19, 15, 14}},
            AxisClass::largest);
}

TEST(Physics, SmallestAxis) {
  check_all({{"egg", 12, 12, 18, 18}, {"bar", 10, 11, 30, 30}, {"slab", 9, 14, 20, 15}}, AxisClass::smallest);
}

TEST(Physics, MiddleAxis) {
  check_all({{"pebble", 20, 14, 16, 16}, {"plate", 30, 8, 18, 18}, {"almost round", 20, 18, 19, 19}}, AxisClass::middle);
}

TEST(Physics, RandomTops) {
  std::mt19937 random(1);
  std::uniform_real_distribution<double> size(5, 30);
  int of_class[3] = {};
  for (int n = 0; n < 16; ++n) {
    const Ellipsoid e{"random", size(random), size(random), size(random), size(random)};
    const SpinningBody s = turned(e);
    ++of_class[static_cast<int>(s.state.axis_class)];
    for (Tip tip : {Tip::sliding, Tip::fixed})
      check(s, tip,
            ::testing::PrintToString(std::vector<double>{e.a, e.b, e.c, e.height}) + (tip == Tip::sliding ? " sliding" : " fixed"));
  }
  for (int count : of_class) EXPECT_GE(count, 2);
}

TEST(Physics, FreeBodyKeepsItsLargestAndSmallestAxisAndLeavesTheMiddleOne) {
  for (const Ellipsoid& e : {Ellipsoid{"largest", 30, 20, 10, 0}, Ellipsoid{"smallest", 10, 20, 30, 0}}) {
    const SpinningBody s = turned(e, true);
    ASSERT_EQ(s.state.sliding.size(), 1u) << e.name;
    for (double w : {1.0, 50.0}) EXPECT_LT(run(s, Support::none, w, 300).largest_tilt_rad, 10 * kKick) << e.name;
  }
  const SpinningBody s = turned({"middle", 30, 10, 20, 0}, true);
  EXPECT_TRUE(s.state.sliding.empty());
  for (double w : {1.0, 50.0}) EXPECT_GT(run(s, Support::none, w, 300).largest_tilt_rad, kLarge * kKick);
}

// The simulation itself against known motions.

// A top with its centre of mass beside the axis turns steadily when it leans as predicted, and swings about that when it does not.
TEST(Physics, OffBalanceATopLeansAsPredicted) {
  const double e_mm = 0.02;
  for (const Ellipsoid& e : {Ellipsoid{"oblate", 30, 26, 12, 15}, Ellipsoid{"prolate", 10, 12, 30, 32}})
    for (const int k : {0, 1}) {
      SpinningBody s = turned(e);
      const Eigen::Matrix3d& axes = s.state.body.principal_axes;
      std::vector<int> across;
      for (int n = 0; n < 3; ++n)
        if (std::abs(axes.col(n).dot(s.axis)) < 0.5) across.push_back(n);
      ASSERT_EQ(across.size(), 2u);
      const Eigen::Vector3d lateral = axes.col(across[static_cast<std::size_t>(k)]);
      const double moment = s.state.body.principal_moments_g_mm2[across[static_cast<std::size_t>(k)]];
      s.body.tip_mm -= e_mm * lateral;
      const double axial = s.axis.dot(s.body.inertia_g_mm2 * s.axis);
      const double speed = (e.c > e.a ? 1.5 : 1.3) * s.state.sliding.back().lo_rad_s;
      const double weight = s.body.mass_g * 9806.65;
      const double lean = -weight * e_mm / ((axial - moment) * speed * speed - weight * e.height);
      // The bound is that of the worse of the two directions.
      const Top top{s.body.mass_g, e.height, s.state.body.principal_moments_g_mm2[across[0]],
                    s.state.body.principal_moments_g_mm2[across[1]], axial};
      EXPECT_LE(std::abs(lean), off_balance_tilt_rad(top, e_mm, speed) * (1 + 1e-12)) << e.name;
      Spin spin;
      spin.speed_rad_s = speed;
      spin.kick = 0;
      spin.axis = (s.axis + lean * lateral).normalized();
      EXPECT_LT(simulate(s.body, Support::sliding, spin).largest_tilt_rad, 0.02 * std::abs(lean)) << e.name << k;
      spin.axis = s.axis;
      EXPECT_GT(simulate(s.body, Support::sliding, spin).largest_tilt_rad, 1.5 * std::abs(lean)) << e.name << k;
    }
}

TEST(Simulation, BodyThatDoesNotSpinSwingsLikeAPendulum) {
  // Hanging from its tip, released at 1e-4 rad: after half a period it is at the other side.
  const SpinningBody s = turned({"bob", 5, 5, 5, -40});
  const double moment = s.body.mass_g * (0.4 * 25 + 1600), omega = std::sqrt(s.body.mass_g * 9806.65 * 40 / moment);
  const EquationsOfMotion equations(s.body, Support::fixed, 9806.65);
  const Eigen::Vector3d side = s.axis.unitOrthogonal();
  EquationsOfMotion::State x(6, 0.0);
  Eigen::Map<Eigen::Vector3d>(x.data()) = (s.axis + 1e-4 * side).normalized();
  boost::numeric::odeint::runge_kutta_fehlberg78<EquationsOfMotion::State> stepper;
  for (int n = 0; n < 200; ++n) stepper.do_step(equations, x, 0, test::kPi / omega / 200);
  EXPECT_NEAR(Eigen::Map<Eigen::Vector3d>(x.data()).dot(side), -1e-4, 1e-10);
}

TEST(Simulation, SlidingBodyFallsOverWithTheExponentOfItsWeight) {
  // Without spin the tilt grows as cosh(sqrt(M g l / I) t), I about the centre of mass, which moves straight down.
  const SpinningBody s = turned({"ball", 9, 9, 9, 20});
  const double omega = std::sqrt(9806.65 * 20 / (0.4 * 81));
  const EquationsOfMotion equations(s.body, Support::sliding, 9806.65);
  const Eigen::Vector3d side = s.axis.unitOrthogonal();
  EquationsOfMotion::State x(6, 0.0);
  Eigen::Map<Eigen::Vector3d>(x.data()) = (s.axis + 1e-5 * side).normalized();
  boost::numeric::odeint::runge_kutta_fehlberg78<EquationsOfMotion::State> stepper;
  for (int n = 0; n < 200; ++n) stepper.do_step(equations, x, 0, 3 / omega / 200);
  EXPECT_NEAR(Eigen::Map<Eigen::Vector3d>(x.data()).dot(side), 1e-5 * std::cosh(3), 1e-10);
}

TEST(Simulation, SymmetricFreeBodyPrecessesOnACone) {
  // The axis circles the angular momentum at atan(I1 p / I3 w) from it, so that it gets twice as far from its start.
  const SpinningBody s = turned({"disk", 20, 20, 5, 0}, true);
  const double i3 = 2.0 / 5 * 400, i1 = (400 + 25) / 5.0, p = 4, w = 30;
  const EquationsOfMotion equations(s.body, Support::none, 0);
  EquationsOfMotion::State x(6);
  Eigen::Map<Eigen::Vector3d>(x.data()) = s.axis;
  Eigen::Map<Eigen::Vector3d>(x.data() + 3) = w * s.axis + p * s.axis.unitOrthogonal();
  boost::numeric::odeint::runge_kutta_fehlberg78<EquationsOfMotion::State> stepper;
  double farthest = 0;
  for (int n = 0; n < 4000; ++n) {
    stepper.do_step(equations, x, 0, 2e-4);
    const Eigen::Map<const Eigen::Vector3d> k(x.data());
    farthest = std::max(farthest, std::atan2(k.cross(s.axis).norm(), k.dot(s.axis)));
  }
  EXPECT_NEAR(farthest, 2 * std::atan2(i1 * p, i3 * w), 1e-5);
}

}  // namespace
}  // namespace rayrep
