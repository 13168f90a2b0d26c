#include <gtest/gtest.h>
#include <tbb/global_control.h>
#include <tbb/task_arena.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <map>
#include <random>
#include <set>
#include <utility>
#include <vector>

#include "mesh/crossing.h"
#include "mesh/decimate.h"
#include "mesh/edge_collapse.h"
#include "mesh/float32.h"
#include "mesh/predicates.h"
#include "rayrep/mesh/level_set.h"
#include "rayrep/mesh/surface_query.h"
#include "solids.h"

namespace rayrep {
namespace {

using Eigen::Vector3d;
using test::kPi;

DecimatedMesh within(double error_mm, const Mesh& mesh) {
  return decimated(mesh, {.chord_error_mm = error_mm, .as_delivered = {}});
}

std::map<std::pair<int, int>, std::pair<int, int>> uses_of_edges(const Mesh& mesh) {
  std::map<std::pair<int, int>, std::pair<int, int>> uses;
  for (const auto& t : mesh.triangles)
    for (int k = 0; k < 3; ++k) {
      const int a = t[k];
      const int b = t[(k + 1) % 3];
      ++(a < b ? uses[{a, b}].first : uses[{b, a}].second);
    }
  return uses;
}

int euler_characteristic(const Mesh& mesh) {
  return static_cast<int>(mesh.vertices.size()) - static_cast<int>(uses_of_edges(mesh).size()) +
         static_cast<int>(mesh.triangles.size());
}

// Every edge of two triangles that run it opposite ways; no two triangles with the same corners.
void expect_manifold(const Mesh& mesh) {
  for (const auto& [edge, uses] : uses_of_edges(mesh)) ASSERT_EQ(uses, std::make_pair(1, 1)) << edge.first << " to " << edge.second;
  std::set<std::vector<int>> corners;
  for (const auto& t : mesh.triangles) {
    std::vector<int> sorted{t[0], t[1], t[2]};
    std::sort(sorted.begin(), sorted.end());
    EXPECT_TRUE(corners.insert(sorted).second);
  }
}

void expect_no_crossing(const Mesh& mesh) {
  EXPECT_TRUE(crossing_pairs(mesh, close_pairs(mesh)).empty());
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t)
    EXPECT_FALSE(collinear(mesh.corner(t, 0), mesh.corner(t, 1), mesh.corner(t, 2))) << "triangle " << t;
}

void expect_kept(const Mesh& given, const DecimatedMesh& result) {
  ASSERT_EQ(result.kept.size(), result.mesh.vertices.size());
  EXPECT_TRUE(std::is_sorted(result.kept.begin(), result.kept.end()));
  for (std::size_t v = 0; v < result.kept.size(); ++v) EXPECT_EQ(result.mesh.vertices[v], given.vertices[result.kept[v]]);
}

// The largest distance of points from a surface, among them the corners of a grid over each triangle.
double farthest(const Mesh& from, int steps, const Mesh& to) {
  const SurfaceQuery surface(to);
  double farthest_mm = 0;
  for (std::size_t t = 0; t < from.triangles.size(); ++t)
    for (int i = 0; i <= steps; ++i)
      for (int j = 0; i + j <= steps; ++j) {
        const Vector3d p = (i * from.corner(t, 0) + j * from.corner(t, 1) + (steps - i - j) * from.corner(t, 2)) / steps;
        farthest_mm = std::max(farthest_mm, surface.closest(p, 1e3).distance_mm);
      }
  return farthest_mm;
}

double farthest_vertex(const Mesh& from, const Mesh& to) { return farthest(from, 1, to); }

// The smallest height over the longest side of a triangle.
double most_slender(const Mesh& mesh) {
  double least = 1;
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    const Vector3d a = mesh.corner(t, 1) - mesh.corner(t, 0);
    const Vector3d b = mesh.corner(t, 2) - mesh.corner(t, 0);
    least = std::min(least, a.cross(b).norm() / std::max({a.squaredNorm(), b.squaredNorm(), (a - b).squaredNorm()}));
  }
  return least;
}

// What holds for whatever is decimated.
void expect_sound(const Mesh& given, const DecimatedMesh& result, double error_mm) {
  expect_manifold(result.mesh);
  expect_no_crossing(as_float32(result.mesh));
  expect_kept(given, result);
  EXPECT_EQ(result.crossing, 0u);
  EXPECT_EQ(euler_characteristic(result.mesh), euler_characteristic(given));
  EXPECT_EQ(connected_components(result.mesh).count, connected_components(given).count);
  EXPECT_GE(most_slender(result.mesh), std::min(0.05, most_slender(given)) * (1 - 1e-9));
  EXPECT_LE(farthest_vertex(given, result.mesh), error_mm * (1 + 1e-6));
  const double area = std::max(surface_area(given), surface_area(result.mesh));
  EXPECT_LE(std::abs(mesh_moments(given)[M1] - mesh_moments(result.mesh)[M1]), error_mm * area);
}

