#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <filesystem>
#include <limits>
#include <numeric>
#include <vector>

#include "mesh/float32.h"
#include "places.h"
#include "rayrep/base/error.h"
#include "rayrep/io/mesh_io.h"
#include "rayrep/physics/moments.h"
#include "rayrep/physics/support_polygon.h"
#include "solids.h"

namespace rayrep {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;
using test::kPi;

constexpr double kTolerance = 0.01;

Mesh turned(const Mesh& mesh, double angle, const Vector3d& axis) {
  return test::rotated(mesh, Eigen::AngleAxisd(angle, axis.normalized()).toRotationMatrix());
}

Vector3d centre_of_mass(const Mesh& mesh) { return mass_properties(mesh_moments(mesh), 1).centre_of_mass_mm; }

double smallest(const std::vector<double>& values) { return *std::min_element(values.begin(), values.end()); }

// A wedge with its edge down, along y: half-angle of 45 degrees.
Mesh prism_on_edge() { return turned(test::box({0, -15, 0}, {10, 15, 10}), kPi / 4, -Vector3d::UnitY()); }

// A plate on three legs that narrow to nothing at the ground, at 120 degrees, 20 mm from the middle.
Mesh three_legged_table(double taper) {
  Mesh table = test::moved(test::cylinder(30, 4, 90), {0, 0, 40});
  for (int k = 0; k < 3; ++k) {
    const double angle = 2 * kPi * k / 3;
    append(table, test::moved(test::frustum(taper, 3, 40.5, 12), {20 * std::cos(angle), 20 * std::sin(angle), 0}));
  }
  return table;
}

/// The corners of a body whose lowest `tolerance_mm` have given way, as by sanding.
std::vector<Vector3d> sanded(const Mesh& mesh, double tolerance_mm) {
  double ground = std::numeric_limits<double>::infinity();
  for (const Vector3d& v : mesh.vertices) ground = std::min(ground, v.z());
  ground += tolerance_mm;
  std::vector<Vector3d> corners;
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t)
    for (int k = 0; k < 3; ++k) {
      const Vector3d& a = mesh.corner(t, k);
      const Vector3d& b = mesh.corner(t, (k + 1) % 3);
      if (a.z() >= ground) corners.push_back(a);
      if ((a.z() - ground) * (b.z() - ground) < 0)
        corners.push_back((a * (b.z() - ground) + b * (ground - a.z())) / (b.z() - a.z()));
    }
  return corners;
}

/// Whether a body on a plane that is tilted by `tilt` falls towards `downhill`: turns it further by a little about its lowest
/// corner, which stays where it is, and looks whether its centre of mass gets lower. Knows nothing of polygons.
bool tips(const std::vector<Vector3d>& corners, const Vector3d& centre, const Vector2d& downhill, double tilt) {
  constexpr double nudge = 1e-4;
  const Vector3d down(downhill.x(), downhill.y(), 0);
  const Vector3d up = std::cos(tilt) * Vector3d::UnitZ() - std::sin(tilt) * down;  // the world's, seen from the plane
  const Eigen::Matrix3d R = Eigen::AngleAxisd(nudge, Vector3d::UnitZ().cross(down)).toRotationMatrix();
  const Vector3d normal = R.transpose() * Vector3d::UnitZ();
  const auto pivot = std::min_element(corners.begin(), corners.end(),
                                      [&](const Vector3d& a, const Vector3d& b) { return normal.dot(a) < normal.dot(b); });
  const Vector3d arm = centre - *pivot;
  return up.dot(R * arm) < up.dot(arm);
}

double simulated_tipping_angle(const std::vector<Vector3d>& corners, const Vector3d& centre, const Vector2d& downhill) {
  double stays = -kPi / 2;
  double falls = kPi / 2;
  for (int i = 0; i < 40; ++i) {
    const double tilt = (stays + falls) / 2;
    (tips(corners, centre, downhill, tilt) ? falls : stays) = tilt;
  }
  return (stays + falls) / 2;
}

