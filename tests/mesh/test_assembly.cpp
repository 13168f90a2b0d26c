// Bodies cut in two, and put together again.

#include <gtest/gtest.h>

#include <cmath>

#include "mesh/prism.h"
#include "rayrep/mesh/assembly.h"
#include "rayrep/mesh/bodies.h"
#include "solids.h"

namespace rayrep::test {
namespace {

std::vector<Mesh> bodies() {
  return {icosphere(10, 4), torus(10, 3, 40, 20), cone(8, 12, 30), hollow(box({0, 0, 0}, {10, 12, 14}), box({2, 2, 2}, {5, 7, 9})),
          staircase(5, 3)};
}

ClipPlane through(const Mesh& body, std::uint64_t seed) {
  const Eigen::Vector3d n = random_rotation(seed).col(2);
  return {n, n.dot(bounding_box(body).center()) + 2 * std::sin(static_cast<double>(seed))};
}

/// Cut by one plane after the other.
std::vector<Mesh> cut_by(const Mesh& body, const std::vector<ClipPlane>& planes) {
  std::vector<Mesh> pieces = {body};
  for (const ClipPlane& plane : planes) {
    std::vector<Mesh> next;
    for (const Mesh& piece : pieces) {
      const Halves two = halves(piece, plane);
      for (const Mesh& half : {two.above, two.below})
        if (!half.triangles.empty()) next.push_back(half);
    }
    pieces = next;
  }
  return pieces;
}

Mesh all_of(const std::vector<Mesh>& meshes) {
  Mesh all;
  for (const Mesh& mesh : meshes) append(all, mesh);
  return all;
}

/// Of the triangles in the plane.
double area_in(const Mesh& mesh, const ClipPlane& plane) {
  double area = 0;
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    bool in_plane = true;
    for (int k = 0; k < 3; ++k) in_plane = in_plane && std::abs(plane.normal.dot(mesh.corner(t, k)) - plane.offset_mm) < 1e-9;
    if (in_plane) area += 0.5 * (mesh.corner(t, 1) - mesh.corner(t, 0)).cross(mesh.corner(t, 2) - mesh.corner(t, 0)).norm();
  }
  return area;
}

TEST(Assembly, HalvesAreClosedAndAddUpInAllTenMoments) {
  for (const Mesh& body : bodies())
    for (std::uint64_t seed = 0; seed < 12; ++seed) {
      const ClipPlane plane = through(body, seed);
      const Halves two = halves(body, plane);
      EXPECT_TRUE(is_closed_solid(two.above));
      EXPECT_TRUE(is_closed_solid(two.below));
      EXPECT_TRUE(moments_near(mesh_moments(two.above) + mesh_moments(two.below), mesh_moments(body), 1e-12, 20));
      EXPECT_TRUE(moments_near(mesh_moments(two.above), mesh_moments(clipped(body, plane)), 1e-12, 20));
      EXPECT_NEAR(area_in(two.above, plane), area_in(two.below, plane), 1e-9);
      EXPECT_GT(area_in(two.above, plane), 1);
    }
}

TEST(Assembly, PiecesOfAnyNumberOfCutsAreTheWholeAgain) {
  for (const Mesh& body : bodies())
    for (std::uint64_t seed = 0; seed < 6; ++seed) {
      const std::vector<ClipPlane> planes = {through(body, seed), through(body, seed + 20), through(body, seed + 40)};
      const std::vector<Mesh> pieces = cut_by(body, planes);
      EXPECT_GT(pieces.size(), 3u);
      Moments sum = Moments::Zero();
      for (const Mesh& piece : pieces) {
        EXPECT_TRUE(is_closed_solid(piece));
        sum += mesh_moments(piece);
      }
      const Mesh whole = glued(all_of(pieces));
      EXPECT_TRUE(is_closed_solid(whole));
      EXPECT_TRUE(moments_near(sum, mesh_moments(body), 1e-12, 20));
      EXPECT_TRUE(moments_near(mesh_moments(whole), mesh_moments(body), 1e-12, 20));
      EXPECT_NEAR(surface_area(whole), surface_area(body), 1e-9 * surface_area(body));  // no seam is left inside
      EXPECT_EQ(bodies_of(whole).count, 1);
    }
}

TEST(Assembly, FacesInThePlaneGoWithWhatTheyBound) {
  const Mesh body = staircase(5, 3);
  for (int step = 1; step < 5; ++step) {
    const ClipPlane plane{Eigen::Vector3d::UnitZ(), 3.0 * step};
    const Halves two = halves(body, plane);
    for (const Mesh& half : {two.above, two.below}) EXPECT_TRUE(is_closed_solid(half));
    EXPECT_EQ(mesh_moments(two.above)[M1] + mesh_moments(two.below)[M1], mesh_moments(body)[M1]);
    for (const Eigen::Vector3d& v : two.above.vertices) EXPECT_GE(v.z(), plane.offset_mm);
    for (const Eigen::Vector3d& v : two.below.vertices) EXPECT_LE(v.z(), plane.offset_mm);
  }
}

TEST(Assembly, WhatThePlaneMissesIsAllOnOneSide) {
  const Mesh body = icosphere(10, 2);
  const Halves two = halves(body, {Eigen::Vector3d::UnitX(), -11});
  EXPECT_EQ(two.above.triangles.size(), body.triangles.size());
  EXPECT_TRUE(two.below.triangles.empty());
}

TEST(Assembly, OnlyFacesThatMatchAreGlued) {
  const Mesh left = box({0, 0, 0}, {1, 1, 1});
  const Mesh right = box({1, 0, 0}, {2, 1, 1});
  const Mesh two = merged({left, right});
  const Mesh apart = merged({left, moved(right, {0.5, 0, 0})});
  EXPECT_EQ(glued(apart).triangles.size(), 24u);
  // The diagonals of a box's faces are not those of its neighbour's.
  EXPECT_EQ(mesh_moments(glued(two))[M1], 2);
  Mesh mirrored = left;
  flip(mirrored);
  EXPECT_TRUE(glued(merged({left, mirrored})).triangles.empty());
  EXPECT_EQ(glued(merged({left, left, mirrored})).triangles.size(), 12u);
}

TEST(Assembly, APrismHasTheMomentsOfItsCircle) {
  const Eigen::Vector3d axis = Eigen::Vector3d(1, 2, 3).normalized();
  Prism prism{{4, 5, 6}, axis, 2, -3, 7, 48, Prism::Fit::same_area};
  const Mesh rod = surface_of(prism);
  EXPECT_TRUE(is_closed_solid(rod));
  EXPECT_NEAR(mesh_moments(rod)[M1], kPi * 4 * 10, 1e-9);
  const MassProperties mass = mass_properties(rod, 1);
  EXPECT_TRUE((mass.centre_of_mass_mm - Eigen::Vector3d(4, 5, 6) - 2 * axis).norm() < 1e-12);
  prism.fit = Prism::Fit::around;
  for (const Eigen::Vector3d& v : surface_of(prism).vertices) EXPECT_GE((v - prism.middle).cross(axis).norm(), 2);
}

}  // namespace
}  // namespace rayrep::test
