#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <string>
#include <vector>

#include "rayrep/base/error.h"
#include "rayrep/physics/hydrostatics.h"
#include "rayrep/physics/moments.h"
#include "solids.h"

namespace rayrep {
namespace {

using test::kPi;
const Eigen::Vector3d kUp = Eigen::Vector3d::UnitZ();

double angle_between(const Eigen::Vector3d& a, const Eigen::Vector3d& b) { return std::atan2(a.cross(b).norm(), a.dot(b)); }

// `up` turned by `tilt` towards the horizontal direction `azimuth`.
Eigen::Vector3d tilted(const Eigen::Vector3d& up, double tilt, double azimuth) {
  const Eigen::Vector3d u = up.unitOrthogonal();
  const Eigen::Vector3d side = std::cos(azimuth) * u + std::sin(azimuth) * up.cross(u);
  return std::cos(tilt) * up + std::sin(tilt) * side;
}

Eigen::Vector3d centroid(const Mesh& mesh) {
  const Moments s = mesh_moments(mesh);
  return s.segment<3>(MX) / s[M1];
}

void expect_near(const Hydrostatics& actual, const Hydrostatics& expected, double relative, double length) {
  EXPECT_NEAR(actual.displaced_volume_mm3, expected.displaced_volume_mm3, relative * std::pow(length, 3));
  EXPECT_TRUE(test::near(actual.centre_of_buoyancy_mm, expected.centre_of_buoyancy_mm, relative * length));
  EXPECT_NEAR(actual.waterplane_area_mm2, expected.waterplane_area_mm2, relative * std::pow(length, 2));
  EXPECT_TRUE(test::near(actual.centre_of_flotation_mm, expected.centre_of_flotation_mm, relative * length));
  EXPECT_NEAR(actual.smallest_second_moment_mm4, expected.smallest_second_moment_mm4, relative * std::pow(length, 4));
  EXPECT_NEAR(actual.largest_second_moment_mm4, expected.largest_second_moment_mm4, relative * std::pow(length, 4));
}

// A body with concavities, a hole and a flat deck.
Mesh odd_hull() {
  return test::merged(
      {test::rotated(test::staircase(4), test::random_rotation(3)), test::moved(test::torus(2, 0.6, 24, 12), {6, 1, 0})});
}

TEST(Hydrostatics, Box) {
  const Hydrostatics water = hydrostatics(test::box({-1, -2, 1}, {3, 4, 6}), {kUp, 3.5});
  EXPECT_NEAR(water.displaced_volume_mm3, 4 * 6 * 2.5, 1e-12);
  EXPECT_TRUE(test::near(water.centre_of_buoyancy_mm, Eigen::Vector3d(1, 1, 2.25), 1e-13));
  EXPECT_NEAR(water.waterplane_area_mm2, 24, 1e-12);
  EXPECT_TRUE(test::near(water.centre_of_flotation_mm, Eigen::Vector3d(1, 1, 3.5), 1e-13));
  EXPECT_NEAR(water.smallest_second_moment_mm4, 6 * 4 * 4 * 4 / 12., 1e-12);
  EXPECT_NEAR(water.largest_second_moment_mm4, 4 * 6 * 6 * 6 / 12., 1e-12);
  EXPECT_NEAR(water.metacentric_radius_mm(), 32. / 60, 1e-13);
  EXPECT_TRUE(test::near(water.metacentre_mm({kUp, 3.5}), Eigen::Vector3d(1, 1, 2.25 + 32. / 60), 1e-13));
}

TEST(Hydrostatics, DryAndSunkBodies) {
  const Mesh mesh = odd_hull();
  const Hydrostatics dry = hydrostatics(mesh, {kUp, -100});
  EXPECT_EQ(dry.displaced_volume_mm3, 0);
  EXPECT_EQ(dry.waterplane_area_mm2, 0);
  EXPECT_EQ(dry.metacentric_radius_mm(), 0);
  const Hydrostatics sunk = hydrostatics(mesh, {kUp, 100});
  EXPECT_NEAR(sunk.displaced_volume_mm3, mesh_moments(mesh)[M1], 1e-11);
  EXPECT_TRUE(test::near(sunk.centre_of_buoyancy_mm, centroid(mesh), 1e-11));
  EXPECT_EQ(sunk.waterplane_area_mm2, 0);
  EXPECT_EQ(hydrostatics(Mesh(), {kUp, 0}).displaced_volume_mm3, 0);
}

TEST(Hydrostatics, ConeStandingOnItsTip) {
  const int n = 12;
  const double R = 3;
  const double H = 5;
  const Mesh cone = test::rotated(test::cone(R, H, n), Eigen::AngleAxisd(kPi, Eigen::Vector3d::UnitX()).toRotationMatrix());
  const double polygon = n / 2. * std::sin(2 * kPi / n);                              // area of the n-gon of radius 1
  const double second = polygon / 4 * (1 - 2. / 3 * std::pow(std::sin(kPi / n), 2));  // and its second moment
  for (const double depth : {0.1, 1., 2.5, 4.9}) {
    const double r = R * depth / H;
    const Hydrostatics water = hydrostatics(cone, {kUp, -H + depth});
    EXPECT_NEAR(water.displaced_volume_mm3, polygon * r * r * depth / 3, 1e-13);
    EXPECT_TRUE(test::near(water.centre_of_buoyancy_mm, Eigen::Vector3d(0, 0, -H + 0.75 * depth), 1e-12));
    EXPECT_NEAR(water.waterplane_area_mm2, polygon * r * r, 1e-13);
    EXPECT_NEAR(water.smallest_second_moment_mm4, second * std::pow(r, 4), 1e-12);
    EXPECT_NEAR(water.largest_second_moment_mm4, second * std::pow(r, 4), 1e-12);
  }
}

TEST(Hydrostatics, SphericalCapConverges) {
  const double R = 2;
  const double depth = 1.3;
  const double volume = kPi * depth * depth * (3 * R - depth) / 3;
  const double centre = -3 * std::pow(2 * R - depth, 2) / (4 * (3 * R - depth));  // of the cap, from the sphere's centre, below
  const double r2 = depth * (2 * R - depth);
  std::vector<double> errors[4];
  for (const int subdivisions : {2, 3, 4, 5}) {
    const Hydrostatics water = hydrostatics(test::icosphere(R, subdivisions), {kUp, -R + depth});
    errors[0].push_back(std::abs(water.displaced_volume_mm3 / volume - 1));
    errors[1].push_back((water.centre_of_buoyancy_mm - Eigen::Vector3d(0, 0, centre)).norm());
    errors[2].push_back(std::abs(water.waterplane_area_mm2 / (kPi * r2) - 1));
    errors[3].push_back(std::abs(water.smallest_second_moment_mm4 / (kPi * r2 * r2 / 4) - 1));
  }
  for (const auto& error : errors) {
    // Three halvings of the edges: a factor of 64 for second order.
    EXPECT_NEAR(std::log2(error.front() / error.back()) / 3, 2, 0.35);
    EXPECT_LT(error.back(), 3e-3);
  }
}

TEST(Hydrostatics, PlaneAcrossACornerOfACube) {
  const Mesh cube = test::box({0, 0, 0}, {1, 1, 1});
  const Eigen::Vector3d n = Eigen::Vector3d::Ones().normalized();
  for (const double a : {0.2, 0.7, 1.0}) {  // the tetrahedron (0,0,0), (a,0,0), (0,a,0), (0,0,a); at 1 through three corners
    const Hydrostatics water = hydrostatics(cube, {n, a / std::sqrt(3.)});
    EXPECT_NEAR(water.displaced_volume_mm3, a * a * a / 6, 1e-14);
    EXPECT_TRUE(test::near(water.centre_of_buoyancy_mm, Eigen::Vector3d::Constant(a / 4), 1e-13));
    EXPECT_NEAR(water.waterplane_area_mm2, std::sqrt(3.) / 2 * a * a, 1e-14);
    EXPECT_TRUE(test::near(water.centre_of_flotation_mm, Eigen::Vector3d::Constant(a / 3), 1e-13));
    const double side = a * std::sqrt(2.);
    EXPECT_NEAR(water.smallest_second_moment_mm4, std::sqrt(3.) / 96 * std::pow(side, 4), 1e-14);
  }
}

TEST(Hydrostatics, CornersEdgesAndFacesOnThePlane) {
  const Mesh cube = test::box({0, 0, 0}, {1, 1, 1});
  // A face in the plane belongs to the section just below it.
  const Hydrostatics full = hydrostatics(cube, {kUp, 1});
  EXPECT_EQ(full.displaced_volume_mm3, 1);
  EXPECT_EQ(full.waterplane_area_mm2, 1);
  EXPECT_EQ(full.smallest_second_moment_mm4, 1. / 12);
  EXPECT_EQ(hydrostatics(cube, {kUp, 0}).displaced_volume_mm3, 0);
  EXPECT_EQ(hydrostatics(cube, {kUp, 0}).waterplane_area_mm2, 0);
  // Through two opposite edges, and through one of the triangles' diagonals.
  const Hydrostatics half = hydrostatics(cube, {Eigen::Vector3d(1, 0, -1).normalized(), 0});
  EXPECT_NEAR(half.displaced_volume_mm3, 0.5, 1e-15);
  EXPECT_NEAR(half.waterplane_area_mm2, std::sqrt(2.), 1e-15);
  EXPECT_TRUE(test::near(half.centre_of_buoyancy_mm, Eigen::Vector3d(1. / 3, 0.5, 2. / 3), 1e-15));
  // Through four corners of an octahedron.
  Mesh octahedron;
  octahedron.vertices = {{1, 0, 0}, {0, 1, 0}, {-1, 0, 0}, {0, -1, 0}, {0, 0, 1}, {0, 0, -1}};
  for (int k = 0; k < 4; ++k) {
    octahedron.triangles.emplace_back(k, (k + 1) % 4, 4);
    octahedron.triangles.emplace_back((k + 1) % 4, k, 5);
  }
  const Hydrostatics equator = hydrostatics(octahedron, {kUp, 0});
  EXPECT_NEAR(equator.displaced_volume_mm3, 2. / 3, 1e-15);
  EXPECT_NEAR(equator.waterplane_area_mm2, 2, 1e-15);
  EXPECT_NEAR(equator.smallest_second_moment_mm4, 1. / 3, 1e-15);
  EXPECT_TRUE(test::near(equator.centre_of_buoyancy_mm, Eigen::Vector3d(0, 0, -0.25), 1e-15));
  // At every tread of a staircase: all of the steps below and of the columns above.
  const int steps = 5;
  const Mesh stairs = test::staircase(steps);
  double volume = 0;
  for (int k = 1; k <= steps; ++k) {
    volume += steps + 1 - k;
    const Hydrostatics water = hydrostatics(stairs, {kUp, static_cast<double>(k)});
    EXPECT_NEAR(water.displaced_volume_mm3, volume, 1e-13);
    EXPECT_NEAR(water.waterplane_area_mm2, steps + 1 - k, 1e-13);
  }
}

TEST(Hydrostatics, WetAndDrySideMakeTheWhole) {
  const Mesh mesh = odd_hull();
  const Moments s = mesh_moments(mesh);
  test::Random random(7);
  for (int i = 0; i < 50; ++i) {
    const Eigen::Vector3d n = random.direction();
    const double offset = n.dot(centroid(mesh)) + random.uniform(-1, 1);
    const Hydrostatics below = hydrostatics(mesh, {n, offset});
    const Hydrostatics above = hydrostatics(mesh, {-n, -offset});
    EXPECT_NEAR(below.displaced_volume_mm3 + above.displaced_volume_mm3, s[M1], 1e-12);
    EXPECT_TRUE(test::near(
        below.displaced_volume_mm3 * below.centre_of_buoyancy_mm + above.displaced_volume_mm3 * above.centre_of_buoyancy_mm,
        s.segment<3>(MX), 1e-11));
    EXPECT_NEAR(below.waterplane_area_mm2, above.waterplane_area_mm2, 1e-12);
    EXPECT_TRUE(test::near(below.centre_of_flotation_mm, above.centre_of_flotation_mm, 1e-11));
    if (below.waterplane_area_mm2 > 0) {
      EXPECT_NEAR(n.dot(below.centre_of_flotation_mm), offset, 1e-12);
    }
    EXPECT_NEAR(below.smallest_second_moment_mm4, above.smallest_second_moment_mm4, 1e-11);
  }
}

TEST(Hydrostatics, AddOverBodies) {
  const Mesh a = test::icosphere(2, 3);
  const Mesh b = test::moved(test::staircase(3), {5, -1, -1});
  test::Random random(8);
  for (int i = 0; i < 20; ++i) {
    const Waterplane plane{random.direction(), random.uniform(-0.5, 0.5)};
    const Hydrostatics one = hydrostatics(a, plane);
    const Hydrostatics two = hydrostatics(b, plane);
    const Hydrostatics both = hydrostatics(test::merged({a, b}), plane);
    EXPECT_NEAR(both.displaced_volume_mm3, one.displaced_volume_mm3 + two.displaced_volume_mm3, 1e-12);
    EXPECT_NEAR(both.waterplane_area_mm2, one.waterplane_area_mm2 + two.waterplane_area_mm2, 1e-12);
    EXPECT_TRUE(test::near(
        both.displaced_volume_mm3 * both.centre_of_buoyancy_mm,
        one.displaced_volume_mm3 * one.centre_of_buoyancy_mm + two.displaced_volume_mm3 * two.centre_of_buoyancy_mm, 1e-11));
    // Polar second moment by the parallel axis theorem.
    const double apart = (one.centre_of_flotation_mm - two.centre_of_flotation_mm).squaredNorm();
    const double product = one.waterplane_area_mm2 * two.waterplane_area_mm2 / both.waterplane_area_mm2;
    EXPECT_NEAR(both.smallest_second_moment_mm4 + both.largest_second_moment_mm4,
                one.smallest_second_moment_mm4 + one.largest_second_moment_mm4 + two.smallest_second_moment_mm4 +
                    two.largest_second_moment_mm4 + (two.waterplane_area_mm2 > 0 ? product * apart : 0),
                1e-10);
  }
}

TEST(Hydrostatics, DoNotDependOnTheFrame) {
  const Mesh mesh = odd_hull();
  const Waterplane plane{Eigen::Vector3d(0.2, -0.3, 1).normalized(), 0.4};
  const Hydrostatics here = hydrostatics(mesh, plane);
  for (int seed = 1; seed <= 20; ++seed) {
    const Eigen::Affine3d T = Eigen::Translation3d(3, -20, 7) * Eigen::Affine3d(test::random_rotation(seed));
    Waterplane moved;
    moved.normal = T.linear() * plane.normal;
    moved.offset_mm = plane.offset_mm + moved.normal.dot(T.translation());
    Hydrostatics expected = here;
    expected.centre_of_buoyancy_mm = T * here.centre_of_buoyancy_mm;
    expected.centre_of_flotation_mm = T * here.centre_of_flotation_mm;
    expect_near(hydrostatics(transformed(mesh, T), moved), expected, 1e-13, 8);
  }
}

TEST(Hydrostatics, WaterplaneAreaIsTheDerivativeOfTheVolume) {
  const Mesh mesh = odd_hull();
  const double h = 1e-4;
  test::Random random(11);
  for (int i = 0; i < 20; ++i) {
    const Waterplane plane{random.direction(), random.uniform(-0.5, 0.5)};
    const double difference = (hydrostatics(mesh, {plane.normal, plane.offset_mm + h}).displaced_volume_mm3 -
                               hydrostatics(mesh, {plane.normal, plane.offset_mm - h}).displaced_volume_mm3) /
                              (2 * h);
    EXPECT_NEAR(difference, hydrostatics(mesh, plane).waterplane_area_mm2, 1e-5);
  }
}

// A turn about a horizontal axis at constant volume carries the centre of buoyancy by the waterplane's second moments over the
// volume.
TEST(Hydrostatics, TiltingMovesTheCentreOfBuoyancyByTheMetacentricRadius) {
  const Mesh hull = test::uv_ellipsoid(3, 2, 1.5, 24);
  const double volume = 0.4 * mesh_moments(hull)[M1];
  const double h = 1e-4;
  const auto centre = [&](const Eigen::Vector3d& up) {
    return hydrostatics(hull, {up, waterline_for_volume(hull, up, volume)}).centre_of_buoyancy_mm;
  };
  const Hydrostatics water = hydrostatics(hull, {kUp, waterline_for_volume(hull, kUp, volume)});
  const Eigen::Vector3d x(h, 0, 1);
  const Eigen::Vector3d y(0, h, 1);
  // Up leans towards +x: the side at +x comes out of the water and the centre of buoyancy moves to -x.
  const Eigen::Vector3d along = (centre(x.normalized()) - centre(Eigen::Vector3d(-h, 0, 1).normalized())) / (2 * h);
  const Eigen::Vector3d across = (centre(y.normalized()) - centre(Eigen::Vector3d(0, -h, 1).normalized())) / (2 * h);
  EXPECT_TRUE(test::near(along, -water.largest_second_moment_mm4 / volume * Eigen::Vector3d::UnitX(), 1e-6));
  EXPECT_TRUE(test::near(across, -water.smallest_second_moment_mm4 / volume * Eigen::Vector3d::UnitY(), 1e-6));
}

TEST(Hydrostatics, FarFromTheOrigin) {
  const Mesh mesh = odd_hull();
  const Eigen::Vector3d t(1e5, -2e5, 3e5);
  const Waterplane plane{Eigen::Vector3d(0.2, -0.3, 1).normalized(), 0.4};
  Hydrostatics expected = hydrostatics(mesh, plane);
  expected.centre_of_buoyancy_mm += t;
  expected.centre_of_flotation_mm += t;
  expect_near(hydrostatics(test::moved(mesh, t), {plane.normal, plane.offset_mm + plane.normal.dot(t)}), expected, 1e-10, 8);
}

TEST(WaterlineForVolume, IsTheInverseOfTheVolume) {
  const Mesh gap = test::merged({test::box({0, 0, 0}, {1, 1, 1}), test::box({0, 0, 5}, {1, 1, 6})});
  test::Random random(21);
  for (const Mesh& mesh : {odd_hull(), gap, test::icosphere(2, 2), test::staircase(6), test::unit_tetrahedron(), test::l_shape()}) {
    const double total = mesh_moments(mesh)[M1];
    for (int i = 0; i < 40; ++i) {
      const Eigen::Vector3d n = i < 6 ? Eigen::Vector3d(Eigen::Vector3d::Unit(i % 3) * (i < 3 ? 1 : -1)) : random.direction();
      for (const double fraction : {1e-12, 1e-6, 1e-3, 0.25, 1. / 3, 0.5, random.uniform(), 0.99, 1 - 1e-9}) {
        const double offset = waterline_for_volume(mesh, n, fraction * total);
        EXPECT_NEAR(hydrostatics(mesh, {n, offset}).displaced_volume_mm3, fraction * total, 2e-14 * total);
      }
    }
  }
}

TEST(WaterlineForVolume, BothEnds) {
  const Mesh mesh = test::box({0, 0, 2}, {1, 1, 5});
  EXPECT_EQ(waterline_for_volume(mesh, kUp, 0), 2);
  EXPECT_EQ(waterline_for_volume(mesh, kUp, 3), 5);
  EXPECT_NEAR(waterline_for_volume(mesh, kUp, 1), 3, 1e-14);
  EXPECT_NEAR(waterline_for_volume(mesh, -kUp, 1), -4, 1e-14);
}

TEST(WaterlineForVolume, AllOfTheVolumeIsNotTooMuchByRounding) {
  for (const Mesh& mesh : {odd_hull(), test::icosphere(2, 4), test::torus(3, 1, 50, 40), test::uv_ellipsoid(3, 5, 7, 30)})
    for (int seed = 1; seed <= 10; ++seed) {
      const Mesh turned = test::rotated(mesh, test::random_rotation(seed));
      double highest = -1e9;
      for (const auto& v : turned.vertices) highest = std::max(highest, v.z());
      EXPECT_NEAR(waterline_for_volume(turned, kUp, mesh_moments(turned)[M1]), highest, 1e-3);
    }
}

TEST(WaterlineForVolume, RefusesMoreThanTheHullHolds) {
  const Mesh mesh = test::box({0, 0, 0}, {10, 10, 30});
  for (const double volume : {3000.1, -1., std::numeric_limits<double>::quiet_NaN()}) {
    try {
      waterline_for_volume(mesh, kUp, volume);
      ADD_FAILURE() << "no error for " << volume;
    } catch (const Error& e) {
      EXPECT_EQ(e.code(), ErrorCode::goal);
      EXPECT_NE(std::string(e.what()).find("3 cm3"), std::string::npos) << e.what();
    }
  }
}

TEST(OuterHull, LeavesSealedCavitiesOut) {
  const Mesh outer = test::icosphere(10, 3);
  const Mesh hollow = test::hollow(outer, test::icosphere(8, 3));
  for (const Mesh& mesh : {hollow, test::soup(hollow)}) {
    const Mesh hull = outer_hull(mesh);
    EXPECT_EQ(hull.triangles.size(), outer.triangles.size());
    // Archimedes: the cavity displaces.
    expect_near(hydrostatics(hull, {kUp, 1.5}), hydrostatics(outer, {kUp, 1.5}), 1e-13, 10);
    // Left in it is a pocket without a rim.
    const Hydrostatics with_cavity = hydrostatics(mesh, {kUp, 1.5});
    expect_near(with_cavity, hydrostatics(outer, {kUp, 1.5}), 1e-13, 10);
    EXPECT_GT(with_cavity.dry_interior_mm3, 0.3 * with_cavity.displaced_volume_mm3);
    EXPECT_FALSE(with_cavity.freeboard_mm);
  }
}

TEST(OuterHull, LeavesOutWhatFloatsInsideACavity) {
  const Mesh outer = test::box({0, 0, 0}, {10, 10, 10});
  const Mesh mesh = test::merged(
      {test::hollow(test::box({3, 3, 3}, {6, 6, 6}), test::box({4, 4, 4}, {5, 5, 5})),  // a hollow island
       test::flipped(test::box({1, 1, 1}, {8, 8, 8})), outer, test::flipped(test::box({8.5, 8.5, 8.5}, {9.5, 9.5, 9.5}))});
  const Mesh hull = outer_hull(mesh);
  EXPECT_EQ(hull.triangles.size(), outer.triangles.size());
  EXPECT_NEAR(mesh_moments(hull)[M1], 1000, 1e-10);
}

TEST(OuterHull, KeepsWhatTheFluidTouches) {
  const Mesh cube = test::box({0, 0, 0}, {2, 2, 2});
  const Mesh overlapping = test::merged({cube, test::box({1, 1, 1}, {3, 3, 3}), test::box({5, 5, 5}, {6, 6, 6})});
  EXPECT_EQ(outer_hull(overlapping).triangles.size(), overlapping.triangles.size());
  // A torus around a ball: the ball is inside its box, not inside it. And an inside-out body beside the others is no cavity.
  const Mesh beside =
      test::merged({test::torus(5, 1, 24, 12), test::icosphere(2, 1), test::flipped(test::box({9, 0, 0}, {10, 1, 1}))});
  EXPECT_EQ(outer_hull(beside).triangles.size(), beside.triangles.size());
  Mesh open = test::hollow(test::icosphere(10, 1), test::icosphere(8, 1));
  open.triangles.pop_back();  // an open surface bounds nothing
  EXPECT_EQ(outer_hull(open).triangles.size(), open.triangles.size());
}

TEST(OuterHull, KeepsAMastThatStandsInACavity) {
  const Mesh hollow = test::hollow(test::box({0, 0, 0}, {10, 10, 10}), test::box({1, 1, 1}, {9, 9, 9}));
  const Mesh mast = test::box({4, 4, 2}, {5, 5, 30});
  EXPECT_EQ(outer_hull(test::merged({hollow, mast})).triangles.size(), 24u);
}

// A cube of relative density r has GM = 1/(12 r) - (1 - r)/2 times its side: positive iff 6 r^2 - 6 r + 1 > 0.
TEST(FloatingRest, CubeFloatsUprightByItsDensity) {
  const Mesh cube = test::box({-5, -5, 0}, {5, 5, 10});
  for (const double r : {0.05, 0.1, 0.15, 0.2, 0.22, 0.3, 0.5, 0.7, 0.78, 0.8, 0.85, 0.95}) {
    const bool stable = 6 * r * r - 6 * r + 1 > 0;
    const Eigen::Vector3d centre(0, 0, 5);
    const Waterplane plane{kUp, waterline_for_volume(cube, kUp, 1000 * r)};
    const double height = (hydrostatics(cube, plane).metacentre_mm(plane) - centre).z();
    EXPECT_NEAR(height, 10 * (1 / (12 * r) - (1 - r) / 2), 1e-12) << r;
    EXPECT_EQ(height > 0, stable) << r;
    for (int k = 0; k < 8; ++k) {
      const FloatingRest rest = floating_rest(cube, r, centre, tilted(kUp, 0.01, 0.3 + k * kPi / 4));
      EXPECT_TRUE(rest.rests()) << r;
      const double tilt = angle_between(rest.up, kUp);
      if (stable) {
        EXPECT_LT(tilt, 1e-6) << r;
      } else {
        EXPECT_GT(tilt, 0.1) << r;
      }
    }
  }
}

TEST(FloatingRest, LeavesAnUnstableEquilibriumEvenWithoutAPush) {
  const Mesh cube = test::box({-5, -5, -5}, {5, 5, 5});
  const FloatingRest rest = floating_rest(cube, 0.5, Eigen::Vector3d::Zero(), kUp);
  EXPECT_TRUE(rest.rests());
  EXPECT_GT(angle_between(rest.up, kUp), 0.3);
  EXPECT_LT(rest.residual_mm, 1e-4);
}

TEST(FloatingRest, SphereIsNeutral) {
  test::Random random(31);
  for (const Mesh& ball : {test::icosphere(20, 4, {1, 2, 3}), test::uv_ellipsoid(20, 20, 20, 128, {1, 2, 3})})
    for (int i = 0; i < 10; ++i) {
      const Eigen::Vector3d up = random.direction();
      const FloatingRest rest = floating_rest(ball, 0.4e-3 * mesh_moments(ball)[M1], {1, 2, 3}, up);
      EXPECT_TRUE(rest.rests());
      EXPECT_LT(angle_between(rest.up, up), 1e-4);
      EXPECT_LT(rest.residual_mm, 1e-2);
    }
}

TEST(FloatingRest, WeightedSphereReturnsFromAnyAttitude) {
  const Mesh ball = test::icosphere(20, 3, {1, 2, 3});
  const Eigen::Vector3d weight(0.3, -0.5, 1.2);
  test::Random random(32);
  for (int i = 0; i < 20; ++i) {
    const FloatingRest rest =
        floating_rest(ball, 0.4e-3 * mesh_moments(ball)[M1], Eigen::Vector3d(1, 2, 3) + weight, random.direction());
    EXPECT_TRUE(rest.rests());
    EXPECT_LT(angle_between(rest.up, -weight), 3e-3);  // of a sphere; the facets are worth the rest
    EXPECT_LT(rest.residual_mm, 1e-6);
  }
}

TEST(FloatingRest, LogKeepsItsRollAndLiesDown) {
  const Mesh log = test::cylinder(1, 8, 128);
  for (const double roll : {0.123, 1.0, 2.5}) {
    const Eigen::Vector3d across(std::cos(roll), std::sin(roll), 0);
    const FloatingRest rest = floating_rest(log, 0.3e-3 * mesh_moments(log)[M1], {0, 0, 4}, tilted(across, 0.3, 0));
    EXPECT_TRUE(rest.rests());
    EXPECT_NEAR(rest.up.z(), 0, 1e-6);
    EXPECT_LT(rest.residual_mm, 1e-4);
  }
}

TEST(FloatingRest, PlateComesToLieOnItsNearerSide) {
  const Mesh plate = test::box({-20, -15, -5}, {20, 15, 5});
  for (const double density : {0.3, 0.5, 0.8})
    for (const double tilt : {0.1, 0.5, 0.9, kPi - 0.9, kPi - 0.2})
      for (int k = 0; k < 5; ++k) {
        const FloatingRest rest = floating_rest(plate, 12 * density, Eigen::Vector3d::Zero(), tilted(kUp, tilt, 0.1 + k));
        EXPECT_TRUE(rest.rests());
        EXPECT_LT(angle_between(rest.up, tilt < kPi / 2 ? kUp : Eigen::Vector3d(-kUp)), 1e-6) << density << " " << tilt << " " << k;
        EXPECT_NEAR(rest.plane.offset_mm, 10 * density - 5, 1e-6);
      }
}

// Laws of any rest: it displaces its mass, the centres lie above one another, the energy has fallen, and a small push changes
// nothing.
TEST(FloatingRest, IsAMinimumOfThePotentialEnergy) {
  test::Random random(33);
  for (const Mesh& hull :
       {test::staircase(4, 5), test::l_shape(10), test::uv_ellipsoid(9, 6, 4, 16), odd_hull(), test::torus(9, 4, 30, 20)}) {
    const double total = mesh_moments(hull)[M1];
    const double size = bounding_box(hull).diagonal().norm();
    for (int i = 0; i < 10; ++i) {
      const double volume = random.uniform(0.1, 0.9) * total;
      const double mass = volume * 1.1e-3;
      FloatingRestOptions options;
      options.fluid_g_cm3 = 1.1;
      const Eigen::Vector3d centre = centroid(hull) + random.in_box(0.05 * size);
      const Eigen::Vector3d start = random.direction();
      const auto energy = [&](const Eigen::Vector3d& up) {
        return up.dot(centre - hydrostatics(hull, {up, waterline_for_volume(hull, up, volume)}).centre_of_buoyancy_mm);
      };
      const FloatingRest rest = floating_rest(hull, mass, centre, start, options);
      ASSERT_TRUE(rest.rests());
      const Hydrostatics water = hydrostatics(hull, rest.plane);
      EXPECT_NEAR(water.displaced_volume_mm3, volume, 1e-12 * total);
      const Eigen::Vector3d arm = centre - water.centre_of_buoyancy_mm;
      EXPECT_NEAR((arm - rest.up.dot(arm) * rest.up).norm(), rest.residual_mm, 1e-10 * size);
      EXPECT_LT(rest.residual_mm, 2e-5 * size);
      EXPECT_EQ(rest.plane.normal, rest.up);
      EXPECT_LE(energy(rest.up), energy(start));
      for (int k = 0; k < 6; ++k) EXPECT_GE(energy(tilted(rest.up, 1e-2, k)), energy(rest.up) - 2e-7 * size);
      const FloatingRest again = floating_rest(hull, mass, centre, tilted(rest.up, 1e-3, i), options);
      EXPECT_LT(angle_between(again.up, rest.up), 2e-3);
    }
  }
}

// Where little of the body is wet, or little of it dry, its energy bends sharply as corners meet the water.
TEST(FloatingRest, SettlesVeryLightAndNearlySunkBodies) {
  test::Random random(35);
  for (const Mesh& hull :
       {test::staircase(5, 4), test::box({0, 0, 0}, {40, 2, 3}), test::box({0, 0, 0}, {30, 30, 2}), test::cone(5, 20, 12),
        test::merged({test::box({0, 0, 0}, {5, 5, 5}), test::box({20, 0, 3}, {25, 5, 8})})}) {
    const double total = mesh_moments(hull)[M1];
    const double size = bounding_box(hull).diagonal().norm();
    for (int i = 0; i < 60; ++i) {
      const double little = random.uniform(0.001, 0.02);
      const double volume = (i % 2 ? 1 - little : little) * total;
      const Eigen::Vector3d centre = centroid(hull) + random.in_box((i % 3 ? 0.2 : 0.01) * size);
      const Eigen::Vector3d start = i % 5 ? random.direction() : Eigen::Vector3d(Eigen::Vector3d::Unit(i % 3));
      const auto energy = [&](const Eigen::Vector3d& up) {
        return up.dot(centre - hydrostatics(hull, {up, waterline_for_volume(hull, up, volume)}).centre_of_buoyancy_mm);
      };
      const FloatingRest rest = floating_rest(hull, volume * 1e-3, centre, start);
      EXPECT_TRUE(rest.rests()) << volume / total;
      EXPECT_LT(rest.residual_mm, 1e-5 * size);
      EXPECT_LE(energy(rest.up), energy(start) + 1e-12 * size);
    }
  }
}

// The same rest as by plain small turns along the righting moment.
TEST(FloatingRest, AgreesWithFollowingTheMomentInSmallSteps) {
  const Mesh hull = test::staircase(3, 5);
  const Eigen::Vector3d centre = centroid(hull) + Eigen::Vector3d(0.5, 0.3, -1);
  const double volume = 0.45 * mesh_moments(hull)[M1];
  test::Random random(34);
  for (int i = 0; i < 12; ++i) {
    const Eigen::Vector3d start = random.direction();
    Eigen::Vector3d up = start;
    for (int turn = 0; turn < 6000; ++turn) {
      const Eigen::Vector3d arm = centre - hydrostatics(hull, {up, waterline_for_volume(hull, up, volume)}).centre_of_buoyancy_mm;
      const Eigen::Vector3d moment = arm - up.dot(arm) * up;
      up = (up - 0.02 * moment).normalized();
      if (moment.norm() < 1e-9) break;
    }
    const FloatingRest rest = floating_rest(hull, volume * 1e-3, centre, start);
    EXPECT_TRUE(rest.rests());
    EXPECT_LT(angle_between(rest.up, up), 1e-4) << "start " << start.transpose();
  }
}

TEST(FloatingRest, TurnsWithTheBody) {
  const Mesh hull = test::l_shape(10);
  const Eigen::Vector3d centre = centroid(hull) + Eigen::Vector3d(1, 0.5, -1);
  const Eigen::Vector3d start = Eigen::Vector3d(0.3, -0.1, 1).normalized();
  const FloatingRest here = floating_rest(hull, 1.2, centre, start);
  for (int seed = 1; seed <= 5; ++seed) {
    const Eigen::Affine3d T = Eigen::Translation3d(30, -20, 7) * Eigen::Affine3d(test::random_rotation(seed));
    const FloatingRest there = floating_rest(transformed(hull, T), 1.2, T * centre, T.linear() * start);
    EXPECT_TRUE(there.rests());
    EXPECT_TRUE(test::near(there.up, T.linear() * here.up, 1e-6));
  }
}

TEST(FloatingRest, HeavierThanWhatItDisplacesSinks) {
  const Mesh cube = test::box({0, 0, 0}, {10, 10, 10});
  const FloatingRest rest = floating_rest(cube, 1.0001, {5, 5, 5}, kUp);
  EXPECT_TRUE(rest.sinks());
  EXPECT_FALSE(rest.rests());
  EXPECT_FALSE(floating_rest(cube, 0.9999, {5, 5, 5}, kUp).sinks());
  FloatingRestOptions brine;
  brine.fluid_g_cm3 = 1.2;
  EXPECT_FALSE(floating_rest(cube, 1.0001, {5, 5, 5}, kUp, brine).sinks());
}

TEST(FloatingRest, RefusesWhatCannotBeFloated) {
  const Mesh cube = test::box({0, 0, 0}, {10, 10, 10});
  const auto refused = [](const Mesh& hull, double mass, const Eigen::Vector3d& centre) {
    try {
      floating_rest(hull, mass, centre, kUp);
    } catch (const Error& e) {
      return e.code() == ErrorCode::input;
    }
    return false;
  };
  EXPECT_TRUE(refused(cube, 0, {5, 5, 5}));
  EXPECT_TRUE(refused(cube, std::numeric_limits<double>::quiet_NaN(), {5, 5, 5}));
  EXPECT_TRUE(refused(test::flipped(cube), 0.5, {5, 5, 5}));
  EXPECT_TRUE(refused(Mesh(), 0.5, {5, 5, 5}));
  EXPECT_TRUE(refused(cube, 0.5, {std::numeric_limits<double>::infinity(), 5, 5}));
  EXPECT_FALSE(refused(cube, 0.5, {5, 5, 5}));
}

}  // namespace
}  // namespace rayrep