void expect_tilting_plane_agrees(const Mesh& mesh, double tolerance_mm) {
  const SupportPolygon polygon = support_polygon(mesh, tolerance_mm);
  ASSERT_GE(polygon.corners_mm.size(), 3u);
  const Vector3d centre = centre_of_mass(mesh);
  const std::vector<Vector3d> corners = sanded(mesh, tolerance_mm);
  const std::vector<double> angles = tipping_angles_rad(polygon, centre);
  // Sanded, the body is lower by up to the tolerance.
  const double allowed = 0.1 * kPi / 180 + tolerance_mm / (centre.z() - polygon.ground_mm);
  for (std::size_t k = 0; k < angles.size(); ++k) {
    const Vector2d along = (polygon.corners_mm[(k + 1) % angles.size()] - polygon.corners_mm[k]).normalized();
    EXPECT_NEAR(simulated_tipping_angle(corners, centre, {along.y(), -along.x()}), angles[k], allowed) << "edge " << k;
  }
  // Tilted any other way it holds at least as long as over its worst edge.
  for (int k = 0; k < 36; ++k) {
    const Vector2d downhill(std::cos(2 * kPi * k / 36), std::sin(2 * kPi * k / 36));
    EXPECT_GE(simulated_tipping_angle(corners, centre, downhill), smallest(angles) - allowed) << "direction " << k;
  }
}

TEST(SupportPolygon, OfABoxIsItsBase) {
  for (const double tolerance : {0., kTolerance}) {
    const SupportPolygon polygon = support_polygon(test::subdivided(test::box({-30, -20, 5}, {30, 20, 35}), 3), tolerance);
    ASSERT_EQ(polygon.corners_mm.size(), 4u);
    const Vector2d expected[] = {{-30, -20}, {30, -20}, {30, 20}, {-30, 20}};
    for (int k = 0; k < 4; ++k) EXPECT_TRUE(test::near(polygon.corners_mm[k], expected[k], 1e-12)) << k;
    EXPECT_EQ(polygon.ground_mm, 5);
    EXPECT_NEAR(polygon.area_mm2, 2400, 1e-9);
    EXPECT_TRUE(test::near(polygon.safest_point_mm(), Vector2d(0, 0), 1e-8));
    const std::vector<double> distances = polygon.edge_distances_mm({10, 3});
    EXPECT_TRUE(test::near(Eigen::Vector4d(distances.data()), Eigen::Vector4d(23, 20, 17, 40), 1e-12));
    const std::vector<double> angles = tipping_angles_rad(polygon, {0, 0, 20});
    const double over_long = std::atan(20. / 15);
    const double over_short = std::atan(30. / 15);
    EXPECT_TRUE(test::near(Eigen::Vector4d(angles.data()), Eigen::Vector4d(over_long, over_short, over_long, over_short), 1e-12));
  }
}

TEST(SupportPolygon, BeginsWithTheLowestOfTheLeftmostCorners) {
  for (const double x : {-30., -7., 7., 30.})
    for (const double y : {-30., -7., 7., 30.}) {
      const SupportPolygon polygon = support_polygon(test::box({x, y, 0}, {x + 10, y + 20, 5}), kTolerance);
      ASSERT_EQ(polygon.corners_mm.size(), 4u);
      EXPECT_TRUE(test::near(polygon.corners_mm[0], Vector2d(x, y), 1e-12));
      EXPECT_TRUE(test::near(polygon.corners_mm[1], Vector2d(x + 10, y), 1e-12));
    }
}

