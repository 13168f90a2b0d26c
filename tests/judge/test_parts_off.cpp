// Things of several parts of which each print comes out a little heavier or lighter: theory.md (127) to (129)

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "judge/parts_off.h"
#include "rayrep/judge/verify_mechanism.h"
#include "solids.h"

namespace rayrep::test {
namespace {

using Eigen::Affine3d;
using Eigen::Translation3d;
using Eigen::Vector3d;
using verify_detail::Share;

constexpr double kOff = 0.01;

/// A signed fraction of kOff for every part, one after the other.
std::vector<double> corner(std::size_t number, std::size_t parts) {
  std::vector<double> e;
  for (std::size_t n = 0; n < parts; ++n) e.push_back(number >> n & 1 ? kOff : -kOff);
  return e;
}

TEST(PartsOff, TheLargestFractionIsThatOfTheBestCorner) {
  std::mt19937 random(7);
  std::uniform_real_distribution<double> any(-1, 1), positive(0.1, 1);
  for (int trial = 0; trial < 200; ++trial) {
    std::vector<Share> shares;
    for (int n = 0; n < 6; ++n) shares.push_back({any(random), positive(random), 0.3 * positive(random)});
    double best = -1e9;
    for (std::size_t c = 0; c < 64; ++c) {
      double numerator = 0, denominator = 0;
      for (std::size_t n = 0; n < 6; ++n) {
        const double e = c >> n & 1 ? shares[n].off : -shares[n].off;
        numerator += (1 + e) * shares[n].numerator;
        denominator += (1 + e) * shares[n].denominator;
      }
      best = std::max(best, numerator / denominator);
    }
    EXPECT_NEAR(verify_detail::largest_fraction(shares).value, best, 1e-12);
  }
}

Mechanism of_boxes(std::vector<Mesh> boxes, Pose::Kind kind) {
  Mechanism mechanism;
  MechanismState state{"so", {}, {.up = Vector3d::UnitZ()}};
  state.rests.kind = kind;
  for (Mesh& mesh : boxes) {
    mechanism.parts.push_back({"part " + std::to_string(mechanism.parts.size() + 1), std::move(mesh), {}});
    state.poses.push_back(Affine3d(Translation3d(0, 0, 0)));
  }
  mechanism.states = {state};
  return mechanism;
}

PoseVerdict judged(const Mechanism& mechanism) {
  return verify(mechanism, std::vector<const Mesh*>(mechanism.parts.size(), nullptr)).states.at(0);
}

const Figure* figure(const Figures& figures, const std::string& name) {
  for (const Figure& one : figures)
    if (one.name == name) return &one;
  return nullptr;
}

double told(const PoseVerdict& verdict, const char* name) {
  const Figure* all = figure(verdict.figures, "with_parts_off");
  if (all)
    for (const auto& [key, value] : std::get<Record>(all->value))
      if (key == name && std::get_if<double>(&value)) return std::get<double>(value);
  return std::nan("");
}

/// The figure that changes most for the worse, with each part that is printed made of another plastic.
template <typename Worse>
double worst_of_corners(const Mechanism& mechanism, const char* name, const Worse& worse) {
  double worst = std::nan("");
  for (std::size_t c = 0; c < std::size_t{1} << mechanism.parts.size(); ++c) {
    Mechanism off = mechanism;
    const std::vector<double> e = corner(c, mechanism.parts.size());
    for (std::size_t n = 0; n < e.size(); ++n)
      if (off.parts[n].printed) off.parts[n].print.density_g_cm3 *= 1 + e[n];
    const double value = std::get<double>(figure(judged(off).figures, name)->value);
    if (std::isnan(worst) || worse(value, worst)) worst = value;
  }
  return worst;
}

Mechanism tower() {
  return of_boxes({box({-10, -10, 0}, {10, 10, 40}), box({0, -8, 40}, {30, 8, 50}), box({-20, -20, 50}, {0, 2, 70})},
                  Pose::Kind::stands);
}

TEST(PartsOff, WhatStandsIsAsSafeAsItsWorstPrints) {
  const Mechanism mechanism = tower();
  const PoseVerdict verdict = judged(mechanism);
  ASSERT_TRUE(verdict.pass());
  const double angle = told(verdict, "tipping_angle_rad");
  EXPECT_NEAR(angle, worst_of_corners(mechanism, "smallest_tipping_angle_rad", std::less<>()), 1e-9);
  EXPECT_LT(angle, verdict.smallest_tipping_angle_rad - 1e-4);
  EXPECT_NE(verdict.meaning.back().find("With each part 1 % heavier or lighter by itself"), std::string::npos);
}

TEST(PartsOff, WhatIsNotPrintedWeighsWhatIsSaid) {
  Mechanism mechanism = tower();
  const double all = told(judged(mechanism), "tipping_angle_rad");
  mechanism.parts[1].printed = false;
  const double others = told(judged(mechanism), "tipping_angle_rad");
  EXPECT_GT(others, all);
  EXPECT_NEAR(others, worst_of_corners(mechanism, "smallest_tipping_angle_rad", std::less<>()), 1e-9);
}

TEST(PartsOff, WhatHangsLeansByItsWorstPrints) {
  Mechanism mechanism = tower();
  PoseVerdict still = judged(mechanism);
  mechanism.states[0].rests.kind = Pose::Kind::hangs;
  mechanism.states[0].rests.point_mm = still.body.centre_of_mass_mm + Vector3d(0, 0, 60);
  const double tilt = told(judged(mechanism), "tilt_rad");
  const double worst = worst_of_corners(mechanism, "pose_1_hangs_at_rad", std::greater<>());
  EXPECT_LE(tilt, worst * (1 + 1e-9));
  EXPECT_GE(tilt, worst * (1 - 2e-3));
  EXPECT_GT(tilt, 1e-3);
}

TEST(PartsOff, WhatFloatsHeelsByItsWorstPrints) {
  Mechanism boat = of_boxes({box({-40, 0.5, 0}, {40, 30, 10}), box({-40, -30, 0}, {40, -0.5, 10})}, Pose::Kind::floats);
  for (MechanismPart& part : boat.parts) part.print.density_g_cm3 = 0.6;
  const PoseVerdict verdict = judged(boat);
  ASSERT_TRUE(verdict.pass());
  const double tilt = told(verdict, "tilt_rad");
  EXPECT_NEAR(tilt, worst_of_corners(boat, "pose_1_settled_tilt_rad", std::greater<>()), 1e-5);
  // One side 1 % heavier, the other lighter: 15.25 mm from the middle each; the metacentric height is that of a box nearly.
  const double height = std::get<double>(figure(verdict.figures, "pose_1_metacentric_height_mm")->value);
  EXPECT_NEAR(tilt, kOff * 15.25 / height, 0.02 * tilt);
}

TEST(PartsOff, WhatThenFallsIsNoted) {
  // Level at 38.28 mm: there the moments about the edge x = 10 are as large to both sides.
  const Mechanism mechanism = of_boxes({box({-10, -10, 0}, {10, 10, 10}), box({-10, -10, 10}, {38.2, 10, 20})}, Pose::Kind::stands);
  const PoseVerdict verdict = judged(mechanism);
  ASSERT_TRUE(verdict.pass()) << verdict.smallest_tipping_angle_rad;
  EXPECT_LT(told(verdict, "tipping_angle_rad"), 0);
  const auto noted = [](const std::string& note) {
    return note.find("part 2 1 % heavier and part 1 1 % lighter") != std::string::npos;
  };
  EXPECT_TRUE(std::any_of(verdict.notes.begin(), verdict.notes.end(), noted));
}

TEST(PartsOff, OnePartAloneAndWhatDoesNotRestAreNotTold) {
  EXPECT_TRUE(std::isnan(told(judged(of_boxes({box({0, 0, 0}, {10, 10, 10})}, Pose::Kind::stands)), "tipping_angle_rad")));
  const Mechanism falls = of_boxes({box({0, 0, 0}, {10, 10, 10}), box({0, 0, 10}, {90, 10, 20})}, Pose::Kind::stands);
  EXPECT_FALSE(judged(falls).pass());
  EXPECT_TRUE(std::isnan(told(judged(falls), "tipping_angle_rad")));
}

TEST(PartsOff, TwoPartsOnOneHingeMoveTheirCentre) {
  Mechanism mechanism = of_boxes(
      {box({-15, -15, 0}, {15, 15, 60}), box({0, -8, 72}, {30, 8, 88}), box({-30, -8, 72}, {-0.5, 8, 88})}, Pose::Kind::stands);
  const double a = 15, b = -15.25, m = 30, n = 29.5;
  const double centre = (a * m + b * n) / (m + n);
  mechanism.states[0].hinges = {{.point_mm = {centre, 0, 80}, .axis = Vector3d::UnitY(), .parts = {1, 2}}};
  const PoseVerdict verdict = judged(mechanism);
  ASSERT_TRUE(verdict.pass());
  const double heavier = (a * m * 1.01 + b * n * 0.99) / (1.01 * m + 0.99 * n) - centre;
  const double lighter = centre - (a * m * 0.99 + b * n * 1.01) / (0.99 * m + 1.01 * n);
  EXPECT_NEAR(std::get<double>(figure(verdict.figures, "hinge_1_with_parts_off_mm")->value), std::max(heavier, lighter), 1e-9);
  EXPECT_NEAR(std::get<double>(figure(verdict.figures, "hinge_1_beside_mm")->value), 0, 1e-9);
  EXPECT_NE(verdict.meaning.back().find("stays where it is left"), std::string::npos);
  mechanism.states[0].hinges[0].point_mm.x() += 5;
  EXPECT_NE(judged(mechanism).meaning.back().find("5.00 mm beside the plane through it"), std::string::npos);
}

}  // namespace
}  // namespace rayrep::test