// A ball with random waves on it, as dual contouring meshes it.
Mesh bumpy(unsigned seed, double spacing_mm) {
  std::mt19937 engine(seed);
  std::uniform_real_distribution<double> uniform(-1, 1);
  std::vector<std::pair<Vector3d, double>> waves;
  for (int n = 0; n < 12; ++n)
    waves.emplace_back(Vector3d(uniform(engine), uniform(engine), uniform(engine)), kPi * uniform(engine));
  const auto f = [&waves](const Vector3d& p) {
    double value = p.norm() - 8;
    for (const auto& [direction, phase] : waves) value += 0.25 * std::sin(1.5 * direction.dot(p) + phase);
    return value;
  };
  return mesh_implicit(f, {Vector3d::Constant(-12.05), Vector3d::Constant(12.05)}, spacing_mm);
}

// Two wavy sheets that far apart, n x n, joined along their sides.
Mesh slab(int n, double thickness_mm) {
  Mesh mesh;
  for (int side = 0; side < 2; ++side)
    for (int i = 0; i < n; ++i)
      for (int j = 0; j < n; ++j)
        mesh.vertices.emplace_back(0.1 * i, 0.1 * j,
                                   0.3 * std::sin(0.17 * i) * std::cos(0.13 * j + 0.05 * i) + (side ? thickness_mm : 0));
  const auto at = [n](int side, int i, int j) { return (side * n + i) * n + j; };
  const auto add = [&mesh](int a, int b, int c, int d) { mesh.triangles.insert(mesh.triangles.end(), {{a, b, c}, {a, c, d}}); };
  for (int i = 0; i + 1 < n; ++i)
    for (int j = 0; j + 1 < n; ++j) {
      add(at(1, i, j), at(1, i + 1, j), at(1, i + 1, j + 1), at(1, i, j + 1));
      add(at(0, i, j), at(0, i, j + 1), at(0, i + 1, j + 1), at(0, i + 1, j));
    }
  for (int k = 0; k + 1 < n; ++k) {
    add(at(0, k, 0), at(0, k + 1, 0), at(1, k + 1, 0), at(1, k, 0));
    add(at(0, k + 1, n - 1), at(0, k, n - 1), at(1, k, n - 1), at(1, k + 1, n - 1));
    add(at(0, 0, k + 1), at(0, 0, k), at(1, 0, k), at(1, 0, k + 1));
    add(at(0, n - 1, k), at(0, n - 1, k + 1), at(1, n - 1, k + 1), at(1, n - 1, k));
  }
  return mesh;
}

TEST(Decimate, ABoxIsLeftWithItsTwelveTriangles) {
  const Mesh box = test::subdivided(test::box({0, 0, 0}, {10, 7, 3}), 5);
  const DecimatedMesh result = within(1e-3, box);
  EXPECT_EQ(result.mesh.triangles.size(), 12u);
  expect_sound(box, result, 1e-9);
}

TEST(Decimate, CreasesOfOffsetSurfacesStay) {
  // The inner parallel of two boxes that overlap: edges and corners, all between planes along the axes.
  std::vector<Eigen::Vector3i> cells;
  for (int i = 0; i < 12; ++i)
    for (int j = 0; j < 12; ++j)
      for (int k = 0; k < 12; ++k)
        if (i < 6 || (j < 6 && k < 6)) cells.emplace_back(i, j, k);
  const Mesh steps = test::polycubes(cells, 0.5);
  const DecimatedMesh result = within(0.1, steps);
  expect_sound(steps, result, 1e-9);
  EXPECT_LE(result.mesh.triangles.size(), 32u);
}

// A triangle with its corners on a ball of radius R lies within e of it if its circle has a radius of sqrt(2 R e): of the best ones
// it takes 16 pi / (3 sqrt 3 ) / 2 R / e = 4.84 R / e.
TEST(Decimate, ABallTakesTrianglesAsItsRadiusOverTheError) {
  const Mesh ball = test::icosphere(10, 6);
  std::size_t before = 0;
  for (const double error : {0.32, 0.08, 0.02}) {
    SCOPED_TRACE(error);
    const DecimatedMesh result = within(error, ball);
    expect_sound(ball, result, error);
    EXPECT_LE(farthest(result.mesh, 6, ball), 1.1 * error);
    const double times_best = static_cast<double>(result.mesh.triangles.size()) / (4.84 * 10 / error);
    EXPECT_GT(times_best, 0.9);
    EXPECT_LT(times_best, 1.8);
    if (before > 0) {
      EXPECT_NEAR(static_cast<double>(result.mesh.triangles.size()) / static_cast<double>(before), 4, 0.6);
    }
    before = result.mesh.triangles.size();
  }
}