TEST(SupportPolygon, TurnsAndMovesWithTheBody) {
  const Mesh bodies[] = {test::subdivided(test::box({-30, -20, 0}, {30, 20, 30}), 3), test::l_shape(10), three_legged_table(1),
                         test::frustum(20, 10, 30, 37)};
  for (const Mesh& body : bodies) {
    const SupportPolygon here = support_polygon(body, kTolerance);
    std::vector<double> angles = tipping_angles_rad(here, centre_of_mass(body));
    std::sort(angles.begin(), angles.end());
    for (const double angle : {0.1, 1., 2.5, 4.}) {
      const Eigen::Affine3d T = Eigen::Translation3d(3, -200, 50) * Eigen::AngleAxisd(angle, Vector3d::UnitZ());
      const Mesh moved = transformed(body, T);
      const SupportPolygon there = support_polygon(moved, kTolerance);
      ASSERT_EQ(there.corners_mm.size(), here.corners_mm.size());
      for (const Vector2d& corner : here.corners_mm) {
        const Vector2d expected = (T * Vector3d(corner.x(), corner.y(), 0)).head<2>();
        double nearest = std::numeric_limits<double>::infinity();
        for (const Vector2d& c : there.corners_mm) nearest = std::min(nearest, (c - expected).norm());
        EXPECT_LT(nearest, 1e-9);
      }
      EXPECT_NEAR(there.area_mm2, here.area_mm2, 1e-8);
      const Vector2d safest = here.safest_point_mm();
      EXPECT_TRUE(test::near(there.safest_point_mm(), (T * Vector3d(safest.x(), safest.y(), 0)).head<2>().eval(), 1e-7));
      std::vector<double> turned_angles = tipping_angles_rad(there, centre_of_mass(moved));
      std::sort(turned_angles.begin(), turned_angles.end());
      for (std::size_t k = 0; k < angles.size(); ++k) EXPECT_NEAR(turned_angles[k], angles[k], 1e-9);
    }
  }
}

TEST(SupportPolygon, ATipIsAPoint) {
  // Half-angles of 27, 76 and 88 degrees.
  for (const double radius : {10., 80., 600.}) {
    const Mesh cone = test::moved(turned(test::cone(radius, 20, 48), kPi, Vector3d::UnitX()), {3, 4, 20});
    const SupportPolygon polygon = support_polygon(cone, kTolerance);
    ASSERT_EQ(polygon.corners_mm.size(), 1u) << radius;
    EXPECT_TRUE(test::near(polygon.corners_mm[0], Vector2d(3, 4), 1e-10));
    EXPECT_EQ(polygon.area_mm2, 0);
    EXPECT_EQ(polygon.safest_point_mm(), polygon.corners_mm[0]);
    EXPECT_NEAR(polygon.edge_distances_mm({6, 8}).at(0), -5, 1e-10);
    EXPECT_LE(tipping_angles_rad(polygon, {3, 4, 20}).at(0), 0);
  }
}

TEST(SupportPolygon, AWedgeIsAnEdge) {
  for (const double angle : {0., 0.7}) {
    const Mesh prism = turned(prism_on_edge(), angle, Vector3d::UnitZ());
    const SupportPolygon polygon = support_polygon(prism, kTolerance);
    ASSERT_EQ(polygon.corners_mm.size(), 2u);
    const Vector2d along(-std::sin(angle), std::cos(angle));
    for (const double side : {-15., 15.}) {
      const Vector2d& a = polygon.corners_mm[0];
      const Vector2d& b = polygon.corners_mm[1];
      EXPECT_LT(std::min((a - side * along).norm(), (b - side * along).norm()), 1e-9);
    }
    EXPECT_EQ(polygon.area_mm2, 0);
    EXPECT_TRUE(test::near(polygon.safest_point_mm(), Vector2d(0, 0), 1e-9));
    const std::vector<double> angles = tipping_angles_rad(polygon, centre_of_mass(prism));
    ASSERT_EQ(angles.size(), 2u);
    EXPECT_NEAR(angles[0], -angles[1], 1e-12);
    EXPECT_LT(smallest(angles), 1e-12);
  }
}

// A smooth bottom touches in a point, whatever its size; cut flat, be it by little, it stands.
TEST(SupportPolygon, RoundedBottomsAreAPointAndFlatOnesAreNot) {
  for (const double radius : {10., 40., 400.}) {
    const double tolerance = contact_tolerance_mm(2 * radius);
    EXPECT_EQ(support_polygon(test::uv_ellipsoid(radius, radius, radius, 200), tolerance).corners_mm.size(), 1u) << radius;
    EXPECT_EQ(support_polygon(test::uv_ellipsoid(1.2 * radius, radius, radius, 200), tolerance).corners_mm.size(), 1u) << radius;
  }
  // On three rounded toes it stands: no toe is wide, but all together are.
  Mesh toes = test::moved(test::cylinder(30, 4, 60), {0, 0, 10});
  for (const auto& [x, y] : {std::pair{20., 0.}, {-10., 17.}, {-10., -17.}})
    append(toes, test::uv_ellipsoid(4, 4, 6, 40, {x, y, 6 + 1e-3 * x * kTolerance}));
  const SupportPolygon polygon = support_polygon(toes, kTolerance);
  EXPECT_GE(polygon.corners_mm.size(), 3u);
  EXPECT_NEAR(polygon.area_mm2, 510, 30);
  // A plate on its narrow side, a pin.
  EXPECT_EQ(support_polygon(test::box({0, 0, 0}, {0.2, 30, 30}), kTolerance).corners_mm.size(), 4u);
  EXPECT_EQ(support_polygon(test::box({0, 0, 0}, {0.2, 0.2, 30}), kTolerance).corners_mm.size(), 4u);
}

