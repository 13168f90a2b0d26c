// The geometry that maker and judge share, against twins that compute the same by another route and without rounding: an error
// there would not be contradicted by the judge.

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <vector>

#include "exact.h"
#include "mesh/crossing.h"
#include "mesh/surface_gap.h"
#include "rayrep/mesh/surface_query.h"
#include "rayrep/physics/hydrostatics.h"
#include "rayrep/physics/moments.h"
#include "solids.h"

namespace rayrep {
namespace {

using namespace test;
using Eigen::Vector3d;
using exact::Rational;

/// Small bodies of every kind, turned and moved so that nothing is aligned or centred.
std::vector<Mesh> bodies() {
  std::vector<Mesh> all = {unit_tetrahedron(),
                           box({-1, -2, -3}, {4, 2, 1}),
                           l_shape(3),
                           staircase(3, 2),
                           torus(5, 2, 7, 5),
                           uv_ellipsoid(6, 4, 3, 6),
                           hollow(icosphere(6, 1), icosphere(3, 1, {0.5, 1, 0.2})),
                           merged({box({0, 0, 0}, {2, 2, 2}), box({4, 0, 1}, {5, 5, 5})})};
  const std::size_t aligned = all.size();
  for (std::size_t n = 0; n < aligned; ++n)
    all.push_back(moved(rotated(all[n], random_rotation(100 + n)), Vector3d(3, -7, 11) * static_cast<double>(n % 3)));
  return all;
}

/// By the divergence theorem along one axis: the integral of x^i y^j z^k is the flux of x^(i+1) y^j z^k / (i + 1) along x.
Rational moment(const Mesh& mesh, std::vector<int> factors, int axis) {
  const auto already = std::count(factors.begin(), factors.end(), axis);
  factors.push_back(axis);
  Rational sum = 0;
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) sum += exact::flux(exact::triangle(mesh, t), factors, axis);
  return sum / (already + 1);
}

const std::vector<int> kFactors[10] = {{}, {0}, {1}, {2}, {0, 0}, {1, 1}, {2, 2}, {0, 1}, {1, 2}, {0, 2}};

TEST(MomentsTwin, TetrahedraAndFluxesAlongEachAxisGiveTheSameTenNumbers) {
  for (const Mesh& body : bodies()) {
    const double size = bounding_box(body).diagonal().norm();
    const double reach = std::max(size, bounding_box(body).center().norm());
    const Moments s = mesh_moments(body);
    for (int axis = 0; axis < 3; ++axis) {
      Moments twin;
      for (int k = 0; k < 10; ++k) twin[k] = exact::rounded(moment(body, kFactors[k], axis));
      expect_moments_near(s, twin, 1e-13, reach);
    }
  }
}

TEST(MomentsTwin, InertiaIsThatAboutTheExactCentre) {
  for (const Mesh& body : bodies()) {
    const MassProperties p = mass_properties(body, 1.24);
    Rational s[10];
    for (int k = 0; k < 10; ++k) s[k] = moment(body, kFactors[k], 1);
    const auto central = [&](int entry, int a, int b) { return s[entry] - s[1 + a] * s[1 + b] / s[0]; };
    const Rational xx = central(MXX, 0, 0), yy = central(MYY, 1, 1), zz = central(MZZ, 2, 2);
    Eigen::Matrix3d twin;
    twin << exact::rounded(yy + zz), exact::rounded(-central(MXY, 0, 1)), exact::rounded(-central(MXZ, 0, 2)),
        exact::rounded(-central(MXY, 0, 1)), exact::rounded(xx + zz), exact::rounded(-central(MYZ, 1, 2)),
        exact::rounded(-central(MXZ, 0, 2)), exact::rounded(-central(MYZ, 1, 2)), exact::rounded(xx + yy);
    twin *= 1.24e-3;
    EXPECT_TRUE(near(p.inertia_g_mm2, twin, 1e-13 * twin.norm()));
    for (int k = 0; k < 3; ++k)
      EXPECT_NEAR(p.centre_of_mass_mm[k], exact::rounded(s[1 + k] / s[0]),
                  1e-14 * bounding_box(body).diagonal().norm() + 1e-15 * 40);
  }
}

/// All that hydrostatics tells, from fluxes along x and y, through which a horizontal waterplane has none, and by closing the wet
/// surface: no heights above the water, no rim.
struct WetTwin {
  double volume, area;
  Vector3d centre;
  Eigen::Vector2d flotation, seconds;
};

WetTwin wet_twin(const Mesh& hull, double height) {
  const Rational level(height);
  Rational volume = 0, x = 0, y = 0, z = 0, area = 0, ax = 0, ay = 0, axx = 0, ayy = 0, axy = 0;
  for (std::size_t t = 0; t < hull.triangles.size(); ++t)
    for (const exact::Triangle& part : exact::below(exact::triangle(hull, t), level)) {
      volume += exact::flux(part, {0}, 0);
      x += exact::flux(part, {0, 0}, 0) / 2;
      y += exact::flux(part, {1, 1}, 1) / 2;
      z += exact::flux(part, {1, 2}, 1);
      area -= exact::flux(part, {}, 2);
      ax -= exact::flux(part, {0}, 2);
      ay -= exact::flux(part, {1}, 2);
      axx -= exact::flux(part, {0, 0}, 2);
      ayy -= exact::flux(part, {1, 1}, 2);
      axy -= exact::flux(part, {0, 1}, 2);
    }
  WetTwin twin{exact::rounded(volume), exact::rounded(area), Vector3d::Zero(), Eigen::Vector2d::Zero(), Eigen::Vector2d::Zero()};
  if (volume > 0) twin.centre = {exact::rounded(x / volume), exact::rounded(y / volume), exact::rounded(z / volume)};
  if (area > 0) {
    twin.flotation = {exact::rounded(ax / area), exact::rounded(ay / area)};
    const double cxx = exact::rounded(axx - ax * ax / area);
    const double cyy = exact::rounded(ayy - ay * ay / area);
    const double cxy = exact::rounded(axy - ax * ay / area);
    const double half = std::hypot((cxx - cyy) / 2, cxy);
    twin.seconds = {(cxx + cyy) / 2 - half, (cxx + cyy) / 2 + half};
  }
  return twin;
}

TEST(HydrostaticsTwin, ClippedBodiesDisplaceWhatFluxesThroughTheSidesSay) {
  int clipped = 0;
  for (const Mesh& body : bodies()) {
    const Mesh hull = outer_hull(body);
    const Eigen::AlignedBox3d limits = bounding_box(hull);
    const double size = limits.diagonal().norm();
    for (const double share : {0.05, 0.31, 0.5, 0.77, 0.96, 1.5}) {
      const double height = limits.min().z() + share * limits.sizes().z();
      const Hydrostatics water = hydrostatics(hull, {Vector3d::UnitZ(), height});
      if (water.dry_interior_mm3 > 0) continue;  // the twin knows no pockets
      const WetTwin twin = wet_twin(hull, height);
      ++clipped;
      const double area = limits.sizes().x() * limits.sizes().y();
      EXPECT_NEAR(water.displaced_volume_mm3, twin.volume, 1e-13 * area * limits.sizes().z());
      EXPECT_TRUE(near(water.centre_of_buoyancy_mm, twin.centre, 1e-11 * size));
      EXPECT_NEAR(water.waterplane_area_mm2, twin.area, 1e-13 * area);
      if (twin.area > 1e-6 * area) {
        EXPECT_TRUE(near(water.centre_of_flotation_mm.head<2>(), twin.flotation, 1e-11 * size));
        EXPECT_NEAR(water.smallest_second_moment_mm4, twin.seconds[0], 1e-12 * area * size * size);
        EXPECT_NEAR(water.largest_second_moment_mm4, twin.seconds[1], 1e-12 * area * size * size);
      }
      if (share < 1) {
        const double back = waterline_for_volume(hull, Vector3d::UnitZ(), twin.volume);
        EXPECT_NEAR(wet_twin(hull, back).volume, twin.volume, 1e-12 * area * limits.sizes().z());
      }
    }
  }
  EXPECT_GT(clipped, 60);
}

/// The solid angles under which a point sees the triangles (van Oosterom and Strackee, IEEE Trans. Biomed. Eng. 30(2), 1983), over
/// 4 pi: no line, no crossing.
long double winding_by_solid_angles(const Mesh& mesh, const Vector3d& p) {
  using Vector = Eigen::Matrix<long double, 3, 1>;
  long double sum = 0;
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    const Vector a = (mesh.corner(t, 0) - p).cast<long double>();
    const Vector b = (mesh.corner(t, 1) - p).cast<long double>();
    const Vector c = (mesh.corner(t, 2) - p).cast<long double>();
    const long double la = a.norm(), lb = b.norm(), lc = c.norm();
    sum += 2 * std::atan2(a.dot(b.cross(c)), la * lb * lc + a.dot(b) * lc + b.dot(c) * la + c.dot(a) * lb);
  }
  return sum / (4 * 3.14159265358979323846264338327950288L);
}