TEST(Decimate, BumpySurfacesStaySoundAndNearBothWays) {
  for (const unsigned seed : {1u, 2u}) {
    SCOPED_TRACE(seed);
    const Mesh mesh = bumpy(seed, 0.25);
    expect_manifold(mesh);
    for (const double error : {0.02, 0.3}) {
      const DecimatedMesh result = within(error, mesh);
      expect_sound(mesh, result, error);
      EXPECT_LE(farthest(mesh, 3, result.mesh), 2 * error);
      EXPECT_LE(farthest(result.mesh, 5, mesh), 2 * error);
      EXPECT_LT(result.mesh.triangles.size(), mesh.triangles.size() / 3);
    }
  }
}

TEST(Decimate, SheetsNearerThanTheErrorDoNotCross) {
  for (const double thickness : {0.1, 0.01, 0.001}) {
    SCOPED_TRACE(thickness);
    const Mesh mesh = slab(60, thickness);
    expect_manifold(mesh);
    expect_no_crossing(as_float32(mesh));
    const DecimatedMesh result = within(0.05, mesh);
    expect_sound(mesh, result, 0.05);
    if (thickness >= 0.01) {
      EXPECT_LT(result.mesh.triangles.size(), mesh.triangles.size() / 2);
    }
  }
}

TEST(Decimate, KeepsHandlesAndComponents) {
  const Mesh torus = test::torus(10, 3, 120, 60);
  const DecimatedMesh result = within(0.1, torus);
  expect_sound(torus, result, 0.1);
  EXPECT_EQ(euler_characteristic(result.mesh), 0);

  // Far coarser than the tube: only that it stays a torus holds it.
  expect_sound(torus, within(2.0, torus), 2.0);

  Mesh two = torus;
  append(two, test::icosphere(2, 4));
  Mesh room = test::icosphere(1, 4);
  flip(room);
  append(two, room);
  expect_sound(two, within(0.1, two), 0.1);
}

TEST(Decimate, IsTheSameForAnyNumberOfThreads) {
  const Mesh mesh = test::icosphere(10, 6);
  ASSERT_GT(mesh.vertices.size(), 40000u) << "of many parts that are worked on at once";
  DecimatedMesh alone;
  tbb::task_arena(1).execute([&] { alone = within(0.01, mesh); });
  const tbb::global_control more(tbb::global_control::max_allowed_parallelism, 8);
  DecimatedMesh together;
  tbb::task_arena(8).execute([&] { together = within(0.01, mesh); });
  EXPECT_EQ(alone.kept, together.kept);
  EXPECT_EQ(alone.mesh.triangles, together.mesh.triangles);
  expect_sound(mesh, together, 0.01);
}

TEST(Decimate, SeamsOfItsPartsDoNotShow) {
  // A ball is the same everywhere: so many triangles as one that is a single part, by their size.
  std::size_t before = 0;
  for (const int subdivisions : {5, 6}) {
    const std::size_t triangles = within(0.05, test::icosphere(10, subdivisions)).mesh.triangles.size();
    if (before > 0) {
      EXPECT_NEAR(static_cast<double>(triangles), static_cast<double>(before), 0.1 * static_cast<double>(before));
    }
    before = triangles;
  }
}

TEST(Decimate, HoldsWhenCoordinatesAreRounded) {
  Mesh mesh = bumpy(6, 0.25);
  for (Vector3d& v : mesh.vertices) v += Vector3d(3e4, -2e4, 1e4);  // neighbouring float32 values are 0.002 mm apart
  const DecimatedMesh result = within(0.02, mesh);
  expect_sound(mesh, result, 0.02);
}

TEST(Decimate, LooksAtTheMeshAsDelivered) {
  // Delivered flat: everything that lies on each other crosses.
  const Mesh ball = test::icosphere(1, 3);
  const auto flat = [](const Mesh& mesh) {
    Mesh result = mesh;
    for (Vector3d& v : result.vertices) v.z() = 0;
    return result;
  };
  EXPECT_GT(decimated(ball, {.chord_error_mm = 0.05, .as_delivered = flat}).crossing, 0u);
  EXPECT_EQ(within(0.05, ball).crossing, 0u);
}