TEST(SupportPolygon, ThreeLegsMakeATriangle) {
  const Mesh table = three_legged_table(0.001);
  const SupportPolygon polygon = support_polygon(table, kTolerance);
  const double radius = 20;
  EXPECT_NEAR(polygon.area_mm2, 3 * std::sqrt(3.) / 4 * radius * radius, 0.2);
  EXPECT_TRUE(test::near(polygon.safest_point_mm(), Vector2d(0, 0), 1e-2));
  EXPECT_NEAR(smallest(polygon.edge_distances_mm({0, 0})), radius / 2, 1e-2);
  // A leg that is too short by more than the tolerance leaves an edge, by less does not matter.
  for (const auto& [shorter, edge] : {std::pair{0.02, true}, {0.005, false}}) {
    Mesh wobbly = table;
    for (Vector3d& v : wobbly.vertices)
      if (v.x() > 15 && v.z() < 1) v.z() += shorter;
    EXPECT_EQ(support_polygon(wobbly, kTolerance).corners_mm.size() == 2, edge) << shorter;
  }
}

// With a tolerance given so that a rough or uneven base stands, it does, wherever between nothing and the tolerance its feet end.
TEST(SupportPolygon, FeetOfDifferentHeightsStandWithinTheTolerance) {
  for (const double shorter : {0.05, 0.1, 0.2, 0.24, 0.26, 0.4, 0.49}) {
    Mesh stool = test::box({-20, -20, 20}, {20, 20, 25});
    append(stool, test::box({-20, -20, 0}, {-18, -18, 21}));
    append(stool, test::box({18, -20, shorter / 3}, {20, -18, 21}));
    append(stool, test::uv_ellipsoid(2, 2, 3, 16, {0, 18, 3 + shorter}));
    EXPECT_GE(support_polygon(stool, 0.5).corners_mm.size(), 3u) << shorter;
    EXPECT_GT(support_polygon(stool, 0.5).area_mm2, 600) << shorter;
  }
}

TEST(SupportPolygon, TheToleranceIsAHeightAtWhichTrianglesAreCut) {
  // Walls that lean outward by 45 degrees.
  Mesh box = test::box({-10, -10, 0}, {10, 10, 10});
  for (Vector3d& v : box.vertices)
    if (v.z() > 5) v.head<2>() *= 2;
  for (const double tolerance : {0., 0.01, 0.5, 3.})
    EXPECT_NEAR(support_polygon(box, tolerance).area_mm2, 4 * std::pow(10 + tolerance, 2), 1e-9) << tolerance;
  EXPECT_DOUBLE_EQ(contact_tolerance_mm(10), 0.05);
  EXPECT_EQ(contact_tolerance_mm(100), 0.15);
  EXPECT_DOUBLE_EQ(contact_tolerance_mm(3000), 0.3);
}

TEST(SupportPolygon, HasNoThreeCornersOnALine) {
  // A finely cut base, turned, as float32: thousands of points within 1e-6 mm of four lines.
  Mesh box = turned(test::subdivided(test::box({-30, -20, 0}, {30, 20, 5}), 6), 0.3, Vector3d::UnitZ());
  EXPECT_EQ(support_polygon(box, kTolerance).corners_mm.size(), 4u);
  box = as_float32(box);
  EXPECT_EQ(support_polygon(box, kTolerance).corners_mm.size(), 4u);
  // And a round one keeps its corners.
  EXPECT_EQ(support_polygon(test::cylinder(20, 5, 360), kTolerance).corners_mm.size(), 360u);
}

