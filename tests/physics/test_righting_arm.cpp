#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <Eigen/Geometry>
#include <cmath>
#include <limits>
#include <vector>

#include "rayrep/base/error.h"
#include "rayrep/physics/moments.h"
#include "rayrep/physics/righting_arm.h"
#include "solids.h"

namespace rayrep {
namespace {

using test::kPi;
using End = RightingCurve::End;
const Eigen::Vector3d kUp = Eigen::Vector3d::UnitZ();
const Eigen::Vector3d kX = Eigen::Vector3d::UnitX();
const Eigen::Vector3d kY = Eigen::Vector3d::UnitY();

constexpr double kDegree = kPi / 180;

// Up in the frame of a body that is heeled until `lowered` is down by so much.
Eigen::Vector3d up_at(double heel, const Eigen::Vector3d& up, const Eigen::Vector3d& lowered) {
  return std::cos(heel) * up - std::sin(heel) * lowered;
}

Hydrostatics water_at(const FloatingBody& body, const Eigen::Vector3d& up) {
  return hydrostatics(body.hull, {up, waterline_for_volume(body.hull, up, body.volume_mm3)});
}

double energy_at(const FloatingBody& body, const Eigen::Vector3d& up) {
  return up.dot(body.centre_of_mass_mm - water_at(body, up).centre_of_buoyancy_mm);
}

// The body with its centre of mass on the vertical through the centre of buoyancy, so much above that.
FloatingBody balanced(const PreparedHull& hull, double fraction, double above_mm, const Eigen::Vector3d& up = kUp) {
  FloatingBody body{hull, fraction * mesh_moments(hull.mesh())[M1], Eigen::Vector3d::Zero(), up.normalized()};
  body.centre_of_mass_mm = water_at(body, body.up).centre_of_buoyancy_mm + above_mm * body.up;
  return body;
}

// Breadth 40 along y, length 60, depth 30, draught 12.
struct Barge {
  static constexpr double breadth = 40;
  static constexpr double draught = 12;
  PreparedHull hull = test::box({-30, -20, 0}, {30, 20, 30});
  static double metacentric_radius(double across) { return across * across / (12 * draught); }
  FloatingBody with_centre_at(double height) const { return {hull, 60 * 40 * draught, {0, 0, height}, kUp}; }
};

// Wall-sided: as long as the deck is dry and the bottom is wet.
TEST(RightingArm, OfABoxByHand) {
  const Barge barge;
  const double height = 14;
  RightingOptions fine;
  fine.steps = 360;
  for (const auto& [lowered, across] : {std::pair(kY, 40.), std::pair(Eigen::Vector3d(-kY), 40.), std::pair(kX, 60.)}) {
    const RightingCurve curve = righting_curve(barge.with_centre_at(height), lowered, fine);
    const double radius = Barge::metacentric_radius(across);
    const double metacentric_height = Barge::draught / 2 + radius - height;
    const double wall_sided = std::atan(2 * std::min(Barge::draught, 30 - Barge::draught) / across);
    ASSERT_EQ(curve.heel_rad.size(), 361u);
    EXPECT_EQ(curve.lowered, lowered);
    EXPECT_EQ(curve.heel_rad.back(), kPi);
    int compared = 0;
    for (std::size_t k = 0; k < curve.heel_rad.size() && curve.heel_rad[k] < wall_sided; ++k, ++compared) {
      const double tangent = std::tan(curve.heel_rad[k]);
      EXPECT_NEAR(curve.arm_mm[k], std::sin(curve.heel_rad[k]) * (metacentric_height + radius * tangent * tangent / 2), 1e-12);
    }
    EXPECT_GT(compared, 40);
  }
}

// Of a sphere all buoyancy passes through the middle: GZ = d sin(heel), d the depth of the centre of mass below it.
TEST(RightingArm, OfASphereIsThatOfItsLowCentreOfMass) {
  const double depth = 3;
  double errors[2];
  for (const int subdivisions : {3, 4}) {
    const PreparedHull ball = test::icosphere(20, subdivisions, {1, 2, 3});
    const FloatingBody body{ball, 0.4 * mesh_moments(ball.mesh())[M1], {1, 2, 3 - depth}, kUp};
    const RightingCurve curve = weakest_righting_curve(body);
    double& error = errors[subdivisions - 3];
    error = 0;
    for (std::size_t k = 0; k < curve.heel_rad.size(); ++k)
      error = std::max(error, std::abs(curve.arm_mm[k] - depth * std::sin(curve.heel_rad[k])));
    EXPECT_EQ(curve.end, End::none);
    EXPECT_EQ(curve.range_rad, kPi);
    EXPECT_NEAR(curve.area_mm_rad, 2 * depth, 1e-3);
    EXPECT_EQ(curve.largest, 9u);
  }
  EXPECT_LT(errors[1], 5e-3);
  EXPECT_LT(errors[1], errors[0] / 3);
}

TEST(RightingArm, BeginsWithTheMetacentricHeight) {
  RightingOptions fine;
  fine.steps = 1800;
  for (const Mesh& mesh : {test::uv_ellipsoid(9, 6, 4, 24), test::box({0, 0, 0}, {9, 5, 4}), test::torus(9, 4, 30, 20)}) {
    const PreparedHull hull = mesh;
    const FloatingBody body = balanced(hull, 0.4, 0.3);
    const double metacentric_height = water_at(body, kUp).metacentric_radius_mm() - 0.3;
    ASSERT_GT(metacentric_height, 0);
    const RightingCurve curve = righting_curve(body, kY, fine);
    EXPECT_NEAR(curve.arm_mm[0], 0, 1e-12);
    EXPECT_NEAR(curve.arm_mm[1] / curve.heel_rad[1], metacentric_height, 1e-4);
  }
}

// A body without any symmetry, a direction without any meaning.
struct Odd {
  PreparedHull hull = test::rotated(test::staircase(4, 5), test::random_rotation(3));
  Eigen::Vector3d lowered = Eigen::Vector3d(0.3, -0.8, 0.4);
  FloatingBody body = balanced(hull, 0.45, -1, {0.2, 0.1, 1});
  Eigen::Vector3d across() const { return (lowered - body.up.dot(lowered) * body.up).normalized(); }
};

TEST(RightingArm, IsTheHorizontalDistanceOfTheCentresAndTheSlopeOfTheEnergy) {
  const Odd odd;
  const RightingCurve curve = righting_curve(odd.body, odd.lowered);
  EXPECT_TRUE(test::near(curve.lowered, odd.across(), 1e-15));
  for (std::size_t k = 0; k < curve.heel_rad.size(); ++k) {
    const double heel = curve.heel_rad[k];
    const Eigen::Vector3d up = up_at(heel, odd.body.up, odd.across());
    const Eigen::Vector3d down_side = std::cos(heel) * odd.across() + std::sin(heel) * odd.body.up;  // horizontal there
    const Eigen::Vector3d arm = water_at(odd.body, up).centre_of_buoyancy_mm - odd.body.centre_of_mass_mm;
    EXPECT_NEAR(curve.arm_mm[k], down_side.dot(arm), 1e-11) << heel;
    const double h = 1e-4;
    const double slope = (energy_at(odd.body, up_at(heel + h, odd.body.up, odd.across())) -
                          energy_at(odd.body, up_at(heel - h, odd.body.up, odd.across()))) /
                         (2 * h);
    EXPECT_NEAR(curve.arm_mm[k], slope, 1e-6) << heel;
  }
}

TEST(RightingArm, AreaIsTheRiseOfTheEnergyAndTheIntegralOfTheArms) {
  const Odd odd;
  RightingOptions fine;
  fine.steps = 720;
  const RightingCurve curve = righting_curve(odd.body, odd.lowered, fine);
  ASSERT_EQ(curve.end, End::turns_over);
  ASSERT_GT(curve.range_rad, 0.2);
  ASSERT_LT(curve.range_rad, 3);
  double integral = 0;
  std::size_t k = 1;
  for (; curve.heel_rad[k] < curve.range_rad; ++k)
    integral += (curve.arm_mm[k - 1] + curve.arm_mm[k]) / 2 * (curve.heel_rad[k] - curve.heel_rad[k - 1]);
  integral += curve.arm_mm[k - 1] / 2 * (curve.range_rad - curve.heel_rad[k - 1]);
  EXPECT_NEAR(curve.area_mm_rad, integral, 1e-4);
  const double rise = energy_at(odd.body, up_at(curve.range_rad, odd.body.up, odd.across())) - energy_at(odd.body, odd.body.up);
  EXPECT_NEAR(curve.area_mm_rad, rise, 1e-11);
  // There it vanishes, and not before.
  const Eigen::Vector3d up = up_at(curve.range_rad, odd.body.up, odd.across());
  const Eigen::Vector3d down_side = std::cos(curve.range_rad) * odd.across() + std::sin(curve.range_rad) * odd.body.up;
  EXPECT_NEAR(down_side.dot(water_at(odd.body, up).centre_of_buoyancy_mm - odd.body.centre_of_mass_mm), 0, 1e-5);
  for (std::size_t n = 1; curve.heel_rad[n] < curve.range_rad; ++n) EXPECT_GT(curve.arm_mm[n], 0);
  for (std::size_t n = 0; n < curve.heel_rad.size() && curve.heel_rad[n] <= curve.range_rad; ++n)
    EXPECT_LE(curve.arm_mm[n], curve.arm_mm[curve.largest]);
}

TEST(RightingArm, BothWaysMeetUpsideDownAndAreEqualForASymmetricHull) {
  const Odd odd;
  const RightingCurve one = righting_curve(odd.body, odd.lowered);
  const RightingCurve other = righting_curve(odd.body, -odd.lowered);
  EXPECT_NEAR(one.arm_mm.back(), -other.arm_mm.back(), 1e-11);
  EXPECT_NEAR(one.arm_mm.front(), -other.arm_mm.front(), 1e-11);
  EXPECT_GT(std::abs(one.arm_mm[4] - other.arm_mm[4]), 1e-3);

  const PreparedHull hull = test::merged({test::box({-9, -4, 0}, {9, 4, 3}), test::box({-6, -2, 4}, {2, 2, 8})});
  const FloatingBody boat{hull, 150, {-0.5, 0, 2}, kUp};
  const RightingCurve port = righting_curve(boat, kY);
  const RightingCurve starboard = righting_curve(boat, -kY);
  for (std::size_t k = 0; k < port.arm_mm.size(); ++k) EXPECT_NEAR(port.arm_mm[k], starboard.arm_mm[k], 1e-12);
  EXPECT_NEAR(port.range_rad, starboard.range_rad, 1e-6);
  // By the bow and by the stern it is another boat.
  EXPECT_GT(std::abs(righting_curve(boat, kX).arm_mm[5] - righting_curve(boat, -kX).arm_mm[5]), 1e-3);
}

TEST(RightingArm, WeakestIsTheSmallestRangeOfAllDirections) {
  const Barge barge;
  const RightingCurve rolled = weakest_righting_curve(barge.with_centre_at(17));
  EXPECT_NEAR(std::abs(rolled.lowered.y()), 1, 1e-12);
  EXPECT_EQ(rolled.end, End::turns_over);
  EXPECT_NEAR(rolled.range_rad, righting_curve(barge.with_centre_at(17), kY).range_rad, 1e-5);

  // Over its stern this one goes first, although it is stiffer that way: what keeps it up stands at the bow.
  const PreparedHull hull = test::merged({test::box({-9, -7, 0}, {9, 7, 4}), test::box({4, -6, 4.5}, {9, 6, 16})});
  const FloatingBody body = balanced(hull, 0.3, 3.5);
  const RightingCurve weakest = weakest_righting_curve(body);
  ASSERT_EQ(weakest.end, End::turns_over);
  double smallest = kPi;
  for (int k = 0; k < 8; ++k) {
    const Eigen::Vector3d lowered(std::cos(k * kPi / 4), std::sin(k * kPi / 4), 0);
    smallest = std::min(smallest, righting_curve(body, lowered).range_rad);
  }
  EXPECT_NEAR(weakest.range_rad, smallest, 1e-5);
  EXPECT_LT(weakest.range_rad, std::min(righting_curve(body, kY).range_rad, righting_curve(body, -kY).range_rad) - kDegree);
}

// What the range is for: let go within it the body comes back, let go beyond it on the weakest side it does not.
TEST(RightingArm, WithinTheRangeABodyComesBack) {
  test::Random random(81);
  for (const Mesh& mesh : {test::uv_ellipsoid(9, 7, 6, 24), test::box({-30, -20, 0}, {30, 20, 30}), test::frustum(5, 9, 8, 24)}) {
    const PreparedHull hull = mesh;
    const double size = bounding_box(mesh).diagonal().norm();
    FloatingBody body = balanced(hull, 0.4, 0);
    body.centre_of_mass_mm.z() += water_at(body, kUp).metacentric_radius_mm() - 0.02 * size;
    const RightingCurve curve = weakest_righting_curve(body);
    ASSERT_EQ(curve.end, End::turns_over);
    const auto tilt_at_rest = [&](const Eigen::Vector3d& start) {
      const FloatingRest rest = floating_rest(hull, body.volume_mm3 * 1e-3, body.centre_of_mass_mm, start);
      return std::atan2(rest.up.cross(kUp).norm(), rest.up.z());
    };
    for (int k = 0; k < 20; ++k) {
      const double azimuth = random.uniform(0, 2 * kPi);
      const Eigen::Vector3d side(std::cos(azimuth), std::sin(azimuth), 0);
      EXPECT_LT(tilt_at_rest(up_at(random.uniform(0.5, 0.97) * curve.range_rad, kUp, side)), 1e-3) << azimuth;
    }
    EXPECT_GT(tilt_at_rest(up_at(curve.range_rad + kDegree, kUp, curve.lowered)), curve.range_rad);
  }
}

// A block of unit cells with a well in the middle of its top.
Mesh block(const Eigen::Vector3i& size, const Eigen::Vector3i& well) {
  const Eigen::Vector3i from((size.x() - well.x()) / 2, (size.y() - well.y()) / 2, size.z() - well.z());
  std::vector<Eigen::Vector3i> cells;
  for (int x = 0; x < size.x(); ++x)
    for (int y = 0; y < size.y(); ++y)
      for (int z = 0; z < size.z(); ++z) {
        const Eigen::Vector3i in = Eigen::Vector3i(x, y, z) - from;
        if (in.minCoeff() < 0 || (in - well).maxCoeff() >= 0) cells.emplace_back(x, y, z);
      }
  return test::moved(test::polycubes(cells), Eigen::Vector3d(-0.5 * size.x(), -0.5 * size.y(), 0));
}

// An open box displaces like a closed one until its rim is under, and then sinks if it is heavier than the water that its material
// displaces.
TEST(RightingArm, OfAnOpenBoxEndsWhereWaterComesIn) {
  const PreparedHull cup = block({6, 4, 3}, {4, 2, 2});  // 56 mm3 of material
  const PreparedHull lid = test::box({-3, -2, 0}, {3, 2, 3});
  const double volume = 60;
  const FloatingBody body{cup, volume, {0, 0, 0.8}, kUp};
  const RightingCurve curve = weakest_righting_curve(body);
  EXPECT_EQ(curve.end, End::takes_water);
  EXPECT_NEAR(curve.range_rad, flooding_heel(cup, volume, kUp, 8)->angle_rad, 3e-6);
  const RightingCurve closed = righting_curve({lid, volume, {0, 0, 0.8}, kUp}, curve.lowered);
  ASSERT_GT(closed.range_rad, curve.range_rad);
  for (std::size_t k = 0; k < curve.heel_rad.size(); ++k) {
    if (curve.heel_rad[k] < curve.range_rad)
      EXPECT_NEAR(curve.arm_mm[k], closed.arm_mm[k], 1e-12);
    else
      EXPECT_TRUE(std::isnan(curve.arm_mm[k]));
  }
  const FloatingBody covered{lid, volume, {0, 0, 0.8}, kUp};
  EXPECT_NEAR(curve.area_mm_rad, energy_at(covered, up_at(curve.range_rad, kUp, curve.lowered)) - energy_at(covered, kUp), 1e-5);
}

// A lighter one floats on with water in it.
TEST(RightingArm, StaysWetOnceItIsFlooded) {
  const PreparedHull cup = block({6, 4, 3}, {4, 2, 2});
  const double volume = 50;
  RightingOptions fine;
  fine.steps = 180;
  const RightingCurve curve = righting_curve({cup, volume, {0, 0, 0.8}, kUp}, kY, fine);
  ASSERT_EQ(curve.end, End::takes_water);
  for (std::size_t k = 0; k < curve.heel_rad.size(); ++k) {
    ASSERT_TRUE(std::isfinite(curve.arm_mm[k]));
    if (curve.heel_rad[k] < curve.range_rad + 2 * kDegree || curve.heel_rad[k] > kPi / 2) continue;
    // What its material displaces: the box less the well.
    const Eigen::Vector3d up = up_at(curve.heel_rad[k], kUp, kY);
    double lo = -10;
    double hi = 10;
    const auto below = [&](double offset) {
      const PreparedHull whole = test::box({-3, -2, 0}, {3, 2, 3});
      const PreparedHull well = test::box({-2, -1, 1}, {2, 1, 3});
      const Hydrostatics a = hydrostatics(whole, {up, offset});
      const Hydrostatics b = hydrostatics(well, {up, offset});
      const double v = a.displaced_volume_mm3 - b.displaced_volume_mm3;
      return std::pair(
          v, Eigen::Vector3d((a.displaced_volume_mm3 * a.centre_of_buoyancy_mm - b.displaced_volume_mm3 * b.centre_of_buoyancy_mm) /
                             v));
    };
    for (int n = 0; n < 60; ++n) (below((lo + hi) / 2).first < volume ? lo : hi) = (lo + hi) / 2;
    const Eigen::Vector3d down_side = std::cos(curve.heel_rad[k]) * kY + std::sin(curve.heel_rad[k]) * kUp;
    EXPECT_NEAR(curve.arm_mm[k], down_side.dot(below(lo).second - Eigen::Vector3d(0, 0, 0.8)), 1e-10) << curve.heel_rad[k];
  }
}

// A well above the water is no vessel. Water that falls into it when its rim goes under ends nothing, and is no work of the arms.
TEST(RightingArm, AreaLeavesOutWhatAFloodingCosts) {
  const PreparedHull tall = block({6, 4, 6}, {4, 2, 3});
  const double volume = 60;  // 2.5 deep
  RightingOptions fine;
  fine.steps = 1800;
  const RightingCurve curve = righting_curve({tall, volume, {0, 0, 1.2}, kUp}, kY, fine);
  ASSERT_EQ(curve.end, End::none);
  double integral = 0;
  double largest_step = 0;
  for (std::size_t k = 1; k < curve.heel_rad.size(); ++k) {
    integral += (curve.arm_mm[k - 1] + curve.arm_mm[k]) / 2 * (curve.heel_rad[k] - curve.heel_rad[k - 1]);
    largest_step = std::max(largest_step, std::abs(curve.arm_mm[k] - curve.arm_mm[k - 1]));
  }
  EXPECT_GT(largest_step, 0.05) << "nothing was flooded";
  EXPECT_NEAR(curve.area_mm_rad, integral, 1e-3);
}

TEST(RightingArm, FoldsAreNoVessels) {
  const FloatingBody smooth{test::box({-8, -8, 0}, {8, 8, 8}), 16 * 16 * 7.5, {0, 0, 2}, kUp};
  const RightingCurve expected = righting_curve(smooth, kY);
  for (const int depth : {1, 3}) {  // 1920 mm3 are displaced: a well of 1 is a fold, one of 3 is not
    const PreparedHull hull = block({16, 16, 8}, {1, 1, depth});
    const RightingCurve curve = righting_curve({hull, smooth.volume_mm3, smooth.centre_of_mass_mm, kUp}, kY);
    EXPECT_EQ(curve.end, depth == 1 ? expected.end : End::takes_water);
    if (depth > 1) continue;
    EXPECT_NEAR(curve.range_rad, expected.range_rad, 0.02);
    for (std::size_t k = 0; k < curve.arm_mm.size(); ++k) EXPECT_NEAR(curve.arm_mm[k], expected.arm_mm[k], 0.01);
  }
}

TEST(RightingArm, OfABodyThatDoesNotStandIsNone) {
  const Barge barge;
  const RightingCurve curve = weakest_righting_curve(barge.with_centre_at(25));  // 8 mm above the metacentre
  EXPECT_EQ(curve.end, End::turns_over);
  EXPECT_EQ(curve.range_rad, 0);
  EXPECT_EQ(curve.area_mm_rad, 0);
  EXPECT_EQ(curve.largest, 0u);
  EXPECT_LT(curve.arm_mm[1], 0);
}

// Stable, but over the edge within the first step: a narrow box whose deck goes under at once.
TEST(RightingArm, EndsWithinTheFirstStep) {
  const PreparedHull plank = test::box({-30, -10, 0}, {30, 10, 12});
  const double draught = 11.5;
  const double metacentre = draught / 2 + 400 / (12 * draught);
  const RightingCurve curve = weakest_righting_curve({plank, 60 * 20 * draught, {0, 0, metacentre - 0.005}, kUp});
  EXPECT_EQ(curve.end, End::turns_over);
  EXPECT_GT(curve.range_rad, kDegree);
  EXPECT_LT(curve.range_rad, 10 * kDegree);
  EXPECT_GT(curve.area_mm_rad, 0);
  EXPECT_EQ(curve.largest, 0u);
}

TEST(RightingArm, SinkingIsAnError) {
  const Barge barge;
  try {
    weakest_righting_curve({barge.hull, 60 * 40 * 30.1, {0, 0, 10}, kUp});
    ADD_FAILURE();
  } catch (const Error& e) {
    EXPECT_EQ(e.code(), ErrorCode::goal);
  }
}

TEST(RightingArm, DoesNotDependOnTheFrameOrOnThreads) {
  const Odd odd;
  const RightingCurve here = weakest_righting_curve(odd.body);
  const Eigen::Affine3d T = Eigen::Translation3d(300, -20, 70) * Eigen::Affine3d(test::random_rotation(5));
  const PreparedHull hull = transformed(odd.hull.mesh(), T);
  const RightingCurve there =
      weakest_righting_curve({hull, odd.body.volume_mm3, T * odd.body.centre_of_mass_mm, 3 * (T.linear() * odd.body.up)});
  EXPECT_TRUE(test::near(there.lowered, T.linear() * here.lowered, 1e-8));
  EXPECT_NEAR(there.range_rad, here.range_rad, 1e-5);
  EXPECT_NEAR(there.area_mm_rad, here.area_mm_rad, 1e-6);
  for (std::size_t k = 0; k < here.arm_mm.size(); ++k) EXPECT_NEAR(there.arm_mm[k], here.arm_mm[k], 1e-7);

  tbb::global_control one_thread(tbb::global_control::max_allowed_parallelism, 1);
  const RightingCurve alone = weakest_righting_curve(odd.body);
  EXPECT_EQ(alone.range_rad, here.range_rad);
  EXPECT_EQ(alone.arm_mm, here.arm_mm);
}

// Under water all is as for a sphere. Twin: a body far below the surface, its energy that of two points.
TEST(RightingArm, UnderWaterIsTheSineOfTheHeel) {
  const Odd odd;
  const Hydrostatics water = submerged_hydrostatics(odd.hull);
  EXPECT_NEAR(water.displaced_volume_mm3, mesh_moments(odd.hull.mesh())[M1], 1e-9);
  EXPECT_EQ(water.waterplane_area_mm2, 0);
  const double depth = 2.5;
  const Eigen::Vector3d up = odd.body.up;
  const Eigen::Vector3d centre = water.centre_of_buoyancy_mm - depth * up;
  const RightingCurve curve = submerged_righting_curve(depth);
  for (std::size_t k = 0; k < curve.heel_rad.size(); ++k) {
    const double heel = curve.heel_rad[k];
    const Eigen::Vector3d there = up_at(heel, up, odd.across());
    const Hydrostatics deep = hydrostatics(odd.hull, {there, there.dot(centre) + 1000});
    const Eigen::Vector3d down_side = std::cos(heel) * odd.across() + std::sin(heel) * up;
    EXPECT_NEAR(curve.arm_mm[k], down_side.dot(deep.centre_of_buoyancy_mm - centre), 1e-9);
  }
  EXPECT_EQ(curve.end, End::none);
  EXPECT_EQ(curve.range_rad, kPi);
  EXPECT_EQ(curve.area_mm_rad, 2 * depth);
  EXPECT_EQ(curve.arm_mm[curve.largest], depth);
  const RightingCurve head_down = submerged_righting_curve(-depth);
  EXPECT_EQ(head_down.end, End::turns_over);
  EXPECT_EQ(head_down.range_rad, 0);
  EXPECT_EQ(head_down.area_mm_rad, 0);
}

}  // namespace
}  // namespace rayrep