TEST(Decimate, EdgesOfFourTrianglesStay) {
  const Mesh cubes = test::subdivided(test::polycubes({{0, 0, 0}, {1, 1, 0}}), 4);
  const DecimatedMesh result = within(0.01, cubes);
  expect_kept(cubes, result);
  std::size_t of_four = 0;
  for (const auto& [edge, uses] : uses_of_edges(result.mesh)) {
    EXPECT_EQ(uses.first, uses.second);
    of_four += uses.first == 2;
  }
  EXPECT_EQ(of_four, 16u);
  EXPECT_LT(result.mesh.triangles.size(), 200u);
  EXPECT_LE(farthest_vertex(cubes, result.mesh), 1e-9);
}

TEST(Decimate, WhatCrossesInTheGivenMeshIsCounted) {
  Mesh mesh = test::icosphere(5, 4);
  append(mesh, test::icosphere(5, 4, {6, 0.1, 0.2}));
  const DecimatedMesh result = within(0.02, mesh);
  EXPECT_GT(result.crossing, 10u);
  expect_manifold(result.mesh);
  EXPECT_LE(farthest_vertex(mesh, result.mesh), 0.02 + 1e-9);
}

TEST(Decimate, WithoutAnErrorTakesOnlyWhatIsFlat) {
  const Mesh ball = test::icosphere(3, 3);
  EXPECT_EQ(within(0, ball).mesh.triangles, ball.triangles);
  const Mesh box = test::subdivided(test::box({0, 0, 0}, {4, 2, 8}), 4);
  EXPECT_EQ(within(0, box).mesh.triangles.size(), 12u);
}

TEST(Decimate, NothingAndATetrahedronStay) {
  EXPECT_TRUE(decimated({}).mesh.triangles.empty());
  const Mesh tetrahedron = test::unit_tetrahedron();
  EXPECT_EQ(within(10, tetrahedron).mesh.triangles, tetrahedron.triangles);
}

TEST(Decimate, IsInterrupted) {
  EXPECT_THROW(decimated(test::icosphere(1, 4), {}, {.stage = {}, .cancelled = [] { return true; }}), Error);
}

double shortest_edge(const Mesh& mesh) {
  double shortest = HUGE_VAL;
  for (const auto& [edge, uses] : uses_of_edges(mesh))
    shortest = std::min(shortest, (mesh.vertices[edge.first] - mesh.vertices[edge.second]).norm());
  return shortest;
}

TEST(CollapseShortEdges, LeavesNoneWhereTheSurfaceIsSmooth) {
  const Mesh given = bumpy(7, 0.3);
  EXPECT_LT(shortest_edge(given), 0.1);
  Mesh mesh = given;
  const std::vector<int> kept = collapse_short_edges(mesh, 0.15);
  EXPECT_GE(shortest_edge(mesh), 0.15);
  expect_manifold(mesh);
  EXPECT_EQ(euler_characteristic(mesh), euler_characteristic(given));
  EXPECT_LE(farthest_vertex(given, mesh), 0.15);
  ASSERT_EQ(kept.size(), mesh.vertices.size());
  for (std::size_t v = 0; v < kept.size(); ++v) EXPECT_EQ(mesh.vertices[v], given.vertices[kept[v]]);
}

TEST(CollapseShortEdges, FixedVerticesStay) {
  const Mesh given = test::icosphere(1, 4);
  std::vector<char> fixed(given.vertices.size());
  std::size_t count = 0;
  for (std::size_t v = 0; v < fixed.size(); ++v) count += fixed[v] = given.vertices[v].z() > 0.5;
  Mesh mesh = given;
  const std::vector<int> kept = collapse_short_edges(mesh, 0.12, fixed);
  EXPECT_EQ(std::count_if(kept.begin(), kept.end(), [&](int v) { return fixed[v] != 0; }), static_cast<std::ptrdiff_t>(count));
  EXPECT_LT(mesh.vertices.size(), given.vertices.size());
  std::size_t free = 0;
  std::size_t still_short = 0;
  for (const auto& [edge, uses] : uses_of_edges(mesh)) {
    if (fixed[kept[edge.first]] && fixed[kept[edge.second]]) continue;
    ++free;
    still_short += (mesh.vertices[edge.first] - mesh.vertices[edge.second]).norm() < 0.12;
  }
  EXPECT_LE(still_short, free / 100) << "of " << free;
  expect_manifold(mesh);
  EXPECT_EQ(euler_characteristic(mesh), 2);
}

}  // namespace
}  // namespace rayrep
