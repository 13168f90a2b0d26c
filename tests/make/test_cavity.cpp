#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <utility>

#include "make/cavity_mender.h"
#include "make/clipped_cavity.h"
#include "mesh/crossing.h"
#include "mesh/float32.h"
#include "mesh/predicates.h"
#include "mesh/surface_gap.h"
#include "places.h"
#include "rayrep/io/mesh_io.h"
#include "rayrep/make/cavity.h"
#include "rayrep/rays/inner_domain.h"
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
  // Where the body is reentrant a little beyond the wall: an edge of length L below 2 h needs at most L^2 / (6 wall).
  const double h = 0.5;
  for (const Mesh& solid :
       {rotated(torus(10, 5, 60, 40), random_rotation(3)), icosphere(10, 5), rotated(l_shape(9), random_rotation(6))}) {
    const Moments q = plane(bounding_box(solid).center().z() - 2, 0.3);
    const CavityMesh cavity = cavity_of(solid, q, h);
    ASSERT_GT(cavity.mesh.vertices.size(), 100u);
    const SurfaceQuery surface(solid);
    double thinnest = 1e9;
    double beside = 0;
    double off = 0;
    for (const auto& v : cavity.mesh.vertices) {
      const double d = surface.closest(v, 20).distance_mm;
      const double above = q.dot(monomials(v)) / std::hypot(1, 0.3);
      thinnest = std::min(thinnest, d);
      EXPECT_GT(above, -1e-4);
      const double from_both = std::min(std::abs(d - 1.2), std::abs(above));
      beside = std::max(beside, from_both);
      off += from_both;
    }
    EXPECT_GT(thinnest, 1.2 - 1e-3);
    EXPECT_LT(beside, 4 * h * h / (6 * 1.2));
    EXPECT_LT(off / static_cast<double>(cavity.mesh.vertices.size()), 2e-3);
  }
}

TEST(Cavity, TrianglesKeepTheWallBetweenTheirVertices) {
  // At the coarsest grid of the pipeline: half a wall. Reentrant: the inside of a torus, a crease, a corner of three, a dent.
  const double wall = 1.2;
  Mesh dented = icosphere(12, 5);
  for (auto& v : dented.vertices) v *= 1 - 0.4 * std::exp(-(v / 12 - Eigen::Vector3d::UnitX()).squaredNorm() / 0.1);
  for (const Mesh& solid : {rotated(torus(10, 5, 60, 40), random_rotation(3)), rotated(l_shape(9), random_rotation(6)),
                            rotated(polycubes({{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}}, 9), random_rotation(2)), dented}) {
    const Moments q = plane(bounding_box(solid).min().z() - 1);  // all of the inner domain is cavity
    const CavityMesh cavity = cavity_of(solid, q, 0.5 * wall);
    ASSERT_GT(cavity.mesh.triangles.size(), 1000u);
    EXPECT_GE(smallest_gap(cavity.mesh, SurfaceQuery(solid)), 0.99 * wall);
  }
}

TEST(Cavity, KeepsTheWallAndDoesNotCrossAsStored) {
  // A crease, a corner and a dent again, in the middle of nowhere: float32 coordinates lie up to 1/154 of the wall apart there.
  const double wall = 1.2;
  Mesh dented = icosphere(12, 4);
  for (auto& v : dented.vertices) v *= 1 - 0.4 * std::exp(-(v / 12 - Eigen::Vector3d::UnitX()).squaredNorm() / 0.1);
  for (const double from_origin : {0.0, 1e3, 1e5})
    for (const Mesh& solid : {rotated(l_shape(9), random_rotation(6)), dented}) {
      const auto stored = [&](const Mesh& mesh) { return as_float32(moved(mesh, from_origin * Eigen::Vector3d(1, -0.7, 0.4))); };
      const Mesh body = moved(stored(solid), -from_origin * Eigen::Vector3d(1, -0.7, 0.4));
      const SurfaceQuery surface(body);
      InnerDomainOptions inner;
      inner.wall_mm = wall;
      inner.ray_spacing_mm = inner.field_spacing_mm = 0.4;
      BlockField field = inner_domain(surface, inner).field;
      CavityOptions options;
      options.as_delivered = stored;
      CavityMesh cavity = mesh_cavity(field, surface, plane(-2, 0.3), options);
      for (const double height : {-2.0, -1.95, -1.9}) {  // made anew, and then following
        if (height > -2) {
          ASSERT_TRUE(follow_quadric(cavity, field, surface, plane(height, 0.3), options));
        }
        EXPECT_EQ(cavity.crossing, 0u);
        const Mesh delivered = with_merged_vertices(stored(cavity.mesh));
        EXPECT_TRUE(crossing_triangles(delivered).empty());
        EXPECT_GE(smallest_gap(delivered, SurfaceQuery(stored(solid))), 0.98 * wall);
      }
    }
}