TEST(SupportPolygon, RefusesMeshesWithoutTrianglesOrNumbers) {
  EXPECT_THROW(support_polygon(Mesh(), kTolerance), Error);
  Mesh box = test::box({0, 0, 0}, {1, 1, 1});
  box.vertices[7].y() = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THROW(support_polygon(box, kTolerance), Error);
}

// ------------------------------------------------------------------------------------------------------ the safest point

SupportPolygon polygon_of(std::vector<Vector2d> corners) {
  SupportPolygon polygon;
  polygon.corners_mm = std::move(corners);
  return polygon;
}

TEST(SafestPoint, OfATriangleIsItsIncentre) {
  test::Random random(7);
  for (int i = 0; i < 200; ++i) {
    Vector2d a = 50 * random.in_box(1).head<2>();
    Vector2d b = 50 * random.in_box(1).head<2>();
    const Vector2d c = 50 * random.in_box(1).head<2>();
    const auto twice_area = [&] { return (b - a).x() * (c - a).y() - (b - a).y() * (c - a).x(); };
    if (twice_area() < 0) std::swap(a, b);
    const double A = (b - c).norm();
    const double B = (c - a).norm();
    const double C = (a - b).norm();
    const SupportPolygon polygon = polygon_of({a, b, c});
    EXPECT_TRUE(test::near(polygon.safest_point_mm(), ((A * a + B * b + C * c) / (A + B + C)).eval(), 1e-7));
    EXPECT_NEAR(smallest(polygon.edge_distances_mm(polygon.safest_point_mm())), twice_area() / (A + B + C), 1e-7);
  }
}

TEST(SafestPoint, OfRectanglesAndRegularPolygonsIsTheMiddle) {
  for (const double angle : {0., 0.2, 1., 3.}) {
    const Eigen::Rotation2Dd turn(angle);
    const Vector2d middle(7, -3);
    std::vector<Vector2d> corners;
    for (const Vector2d& c : {Vector2d(-30, -10), Vector2d(30, -10), Vector2d(30, 10), Vector2d(-30, 10)})
      corners.push_back(middle + turn * c);
    EXPECT_TRUE(test::near(polygon_of(corners).safest_point_mm(), middle, 1e-7));
    for (const int n : {3, 4, 5, 6, 8, 50, 1000}) {
      corners.clear();
      for (int k = 0; k < n; ++k)
        corners.push_back(middle + 20 * (turn * Vector2d(std::cos(2 * kPi * k / n), std::sin(2 * kPi * k / n))));
      EXPECT_TRUE(test::near(polygon_of(corners).safest_point_mm(), middle, 1e-7)) << n;
    }
  }
}

// No point is farther from the nearest edge: the distance is concave, so it is enough that no edge can be left behind: the inward
// normals of the edges that touch the circle have the origin in their hull.
TEST(SafestPoint, TouchesEdgesThatHoldItFromAllSides) {
  test::Random random(11);
  for (int i = 0; i < 300; ++i) {
    // Points on an ellipse are all corners.
    const int n = 3 + static_cast<int>(random.uniform(0, 30));
    std::vector<double> places;
    for (int k = 0; k < n; ++k) places.push_back(random.uniform(0, 2 * kPi));
    std::sort(places.begin(), places.end());
    std::vector<Vector2d> corners;
    for (const double p : places) corners.emplace_back(40 * std::cos(p), 15 * std::sin(p));
    const SupportPolygon polygon = polygon_of(corners);
    const Vector2d safest = polygon.safest_point_mm();
    const std::vector<double> distances = polygon.edge_distances_mm(safest);
    const double radius = smallest(distances);
    ASSERT_GT(radius, 0);
    std::vector<double> outward;  // directions in which a touching edge lies
    for (std::size_t k = 0; k < distances.size(); ++k)
      if (distances[k] < radius + 1e-6) {
        const Vector2d edge = corners[(k + 1) % corners.size()] - corners[k];
        outward.push_back(std::atan2(-edge.x(), edge.y()));
      }
    std::sort(outward.begin(), outward.end());
    double gap = outward.front() + 2 * kPi - outward.back();
    for (std::size_t k = 1; k < outward.size(); ++k) gap = std::max(gap, outward[k] - outward[k - 1]);
    EXPECT_LE(gap, kPi + 1e-4) << "polygon " << i << " of " << n << " corners, radius " << radius;
  }
}