TEST(WindingTwin, LinesCountWhatSolidAnglesAddUpTo) {
  std::vector<Mesh> all = bodies();
  all.push_back(merged({box({0, 0, 0}, {4, 4, 4}), box({1, 0.5, 0.5}, {6, 3.5, 3.5})}));  // 2 where they overlap
  all.push_back(merged(
      {box({0, 0, 0}, {6, 6, 6}), flipped(box({1, 1, 1}, {5, 5, 5})), flipped(box({1.5, 1.5, 1.5}, {4.5, 4.5, 4.5}))}));  // -1
  Random random(5);
  int found[4] = {0, 0, 0, 0};
  for (const Mesh& body : all) {
    const SurfaceQuery surface(body);
    const Eigen::AlignedBox3d limits = bounding_box(body);
    std::vector<LineHit> hits;
    for (int n = 0; n < 60; ++n) {
      Vector3d p;
      // Through corners and along edges, too: their heights and places are those of the body's own.
      for (int k = 0; k < 3; ++k) p[k] = limits.min()[k] + random.uniform(-0.1, 1.1) * limits.sizes()[k];
      if (n % 3 == 0) p.head<2>() = body.vertices[static_cast<std::size_t>(n) % body.vertices.size()].head<2>();
      if (surface.closest(p, 10 * limits.diagonal().norm()).distance_mm < 1e-6) continue;
      const long double twin = winding_by_solid_angles(body, p);
      ASSERT_NEAR(static_cast<double>(twin), std::round(static_cast<double>(twin)), 1e-9);
      ASSERT_TRUE(closed_line_hits(surface, p.head<2>(), hits));
      const int winding = winding_below(hits, p.z());
      EXPECT_EQ(winding, std::lround(static_cast<double>(twin))) << p.transpose();
      ++found[winding + 1];
    }
  }
  for (const int count : found) EXPECT_GT(count, 0);
}

