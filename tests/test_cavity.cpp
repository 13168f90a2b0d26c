#include <gtest/gtest.h>

#include <cmath>

#include "rayrep/cavity.h"
#include "rayrep/inner_domain.h"
#include "solids.h"

namespace rayrep {
namespace {

using namespace test;

CavityMesh cavity_of(const Mesh& solid, const Moments& q, double h, double min_mm3 = 0) {
  const SurfaceQuery surface(solid);
  InnerDomainOptions options;
  options.wall_mm = 1.2;
  options.ray_spacing_mm = options.field_spacing_mm = h;
  CavityOptions cavity;
  cavity.min_cavity_mm3 = min_mm3;
  BlockField field = inner_domain(surface, options).field;
  return mesh_cavity(field, surface, q, cavity);
}

/// Material below the plane z = height + slope x.
Moments plane(double height, double slope = 0) {
  Moments q = Moments::Zero();
  q[M1] = -height;
  q[MX] = -slope;
  q[MZ] = 1;
  return q;
}

TEST(Cavity, AboveAPlaneInABoxIsABox) {
  const CavityMesh cavity = cavity_of(box({-10, -8, 0}, {10, 8, 20}), plane(7), 0.4);
  EXPECT_EQ(cavity.cavities, 1u);
  Mesh outward = cavity.mesh;
  flip(outward);
  EXPECT_TRUE(is_closed_solid(outward));
  const Moments exact = box_moments({-8.8, -6.8, 7}, {8.8, 6.8, 18.8});
  // Edges are chamfered by at most a cell: h^2 / 2 along their length.
  EXPECT_NEAR(mesh_moments(outward)[M1], exact[M1], 0.5 * 0.4 * 0.4 * 4 * (17.6 + 13.6 + 11.8));
  EXPECT_LE(mesh_moments(outward)[M1], exact[M1] + 1e-6);
}

TEST(Cavity, VerticesLieOnTheWallOrOnThePlane) {
  for (const Mesh& solid :
       {rotated(torus(10, 5, 60, 40), random_rotation(3)), icosphere(10, 5), rotated(l_shape(9), random_rotation(6))}) {
    const Moments q = plane(bounding_box(solid).center().z() - 2, 0.3);
    const CavityMesh cavity = cavity_of(solid, q, 0.5);
    ASSERT_GT(cavity.mesh.vertices.size(), 100u);
    const SurfaceQuery surface(solid);
    double thinnest = 1e9;
    double beside = 0;
    for (const auto& v : cavity.mesh.vertices) {
      const double d = surface.closest(v, 20).distance_mm;
      const double above = q.dot(monomials(v)) / std::hypot(1, 0.3);
      thinnest = std::min(thinnest, d);
      EXPECT_GT(above, -1e-4);
      beside = std::max(beside, std::min(std::abs(d - 1.2), std::abs(above)));
    }
    EXPECT_GT(thinnest, 1.2 - 1e-3);
    EXPECT_LT(beside, 1e-3);
  }
}

TEST(Cavity, VolumeOfASphericalCapConverges) {
  // The part of a ball of radius R = 8.8 above z = 2: a cap of height 6.8.
  const double cap = kPi * 6.8 * 6.8 * (3 * 8.8 - 6.8) / 3;
  double previous = 0;
  for (const double h : {0.8, 0.4, 0.2}) {
    const double error = std::abs(-mesh_moments(cavity_of(icosphere(10, 6), plane(2), h).mesh)[M1] / cap - 1);
    EXPECT_LT(error, 0.02 * h * h + 1.5e-3) << h;
    if (previous > 2e-3) {
      EXPECT_LT(error, previous / 2);
    }
    previous = error;
  }
  EXPECT_LT(previous, 1.5e-3);
}

TEST(Cavity, OfAQuadricFollowsIt) {
  // Material outside a sphere of radius 5: q.phi = 25 - |p|^2 > 0 inside it.
  Moments q = Moments::Zero();
  q[M1] = 25;
  q[MXX] = q[MYY] = q[MZZ] = -1;
  const CavityMesh cavity = cavity_of(box({-10, -10, -10}, {10, 10, 10}), q, 0.4);
  EXPECT_EQ(cavity.cavities, 1u);
  for (const auto& v : cavity.mesh.vertices) EXPECT_NEAR(v.norm(), 5, 1e-5);
  EXPECT_NEAR(-mesh_moments(cavity.mesh)[M1], 4.0 / 3 * kPi * 125, 2);
}

TEST(Cavity, SmallOnesAreFilledAndAccounted) {
  const Mesh two = merged({icosphere(8, 4), icosphere(1.9, 4, {20, 0, 0})});
  const CavityMesh cavity = cavity_of(two, plane(-100), 0.25, 4);
  EXPECT_EQ(cavity.cavities, 1u);
  EXPECT_EQ(cavity.filled, 1u);
  EXPECT_NEAR(cavity.filled_mm3, 4.0 / 3 * kPi * std::pow(0.7, 3), 0.2);
}

TEST(Cavity, NothingAboveThePlaneIsNoCavity) {
  const CavityMesh cavity = cavity_of(icosphere(10, 4), plane(9), 0.5);
  EXPECT_EQ(cavity.cavities, 0u);
  EXPECT_TRUE(cavity.mesh.triangles.empty());
}

}  // namespace
}  // namespace rayrep