// --------------------------------------------------------------------------------------------------------- tilting plane

TEST(TiltingPlane, ABoxTipsAtTheReportedAngles) {
  expect_tilting_plane_agrees(test::box({-30, -20, 0}, {30, 20, 30}), kTolerance);
  expect_tilting_plane_agrees(turned(test::box({-5, -4, 0}, {5, 4, 60}), 0.4, Vector3d::UnitZ()), kTolerance);
}

TEST(TiltingPlane, OtherBodiesTipAtTheReportedAngles) {
  expect_tilting_plane_agrees(test::frustum(12, 25, 30, 7), kTolerance);
  expect_tilting_plane_agrees(three_legged_table(1), kTolerance);
  expect_tilting_plane_agrees(test::staircase(3, 10), kTolerance);
  expect_tilting_plane_agrees(test::hollow(test::box({-30, -20, 0}, {30, 20, 30}), test::box({0, -15, 5}, {25, 10, 25})),
                              kTolerance);
}

// An L upside down, on its short foot: the arm pulls it over.
TEST(TiltingPlane, WhatTipsByItselfHasANegativeAngle) {
  const Mesh gallows = test::polycubes({{0, 0, 0}, {0, 0, 1}, {1, 0, 1}, {2, 0, 1}}, 10);
  const SupportPolygon polygon = support_polygon(gallows, kTolerance);
  ASSERT_EQ(polygon.corners_mm.size(), 4u);
  const Vector3d centre = centre_of_mass(gallows);
  EXPECT_TRUE(test::near(centre, Vector3d(12.5, 5, 12.5), 1e-12));
  const std::vector<double> angles = tipping_angles_rad(polygon, centre);
  EXPECT_NEAR(angles[1], std::atan2(-2.5, 12.5), 1e-12);
  EXPECT_TRUE(tips(sanded(gallows, kTolerance), centre, {1, 0}, 0));
  EXPECT_FALSE(tips(sanded(test::l_shape(10), kTolerance), centre_of_mass(test::l_shape(10)), {1, 0}, 0));
  expect_tilting_plane_agrees(gallows, kTolerance);
}

TEST(TiltingPlane, TheSafestPointIsWhereTheWorstAngleIsBest) {
  const SupportPolygon polygon = support_polygon(test::staircase(3, 10), kTolerance);
  const Vector2d safest = polygon.safest_point_mm();
  const double best = smallest(tipping_angles_rad(polygon, {safest.x(), safest.y(), 12}));
  test::Random random(3);
  for (int i = 0; i < 1000; ++i) {
    const Vector3d other(random.uniform(0, 30), random.uniform(0, 10), 12);
    EXPECT_LE(smallest(tipping_angles_rad(polygon, other)), best + 1e-9);
  }
}

TEST(TiltingPlane, SharedMeshesTipAtTheReportedAngles) {
  int tried = 0;
  for (const char* name : {"bunny.obj", "t-rex.obj", "utah_teapot_solid.stl", "thingi10k_37620_cuboid.stl"}) {
    const std::filesystem::path path = test::shared_meshes() / name;
    if (!std::filesystem::exists(path)) continue;
    ++tried;
    SCOPED_TRACE(name);
    Mesh mesh = read_mesh(path).mesh;
    mesh = test::scaled(mesh, 80 / bounding_box(mesh).sizes().maxCoeff());
    for (int axis = 0; axis < 3; ++axis) {
      const Vector3d up = Vector3d::Unit(axis);
      const Mesh standing = test::rotated(mesh, Eigen::Quaterniond::FromTwoVectors(up, Vector3d::UnitZ()).toRotationMatrix());
      const double tolerance = contact_tolerance_mm(bounding_box(standing).sizes().z());
      const SupportPolygon polygon = support_polygon(standing, tolerance);
      if (polygon.corners_mm.size() >= 3) expect_tilting_plane_agrees(standing, tolerance);
    }
  }
  if (tried == 0) GTEST_SKIP() << "no shared meshes";
}

}  // namespace
}  // namespace rayrep