TEST(Cavity, FoldsThatRoundingMakesAreMended) {
  // Two vertices so near to each other that they are stored as one, in a shell that is sound as it is.
  Mesh shell = flipped(icosphere(5, 4));
  const int a = shell.triangles[0][0];
  const int b = shell.triangles[0][1];
  shell.vertices[a] = shell.vertices[b] + 1e-9 * (shell.vertices[a] - shell.vertices[b]);
  const auto stored = [](const Mesh& mesh) { return as_float32(mesh); };
  ASSERT_TRUE(crossing_triangles(shell).empty());
  ASSERT_FALSE(crossing_triangles(stored(shell)).empty());
  const SurfaceQuery surface(icosphere(6.25, 4));
  CavityOptions options;
  options.as_delivered = stored;
  Mesh mended = shell;
  EXPECT_TRUE(detail::CavityMender(surface, options).mend(mended, std::vector<char>(shell.vertices.size(), 1)).empty());
  EXPECT_TRUE(crossing_triangles(with_merged_vertices(stored(mended))).empty());
  EXPECT_GE(smallest_gap(mended, surface), 0.99 * options.wall_mm);
  std::size_t moved = 0;
  for (std::size_t v = 0; v < shell.vertices.size(); ++v) moved += mended.vertices[v] != shell.vertices[v];
  EXPECT_GT(moved, 0u);
  EXPECT_LT(moved, 40u);
  EXPECT_NEAR(mesh_moments(mended)[M1], mesh_moments(shell)[M1], 0.05);
}