Corners3 corners(Random& random, double half, const Vector3d& centre) {
  return {centre + random.in_box(half), centre + random.in_box(half), centre + random.in_box(half)};
}

TEST(DistanceTwin, TrianglesAreAsFarApartAsTheNearestOfAllPairsOfTheirFaces) {
  Random random(11);
  int touching = 0;
  for (int n = 0; n < 300; ++n) {
    Corners3 p = corners(random, 1, Vector3d::Zero());
    Corners3 q = corners(random, 1, random.in_box(1.5));
    if (n % 5 == 0)  // on a lattice: parallel sides, common corners, one plane
      for (Corners3* t : {&p, &q})
        for (Vector3d& v : *t) v = (2 * v).array().round();
    if (n % 7 == 0) q[1] = 0.5 * (q[0] + q[2]);  // a needle
    const Rational squared = exact::squared_distance(exact::triangle(p[0], p[1], p[2]), exact::triangle(q[0], q[1], q[2]));
    const double distance = triangle_distance(p, q).distance_mm;
    EXPECT_NEAR(distance, std::sqrt(exact::rounded(squared)), 1e-12) << n;
    touching += squared == 0;
  }
  EXPECT_GT(touching, 20);
}

TEST(DistanceTwin, TheWallIsTheLeastOfAllPairs) {
  const Mesh outside = rotated(l_shape(10), random_rotation(3));
  const Mesh inside = rotated(moved(scaled(unit_tetrahedron(), 3), {2, 3, 4}), random_rotation(3));
  Rational least = 1000000;
  for (std::size_t s = 0; s < inside.triangles.size(); ++s)
    for (std::size_t t = 0; t < outside.triangles.size(); ++t)
      least = std::min(least, exact::squared_distance(exact::triangle(inside, s), exact::triangle(outside, t)));
  EXPECT_NEAR(smallest_gap(inside, SurfaceQuery(outside)), std::sqrt(exact::rounded(least)), 1e-12);
}

TEST(CrossingTwin, TrianglesWithoutACommonCornerCrossWhereTheirDistanceIsNothing) {
  Random random(17);
  int crossing = 0;
  for (int n = 0; n < 40; ++n) {
    Mesh mesh;
    for (int t = 0; t < 8; ++t) {
      const Corners3 c = corners(random, 1, random.in_box(1));
      const int first = static_cast<int>(mesh.vertices.size());
      for (const Vector3d& v : c) mesh.vertices.push_back(n % 4 == 0 ? Vector3d((2 * v).array().round()) : v);
      mesh.triangles.emplace_back(first, first + 1, first + 2);
    }
    // Of zero area: left out there as here.
    std::erase_if(mesh.triangles, [&](const Eigen::Vector3i& t) {
      const exact::Point area = exact::twice_area(exact::triangle(mesh.vertices[t[0]], mesh.vertices[t[1]], mesh.vertices[t[2]]));
      return exact::dot(area, area) == 0;
    });
    TrianglePairs twin;
    for (std::size_t s = 0; s < mesh.triangles.size(); ++s)
      for (std::size_t t = s + 1; t < mesh.triangles.size(); ++t)
        if (exact::squared_distance(exact::triangle(mesh, s), exact::triangle(mesh, t)) == 0)
          twin.emplace_back(static_cast<int>(s), static_cast<int>(t));
    EXPECT_EQ(crossing_pairs(mesh, close_pairs(mesh)), twin) << n;
    crossing += static_cast<int>(twin.size());
  }
  EXPECT_GT(crossing, 50);
}

}  // namespace
}  // namespace rayrep