TEST(Cavity, FoldsOfACutAreMendedByLittle) {
  // A vertex that went past the other side of one of its triangles by a fiftieth of that.
  Mesh shell = flipped(icosphere(5, 3));
  const Eigen::Vector3i t = shell.triangles[0];
  const Eigen::Vector3d middle = 0.5 * (shell.vertices[t[0]] + shell.vertices[t[1]]);
  const double side = (shell.vertices[t[0]] - shell.vertices[t[1]]).norm();
  shell.vertices[t[2]] = middle + 0.02 * side * (middle - shell.vertices[t[2]]).normalized();
  ASSERT_FALSE(crossing_triangles(shell).empty());
  const SurfaceQuery surface(icosphere(7, 4));
  const CavityOptions options;
  std::vector<char> is_new(shell.vertices.size(), 0);
  is_new[t[2]] = 1;
  Mesh mended = shell;
  EXPECT_TRUE(detail::CavityMender(surface, options).mend(mended, is_new).empty());
  EXPECT_TRUE(crossing_triangles(mended).empty());
  for (std::size_t v = 0; v < shell.vertices.size(); ++v)
    EXPECT_LT((mended.vertices[v] - shell.vertices[v]).norm(), 0.15 * side) << v;
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

TEST(Cavity, TheSurfaceIsWithinAFractionOfTheRaySpacing) {
  // A ball of radius 20 with a wall of 1.2, cut by a plane, a ball and a tilted paraboloid; at the setting of the pipeline for 100
  // rays. Distances over the whole surface, in the middle of triangles too: to the sphere of radius 18.8 or to the quadric,
  // whichever is nearer, to first order.
  const double spacing = 0.4;
  const Mesh solid = icosphere(20, 6);
  Moments ball = Moments::Zero();
  ball[M1] = 12 * 12;
  ball[MXX] = ball[MYY] = ball[MZZ] = -1;
  Moments paraboloid = plane(-6, 0.2);
  paraboloid[MXX] = -0.03;
  paraboloid[MYY] = -0.05;
  for (const Moments& q : {plane(4, 0.3), ball, paraboloid}) {
    const CavityMesh cavity = cavity_of(solid, q, 0.3);
    ASSERT_GT(cavity.mesh.triangles.size(), 5000u);
    double area = 0;
    double sum = 0;
    double largest = 0;
    for (std::size_t t = 0; t < cavity.mesh.triangles.size(); ++t) {
      const Eigen::Vector3d a = cavity.mesh.corner(t, 0);
      const Eigen::Vector3d b = cavity.mesh.corner(t, 1);
      const Eigen::Vector3d c = cavity.mesh.corner(t, 2);
      const double size = 0.5 * (b - a).cross(c - a).norm();
      for (const Eigen::Vector3d& p : {Eigen::Vector3d((a + b + c) / 3), Eigen::Vector3d((a + b) / 2)}) {
        const Eigen::Vector3d gradient =
            q.segment<3>(MX) + Eigen::Vector3d(2 * q[MXX] * p.x(), 2 * q[MYY] * p.y(), 2 * q[MZZ] * p.z());
        const double to_quadric = std::abs(q.dot(monomials(p))) / gradient.norm();
        const double distance = std::min(std::abs(p.norm() - 18.8), to_quadric);
        sum += size * distance;
        area += size;
        largest = std::max(largest, distance);
      }
    }
    EXPECT_LT(sum / area, 0.05 * spacing);
    EXPECT_LT(largest, 0.5 * spacing);
  }
}

TEST(Cavity, FollowsAQuadricAsIfItWereMeshedAnew) {
  const Mesh solid = icosphere(10, 5);
  const SurfaceQuery surface(solid);
  InnerDomainOptions options;
  options.wall_mm = 1.2;
  options.ray_spacing_mm = options.field_spacing_mm = 0.3;
  BlockField field = inner_domain(surface, options).field;
  CavityOptions cavity_options;
  CavityMesh followed = mesh_cavity(field, surface, plane(2, 0.1), cavity_options);
  const double before = mesh_moments(followed.mesh)[M1];
  ASSERT_TRUE(follow_quadric(followed, field, surface, plane(2.05, 0.102), cavity_options));
  const CavityMesh anew = mesh_cavity(field, surface, plane(2.05, 0.102), cavity_options);
  const double change = mesh_moments(anew.mesh)[M1] - before;
  EXPECT_NEAR(mesh_moments(followed.mesh)[M1] - before, change, 0.05 * std::abs(change));
  EXPECT_TRUE(crossing_triangles(followed.mesh).empty());
  for (const auto& v : followed.mesh.vertices) EXPECT_GT(surface.closest(v, 20).distance_mm, 1.2 - 1e-3);
  // Too far: nothing is changed.
  const std::vector<Eigen::Vector3d> vertices = followed.mesh.vertices;
  EXPECT_FALSE(follow_quadric(followed, field, surface, plane(3), cavity_options));
  EXPECT_EQ(followed.mesh.vertices, vertices);
}

TEST(CrossingTriangles, AreThoseThatIntersect) {
  // Against all pairs: a torus through another one, a sphere dented into itself, and a smooth one without any.
  Mesh dented = icosphere(10, 3);
  for (auto& v : dented.vertices)
    if (v.z() > 9) v.z() -= 19.5;
  for (const Mesh& mesh :
       {merged({torus(8, 3, 24, 16), rotated(torus(7, 2, 20, 12), random_rotation(5))}), dented, icosphere(10, 3)}) {
    std::vector<std::size_t> expected;
    for (std::size_t i = 0; i < mesh.triangles.size(); ++i)
      for (std::size_t j = 0; j < mesh.triangles.size(); ++j) {
        const Eigen::Vector3d p[3] = {mesh.corner(i, 0), mesh.corner(i, 1), mesh.corner(i, 2)};
        const Eigen::Vector3d q[3] = {mesh.corner(j, 0), mesh.corner(j, 1), mesh.corner(j, 2)};
        if (i != j && triangles_intersect(p, mesh.triangles[i], q, mesh.triangles[j])) {
          expected.push_back(i);
          break;
        }
      }
    EXPECT_EQ(crossing_triangles(mesh), expected);
    EXPECT_EQ(crossing_near(mesh, std::vector<char>(mesh.vertices.size(), 1)), expected);
    EXPECT_TRUE(crossing_near(mesh, std::vector<char>(mesh.vertices.size(), 0)).empty());
  }
}

TEST(CrossingTriangles, NearMarkedVerticesAreThoseThatTheseMake) {
  Mesh mesh = icosphere(10, 3);
  std::vector<char> moved(mesh.vertices.size(), 0);
  for (const int n : {5, 77}) {
    mesh.vertices[n] *= -1.1;
    moved[n] = 1;
    EXPECT_EQ(crossing_near(mesh, moved), crossing_triangles(mesh));
  }
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

Moments everywhere() {
  Moments q = Moments::Zero();
  q[M1] = 1;
  return q;
}

/// A body's cavity, meshed on the grid and cut.
struct Twins {
  explicit Twins(const Mesh& solid, double h, const Moments& first = everywhere(), bool sharp_ridges = false) : surface(solid) {
    options.sharp_ridges = sharp_ridges;
    InnerDomainOptions domain;
    domain.wall_mm = 1.2;
    domain.ray_spacing_mm = domain.field_spacing_mm = h;
    field = inner_domain(surface, domain).field;
    options.min_cavity_mm3 = 0;
    clipped.emplace(field, surface, options, first);
  }
  SurfaceQuery surface;
  BlockField field;
  CavityOptions options;
  std::optional<detail::ClippedCavity> clipped;
};

TEST(ClippedCavity, IsTheMeshedOneWithoutItsChamfers) {
  for (const Mesh& solid : {icosphere(10, 5), rotated(l_shape(9), random_rotation(6)), torus(10, 5, 60, 40)}) {
    Twins twins(solid, 0.5);
    const Moments q = plane(bounding_box(solid).center().z() - 1, 0.3);
    const auto cut = twins.clipped->cut(q);
    ASSERT_TRUE(cut);
    BlockField field = twins.field;
    const CavityMesh meshed = mesh_cavity(field, twins.surface, q, twins.options);
    Mesh outward = cut->mesh;
    flip(outward);
    EXPECT_TRUE(is_closed_solid(outward));
    EXPECT_TRUE(crossing_triangles(outward).empty());
    EXPECT_EQ(cut->cavities, meshed.cavities);
    const double volume = -mesh_moments(cut->mesh)[M1];
    EXPECT_NEAR(volume, -mesh_moments(meshed.mesh)[M1], 0.02 * surface_area(cut->mesh));
    // Vertices lie at the wall's distance or farther, and on the plane or above it.
    for (const Eigen::Vector3d& v : cut->mesh.vertices) {
      EXPECT_GT(twins.surface.closest(v, 3).distance_mm, 1.2 * 0.985);
      EXPECT_GT(quadric_value(q, v), -0.01);  // walls are seen to after the cut
    }
  }
}

TEST(ClippedCavity, IsAsLargeAsAFineOne) {
  // Its chords cut off 0.01 mm on average, for which its vertices make up.
  Twins twins(uv_ellipsoid(14, 11, 9, 60), 0.4);
  const auto cut = twins.clipped->cut(everywhere());
  ASSERT_TRUE(cut);
  const CavityMesh fine = mesh_cavity(twins.field, twins.surface, everywhere(), twins.options);
  EXPECT_LT(cut->mesh.triangles.size(), fine.mesh.triangles.size() / 4);
  EXPECT_NEAR(mesh_moments(cut->mesh)[M1], mesh_moments(fine.mesh)[M1], 0.003 * surface_area(fine.mesh));
}

TEST(ClippedCavity, OfABoxIsABox) {
  Twins twins(box({-10, -8, 0}, {10, 8, 20}), 0.4);
  const auto cut = twins.clipped->cut(plane(7.03));
  ASSERT_TRUE(cut);
  Mesh outward = cut->mesh;
  flip(outward);
  // But for the edges of the surface at the wall's distance, chamfered by at most a cell, all of them above the cut.
  const double edges = 2 * (17.6 + 13.6) + 4 * (18.8 - 7.03);
  EXPECT_NEAR(mesh_moments(outward)[M1], 17.6 * 13.6 * (18.8 - 7.03), 0.5 * 0.4 * 0.4 * edges);
}

TEST(ClippedCavity, OfABoxHasSharpEdgesWhereverTheGridLies) {
  for (int n = 0; n < 4; ++n) {
    const Eigen::Vector3d size = Eigen::Vector3d(20, 16, 18) + 0.1 * Eigen::Vector3d(n, (3 * n) % 4, (2 * n) % 4);
    Twins twins(box({0, 0, 0}, size), 0.4, everywhere(), true);
    const auto cut = twins.clipped->cut(everywhere());
    ASSERT_TRUE(cut) << n;
    EXPECT_LT(cut->mesh.triangles.size(), 60u) << n;
    const double room = (size - Eigen::Vector3d::Constant(2.4)).prod();
    EXPECT_NEAR(-mesh_moments(cut->mesh)[M1], room, 1e-3 * room) << n;
  }
}

TEST(ClippedCavity, WhatContouringCutsOffOfSharpEdgesIsNotFoldedOverThem) {
  const std::filesystem::path path = shared_meshes() / "ADIS16480.STL";
  if (!std::filesystem::exists(path)) GTEST_SKIP() << "no shared meshes";
  Mesh solid = read_mesh(path.string()).mesh;
  const Eigen::AlignedBox3d box = bounding_box(solid);
  for (Eigen::Vector3d& p : solid.vertices) p = 110 / box.sizes().maxCoeff() * (p - box.min());
  for (const double h : {0.352, 0.354}) {  // at which edges lie just beside samples of the grid
    Twins twins(solid, h, everywhere(), true);
    const auto cut = twins.clipped->cut(everywhere());
    ASSERT_TRUE(cut) << h;
    EXPECT_EQ(cut->closed_samples, 0u) << h;
    EXPECT_LT(cut->mesh.triangles.size(), 8500u) << h;
  }
}

TEST(ClippedCavity, FollowsAsItWouldBeCut) {
  Twins twins(icosphere(12, 5), 0.5);
  Moments q = plane(-2, 0.3);
  q[MXX] = -0.02;
  q[MZZ] = 0.015;
  ASSERT_TRUE(twins.clipped->cut(q));
  q[M1] += 0.01;
  const auto followed = twins.clipped->follow(q);
  const auto cut = twins.clipped->cut(q);
  ASSERT_TRUE(followed && cut);
  EXPECT_NEAR(mesh_moments(followed->mesh)[M1], mesh_moments(cut->mesh)[M1], 0.01 * surface_area(cut->mesh));
}

TEST(ClippedCavity, KeepsTheWallWhereItWasNotToBeCutFirst) {
  for (const Mesh& solid : {rotated(l_shape(9), random_rotation(6)), torus(10, 5, 60, 40)}) {
    const Moments q = plane(bounding_box(solid).center().z(), 0.1);
    Twins twins(solid, 0.5, q);
    const SurfaceQuery surface(solid);
    for (const Moments& half : {q, Moments(-q)}) {
      const auto cut = twins.clipped->cut(half);
      ASSERT_TRUE(cut);
      EXPECT_GE(smallest_gap(cut->mesh, surface), 0.99 * 1.2);
      EXPECT_TRUE(crossing_triangles(cut->mesh).empty());
    }
  }
}

TEST(ClippedCavity, FollowsAHundredthOfAMillimetreAndKeepsTheWallAndCrossesNowhereHoweverFar) {
  const Mesh ring = torus(12, 4, 80, 30);
  for (const Mesh& solid : {rotated(l_shape(9), random_rotation(6)), torus(10, 5, 60, 40), rotated(ring, random_rotation(2))}) {
    Twins twins(solid, 0.5);
    const double middle = bounding_box(solid).center().z();
    int refused = 0;  // where a crease would be mended far, and where nothing helps; 4 where nothing is carried along
    for (const double by : {0.002, 0.01, 0.01, 0.06, 0.1, 0.15}) {
      ASSERT_TRUE(twins.clipped->cut(plane(middle, 0.3)));
      const auto cavity = twins.clipped->follow(plane(middle + by, 0.3));
      refused += !cavity;
      if (!cavity) continue;
      EXPECT_GE(smallest_gap(cavity->mesh, twins.surface), 0.985 * 1.2);
      EXPECT_TRUE(crossing_triangles(cavity->mesh).empty());
    }
    EXPECT_LE(refused, 2);
  }
}

TEST(ClippedCavity, AnEllipsoidWithinIsACavityOrAnIsland) {
  Twins twins(icosphere(12, 5), 0.5);
  Moments q = Moments::Zero();
  q[M1] = 16;
  q[MXX] = q[MYY] = q[MZZ] = -1;
  const double ball = 4.0 / 3 * kPi * 64;
  const double area = 4 * kPi * 16;
  const auto cavity = twins.clipped->cut(q);
  ASSERT_TRUE(cavity);
  EXPECT_EQ(cavity->cavities, 1u);
  EXPECT_NEAR(-mesh_moments(cavity->mesh)[M1], ball, 0.02 * area);
  q[M1] = 16.8;  // 0.1 mm more
  const auto larger = twins.clipped->follow(q);
  ASSERT_TRUE(larger);
  EXPECT_NEAR(mesh_moments(cavity->mesh)[M1] - mesh_moments(larger->mesh)[M1], 0.1 * area, 0.005 * area);
  q[M1] = 16;
  const auto around = twins.clipped->cut(-q);  // material floats in the middle, and is left out
  const CavityMesh meshed = mesh_cavity(twins.field, twins.surface, -q, twins.options);
  ASSERT_TRUE(around);
  EXPECT_EQ(around->cavities, meshed.cavities);
  EXPECT_EQ(around->removed_islands, meshed.removed_islands);
  EXPECT_EQ(around->removed_islands, 1u);
  EXPECT_NEAR(around->removed_mm3, ball, 0.02 * area);
}

TEST(ClippedCavity, WhatIsTooSmallForOneIsAccountedWhereItIsNotCutAway) {
  Twins twins(merged({icosphere(10, 4), box({20, -1.6, -10}, {23.2, 1.6, 10})}), 0.5);  // a needle of 0.8 mm in the pillar
  const double needle = 0.8 * 0.8 * 17.6;
  twins.options.min_cavity_mm3 = 3 * needle;
  twins.clipped.emplace(twins.field, twins.surface, twins.options, everywhere());
  for (const auto& [q, filled] : {std::pair{everywhere(), 1u}, {plane(-30), 1u}, {plane(0, -10), 1u}, {plane(0, 10), 0u}}) {
    const auto cut = twins.clipped->cut(q);
    BlockField field = twins.field;
    const CavityMesh meshed = mesh_cavity(field, twins.surface, q, twins.options);
    ASSERT_TRUE(cut);
    EXPECT_EQ(cut->cavities, 1u);
    EXPECT_EQ(cut->filled, filled);
    EXPECT_EQ(meshed.filled, filled);
    EXPECT_NEAR(cut->filled_mm3, filled * needle, 0.3 * needle);
    EXPECT_NEAR(cut->filled_mm3, meshed.filled_mm3, 0.3 * needle);
  }
}

TEST(ClippedCavity, ClosesWhereAPlaneGrazesItsFloorAndTheFileRoundsCoarsely) {
  Twins twins(icosphere(10, 5), 0.5);
  const auto stored_far_off = [](const Mesh& mesh) {
    const Eigen::Vector3d far(1.2e5, 1e5, 0.9e5);  // where float32 has steps of 0.008 mm
    Mesh result = mesh;
    for (Eigen::Vector3d& v : result.vertices) v = as_float32(v + far) - far;
    return result;
  };
  const BlockField untouched = twins.field;
  std::size_t closed = 0;
  for (const double slope : {0.03, 0.06})
    for (const double height : {8.77, -8.77})
      for (const double sign : {1.0, -1.0}) {
        Moments q = plane(height, slope);
        q[MY] = -0.3 * slope;
        const Moments facing = sign * q;
        twins.options.as_delivered = nullptr;
        twins.field = untouched;
        const auto exact = detail::ClippedCavity(twins.field, twins.surface, twins.options, facing).cut(facing);
        twins.options.as_delivered = stored_far_off;
        twins.field = untouched;
        const auto cut = detail::ClippedCavity(twins.field, twins.surface, twins.options, facing).cut(facing);
        ASSERT_TRUE(exact && cut);
        EXPECT_TRUE(crossing_triangles(stored_far_off(cut->mesh)).empty());
        EXPECT_GE(smallest_gap(cut->mesh, twins.surface), 0.98 * 1.2);
        EXPECT_NEAR(mesh_moments(cut->mesh)[M1], mesh_moments(exact->mesh)[M1], 0.01 * surface_area(exact->mesh));
        closed += cut->closed_samples;
      }
  EXPECT_GT(closed, 0u);
}

}  // namespace
}  // namespace rayrep
