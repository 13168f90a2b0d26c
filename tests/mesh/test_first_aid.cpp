// Surfaces broken the way exporters break them, and what first aid makes of them.

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <map>
#include <numeric>
#include <string>
#include <vector>

#include "mesh/point_tree.h"
#include "mesh/polygon.h"
#include "places.h"
#include "rayrep/base/error.h"
#include "rayrep/io/mesh_io.h"
#include "rayrep/mesh/mesh_check.h"
#include "solids.h"

namespace rayrep {
namespace {

using Eigen::Vector3d;
using Eigen::Vector3i;
using namespace test;

double volume(const Mesh& mesh) { return mesh_moments(mesh)[M1]; }

double diagonal(const Mesh& mesh) { return bounding_box(mesh).diagonal().norm(); }

std::string told(const MeshReport& report) {
  std::string text = report.refusal;
  for (const std::string& note : report.notes) text += " " + note;
  return text;
}

/// The triangles by their coordinates, whatever their order and numbers.
std::vector<std::array<double, 9>> triangles_of(const Mesh& mesh) {
  std::vector<std::array<double, 9>> all;
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    std::array<std::array<double, 9>, 3> turns;
    for (int turn = 0; turn < 3; ++turn)
      for (int k = 0; k < 3; ++k)
        for (int n = 0; n < 3; ++n)
          turns[static_cast<std::size_t>(turn)][static_cast<std::size_t>(3 * k + n)] = mesh.corner(t, (turn + k) % 3)[n] + 0.0;
    all.push_back(*std::min_element(turns.begin(), turns.end()));
  }
  std::sort(all.begin(), all.end());
  return all;
}

/// The same triangles in another order, each from another corner on, as a soup or with shared vertices.
Mesh shuffled(const Mesh& mesh, Random& random) {
  Mesh result = random.uniform() < 0.5 ? soup(mesh) : mesh;
  for (std::size_t n = result.triangles.size(); n > 1; --n) {
    const auto other = static_cast<std::size_t>(random.uniform(0, static_cast<double>(n)));
    std::swap(result.triangles[n - 1], result.triangles[other]);
  }
  for (Vector3i& t : result.triangles)
    for (int turns = static_cast<int>(random.uniform(0, 3)); turns > 0; --turns) t = Vector3i(t[1], t[2], t[0]);
  return result;
}

Mesh placed(const Mesh& mesh, Random& random, std::uint64_t seed) {
  const Mesh turned = seed % 3 == 0 ? mesh : rotated(mesh, random_rotation(seed));
  const double scale = std::pow(10, random.uniform(-2, 3));
  return moved(scaled(turned, scale), scale * random.in_box(seed % 2 ? 10 : 0));
}

/// A tube around z, its ends rings.
Mesh tube(double outside, double inside, double height, int n) {
  const auto wall = [&](double radius) {
    Mesh mesh = cylinder(radius, height, n);
    std::erase_if(mesh.triangles, [](const Vector3i& t) { return t.minCoeff() < 2; });
    return mesh;
  };
  Mesh mesh = merged({wall(outside), flipped(wall(inside))});
  const int m = 2 + 2 * n;  // vertices of each: two middles, the ring below, the ring above
  for (int j = 0; j < n; ++j) {
    const int k = (j + 1) % n;
    mesh.triangles.insert(mesh.triangles.end(), {{2 + k, 2 + j, m + 2 + j}, {2 + k, m + 2 + j, m + 2 + k}});
    mesh.triangles.insert(mesh.triangles.end(), {{2 + n + j, 2 + n + k, m + 2 + n + k}, {2 + n + j, m + 2 + n + k, m + 2 + n + j}});
  }
  return mesh;
}

Mesh solid(std::uint64_t seed) {
  switch (seed % 7) {
    case 0:
      return subdivided(box({0, 0, 0}, {4, 3, 2}), 1);
    case 1:
      return icosphere(2, 3);
    case 2:
      return torus(3, 1, 24, 12);
    case 3:
      return cylinder(1.5, 4, 20);
    case 4:
      return staircase(3);
    case 5:
      return hollow(box({0, 0, 0}, {4, 4, 4}), icosphere(1, 1, {2, 2, 2}));
    default:
      return tube(2, 1.2, 3, 17);
  }
}

// ------------------------------------------------------------------------------------------------------------ ways to break

/// Every corner of every triangle for itself, off by up to `relative` of the diagonal.
Mesh jittered(const Mesh& mesh, double relative, Random& random) {
  Mesh result = soup(mesh);
  const double most = relative * diagonal(mesh) / std::sqrt(12.0);
  for (Vector3d& v : result.vertices) v += random.in_box(most);
  return result;
}

/// Some triangles split at points on one of their sides, the neighbour not.
Mesh with_t_junctions(Mesh mesh, int times, Random& random) {
  for (; times > 0; --times) {
    const auto t = static_cast<std::size_t>(random.uniform(0, static_cast<double>(mesh.triangles.size())));
    const int k = static_cast<int>(random.uniform(0, 3));
    const Vector3i v = mesh.triangles[t];
    const int a = v[k], b = v[(k + 1) % 3], c = v[(k + 2) % 3];
    const int middle = static_cast<int>(mesh.vertices.size());
    mesh.vertices.push_back(mesh.vertices[a] + random.uniform(0.2, 0.8) * (mesh.vertices[b] - mesh.vertices[a]));
    mesh.triangles[t] = {a, middle, c};
    mesh.triangles.emplace_back(middle, b, c);
  }
  return mesh;
}

/// Single triangles in the box and around it, far from each other.
Mesh with_strays(Mesh mesh, int times, Random& random) {
  const Eigen::AlignedBox3d box = bounding_box(mesh);
  const double size = 0.02 * box.diagonal().norm();
  for (int n = 0; n < times; ++n) {
    const Vector3d at = box.center() + (1 + 0.3 * n) * box.diagonal().norm() * random.direction();
    const int first = static_cast<int>(mesh.vertices.size());
    for (int k = 0; k < 3; ++k) mesh.vertices.push_back(at + random.in_box(size));
    mesh.triangles.emplace_back(first, first + 1, first + 2);
  }
  return mesh;
}

/// The surface around a ring of vertices given by a predicate on triangles: those for which it holds, gone.
template <typename Gone>
Mesh without(Mesh mesh, const Gone& gone) {
  std::size_t kept = 0;
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t)
    if (!gone(t)) mesh.triangles[kept++] = mesh.triangles[t];
  mesh.triangles.resize(kept);
  return mesh;
}

/// What first aid has to be, whatever it does.
CheckedMesh expect_mended(const Mesh& broken, double expected_volume, double relative, Random& random) {
  const CheckedMesh checked = check_mesh(broken);
  EXPECT_TRUE(checked.report.usable) << checked.report.refusal;
  if (!checked.report.usable) return checked;
  EXPECT_TRUE(checked.report.first_aid) << told(checked.report);
  EXPECT_FALSE(checked.report.first_aid.repaired);
  EXPECT_TRUE(is_closed_solid(checked.mesh));
  EXPECT_NEAR(volume(checked.mesh) / expected_volume, 1, relative) << told(checked.report);
  const CheckedMesh again = check_mesh(checked.mesh);
  EXPECT_FALSE(again.report.first_aid);
  EXPECT_TRUE(triangles_of(again.mesh) == triangles_of(checked.mesh));
  EXPECT_TRUE(triangles_of(check_mesh(shuffled(broken, random)).mesh) == triangles_of(checked.mesh));
  return checked;
}

// --------------------------------------------------------------------------------------------------------------------- laws

TEST(FirstAid, ClosedSurfacesPassBitForBit) {
  const CheckOptions without_aid{.first_aid = false};
  Random random(1);
  std::vector<Mesh> meshes = {merged({box({0, 0, 0}, {2, 2, 2}), box({2, 0, 0}, {3, 2, 2})}),               // touching
                              merged({icosphere(2, 2), icosphere(2, 2)}),                                   // twice
                              hollow(hollow(icosphere(3, 2), icosphere(1, 1)), icosphere(0.5, 1)),          // shells in shells
                              hollow(box({0, 0, 0}, {1, 1, 1}), box({1e-7, 1e-7, 1e-7}, {0.5, 0.5, 0.5})),  // a very thin wall
                              scaled(icosphere(1, 1), 1e-9)};
  for (std::uint64_t seed = 0; seed < 40; ++seed) meshes.push_back(shuffled(placed(solid(seed), random, seed), random));
  for (const Mesh& mesh : meshes) {
    const CheckedMesh checked = check_mesh(mesh);
    const CheckedMesh plain = check_mesh(mesh, without_aid);
    EXPECT_FALSE(checked.report.first_aid);
    EXPECT_TRUE(checked.mesh.vertices == plain.mesh.vertices);
    EXPECT_TRUE(checked.mesh.triangles == plain.mesh.triangles);
    EXPECT_EQ(checked.report.notes, plain.report.notes);
  }
}

TEST(FirstAid, JoinsCornersThatDifferInTheirLastDigits) {
  Random random(2);
  for (std::uint64_t seed = 0; seed < 60; ++seed) {
    SCOPED_TRACE(seed);
    const Mesh mesh = placed(solid(seed), random, seed);
    const double relative = std::pow(10, random.uniform(-9, -5.5));
    const CheckedMesh checked = expect_mended(jittered(mesh, relative, random), volume(mesh), 100 * relative + 1e-9, random);
    EXPECT_EQ(checked.mesh.triangles.size(), mesh.triangles.size());
    EXPECT_GT(checked.report.first_aid.corners_joined, 0u);
    EXPECT_EQ(checked.report.first_aid.sides_split, 0u) << told(checked.report);
    EXPECT_LE(checked.report.first_aid.joined_within, 1.01e-5 * diagonal(mesh));
  }
}

TEST(FirstAid, SplitsSidesAtCornersThatLieOnThem) {
  Random random(3);
  for (std::uint64_t seed = 0; seed < 60; ++seed) {
    SCOPED_TRACE(seed);
    const Mesh mesh = placed(solid(seed), random, seed);
    const Mesh broken = with_t_junctions(mesh, 1 + static_cast<int>(seed % 40), random);
    const CheckedMesh checked = expect_mended(broken, volume(mesh), 1e-9, random);
    EXPECT_GT(checked.report.first_aid.sides_split, 0u);
    EXPECT_EQ(checked.report.first_aid.triangles_dropped, 0u);
    EXPECT_EQ(checked.report.first_aid.holes_closed, 0u) << told(checked.report);
    expect_mended(jittered(broken, 1e-7, random), volume(mesh), 1e-5, random);
  }
}

TEST(FirstAid, LeavesOutStrayTriangles) {
  Random random(4);
  for (std::uint64_t seed = 0; seed < 60; ++seed) {
    SCOPED_TRACE(seed);
    const Mesh mesh = placed(solid(seed), random, seed);
    const int strays = 1 + static_cast<int>(seed % 3);
    const CheckedMesh checked = expect_mended(with_strays(mesh, strays, random), volume(mesh), 1e-12, random);
    EXPECT_EQ(checked.report.first_aid.triangles_dropped, static_cast<std::size_t>(strays));
    EXPECT_TRUE(triangles_of(checked.mesh) == triangles_of(mesh));
  }
}

TEST(FirstAid, LeavesOutAFlatFin) {
  Mesh mesh = box({0, 0, 0}, {1, 1, 1});
  mesh.vertices.emplace_back(2, 2, 2);
  mesh.triangles.emplace_back(1, 3, 8);
  Random random(5);
  const CheckedMesh checked = expect_mended(mesh, 1, 1e-15, random);
  EXPECT_EQ(checked.report.first_aid.triangles_dropped, 1u);
  EXPECT_TRUE(mentions(told(checked.report), {"1 flat sheet without thickness (1 triangle), the first near"}));
}

TEST(FirstAid, LeavesOutWallsInside) {
  Random random(6);
  for (std::uint64_t seed = 0; seed < 60; ++seed) {
    SCOPED_TRACE(seed);
    const int nu = 24, nv = 12;
    const Mesh ring = placed(torus(3, 1, nu, nv), random, seed);
    Mesh mesh = ring;
    const int walls = 1 + static_cast<int>(seed % 3);
    for (int w = 0; w < walls; ++w) {
      std::vector<int> loop(nv);
      std::iota(loop.begin(), loop.end(), (w * 7 + static_cast<int>(seed)) % nu * nv);
      if (random.uniform() < 0.5) std::reverse(loop.begin(), loop.end());
      append_triangulated(loop, mesh);
    }
    const CheckedMesh checked = expect_mended(mesh, volume(ring), 1e-12, random);
    EXPECT_EQ(checked.report.first_aid.sheets_dropped, static_cast<std::size_t>(walls));
    EXPECT_TRUE(triangles_of(checked.mesh) == triangles_of(ring));
    EXPECT_TRUE(mentions(told(checked.report), {"inside the material"}));
  }
}

TEST(FirstAid, LeavesOutWallsThatCross) {
  const Mesh block = polycubes({{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {1, 1, 0}}, 3);
  Random random(16);
  for (int turned = 0; turned < 4; ++turned) {
    Mesh mesh = block;
    const auto add = [&](const std::array<Vector3d, 4>& corners, bool back) {
      std::vector<int> loop;
      for (const Vector3d& p : corners)
        loop.push_back(static_cast<int>(std::find(mesh.vertices.begin(), mesh.vertices.end(), 3 * p) - mesh.vertices.begin()));
      if (back) std::reverse(loop.begin(), loop.end());
      append_triangulated(loop, mesh);
    };
    for (int n = 0; n < 2; ++n) {
      add({Vector3d(1, n, 0), Vector3d(1, n + 1, 0), Vector3d(1, n + 1, 1), Vector3d(1, n, 1)}, turned % 2 == 1);
      add({Vector3d(n, 1, 0), Vector3d(n + 1, 1, 0), Vector3d(n + 1, 1, 1), Vector3d(n, 1, 1)}, turned / 2 == 1);
    }
    const CheckedMesh checked =
        expect_mended(rotated(mesh, random_rotation(static_cast<std::uint64_t>(turned))), 108, 1e-9, random);
    EXPECT_EQ(checked.mesh.triangles.size(), block.triangles.size());
  }
}

TEST(FirstAid, LeavesOutSheetsThatTouchNothing) {
  Random random(17);
  const auto sheet = [](double at, double from, double to) {
    Mesh mesh;
    mesh.vertices = {{from, from, at}, {to, from, at}, {to, to, at}, {from, to, at}};
    mesh.triangles = {{0, 1, 2}, {0, 2, 3}};
    return mesh;
  };
  const Mesh cube = box({0, 0, 0}, {10, 10, 10});
  expect_mended(merged({cube, sheet(5, 0, 10)}), 1000, 1e-12, random);    // a wall whose rim lies in the faces
  expect_mended(merged({cube, sheet(5, 3, 7)}), 1000, 1e-12, random);     // inside
  expect_mended(merged({cube, sheet(5, -10, 20)}), 1000, 1e-12, random);  // across
  expect_mended(merged({cube, sheet(0, -20, 40)}), 1000, 1e-12, random);  // the ground
}

TEST(FirstAid, CornersFartherApart) {
  Random random(18);
  for (std::uint64_t seed = 0; seed < 14; ++seed) {
    SCOPED_TRACE(seed);
    const Mesh mesh = placed(solid(seed), random, seed);
    expect_mended(jittered(mesh, 5e-5, random), volume(mesh), 1e-3, random);
    const Mesh broken = jittered(mesh, 7e-4, random);
    const CheckedMesh refused = check_mesh(broken);
    EXPECT_FALSE(refused.report.usable);
    EXPECT_TRUE(refused.report.repairable) << refused.report.refusal;
    EXPECT_TRUE(mentions(refused.report.refusal, {"--repair closes the surface by a guess: it joins "}));
    const CheckedMesh repaired = check_mesh(broken, {.repair = true});
    EXPECT_TRUE(repaired.report.first_aid.repaired);
    EXPECT_NEAR(volume(repaired.mesh) / volume(mesh), 1, 1e-2);
  }
}

TEST(FirstAid, AStrayFarAwayDoesNotDrawABodyTogether) {
  Random random(19);
  Mesh mesh = jittered(icosphere(1, 5), 1e-7, random);
  const Mesh triangle = moved(unit_tetrahedron(), {1e7, 0, 0});
  append(mesh, triangle);
  mesh.triangles.resize(mesh.triangles.size() - 3);
  const CheckedMesh checked = check_mesh(mesh);
  if (checked.report.usable) {
    EXPECT_NEAR(volume(checked.mesh) / volume(icosphere(1, 5)), 1, 1e-5);
  }
}

TEST(FirstAid, ALidOverAHollow) {
  // Which of lid and hollow is surface the lid's way round tells: the solid is where the winding number is positive.
  const Mesh bowl = polycubes({{0, 0, 0},
                               {1, 0, 0},
                               {2, 0, 0},
                               {0, 0, 1},
                               {2, 0, 1},
                               {0, 1, 0},
                               {1, 1, 0},
                               {2, 1, 0},
                               {0, 1, 1},
                               {1, 1, 1},
                               {2, 1, 1},
                               {0, -1, 0},
                               {1, -1, 0},
                               {2, -1, 0},
                               {0, -1, 1},
                               {1, -1, 1},
                               {2, -1, 1}});
  std::vector<int> mouth;
  for (const Vector3d& p : {Vector3d(1, 0, 2), Vector3d(2, 0, 2), Vector3d(2, 1, 2), Vector3d(1, 1, 2)})
    mouth.push_back(static_cast<int>(std::find(bowl.vertices.begin(), bowl.vertices.end(), p) - bowl.vertices.begin()));
  Random random(7);
  Mesh lid_up = bowl;
  append_triangulated(mouth, lid_up);
  expect_mended(lid_up, 18, 1e-12, random);  // closes the outer surface: the hollow is inside
  Mesh lid_down = bowl;
  std::reverse(mouth.begin(), mouth.end());
  append_triangulated(mouth, lid_down);
  expect_mended(lid_down, 17, 1e-12, random);  // a sheet over the hollow
}

TEST(FirstAid, ClosesFlatEnds) {
  Random random(8);
  for (std::uint64_t seed = 0; seed < 40; ++seed) {
    SCOPED_TRACE(seed);
    const bool hollow_end = seed % 2 == 0;
    const int n = 3 + static_cast<int>(random.uniform(0, 60));
    const Mesh whole = hollow_end ? tube(2, 1.3, 3, n) : cylinder(2, 3, n);
    const bool both = random.uniform() < 0.5;
    const Mesh open = without(whole, [&](std::size_t t) {
      double low = 3, high = 0;
      for (int k = 0; k < 3; ++k) {
        low = std::min(low, whole.corner(t, k).z());
        high = std::max(high, whole.corner(t, k).z());
      }
      return high == 0 || (both && low == 3);
    });
    const Mesh broken = placed(open, random, seed);
    const double scale3 = std::pow(diagonal(broken) / diagonal(open), 3);
    const double expected = volume(whole) * (seed % 3 == 0 ? scale3 : 1);
    const CheckedMesh checked = check_mesh(broken);
    ASSERT_TRUE(checked.report.usable) << checked.report.refusal;
    EXPECT_EQ(checked.report.first_aid.holes_closed, (both ? 2u : 1u) * (hollow_end ? 2u : 1u));
    EXPECT_EQ(connected_components(checked.mesh).count, 1);
    EXPECT_EQ(checked.report.cavities, 0u);
    EXPECT_EQ(checked.report.self_intersections.count, 0u) << told(checked.report);
    if (seed % 3 == 0) expect_mended(broken, expected, 1e-9, random);
  }
}

TEST(FirstAid, AFlatEndWithManyOpenings) {
  // A plate with 5 x 5 square bores, all of whose one side is missing; the bores end in it.
  std::vector<Vector3i> cells;
  for (int i = 0; i < 11; ++i)
    for (int j = 0; j < 11; ++j)
      if (i % 2 == 0 || j % 2 == 0) cells.emplace_back(i, j, 0);
  const Mesh whole = polycubes(cells);
  const Mesh open = without(whole, [&](std::size_t t) {
    return whole.corner(t, 0).z() == 1 && whole.corner(t, 1).z() == 1 && whole.corner(t, 2).z() == 1;
  });
  Random random(9);
  for (std::uint64_t seed = 0; seed < 6; ++seed) {
    SCOPED_TRACE(seed);
    const CheckedMesh checked = expect_mended(seed == 0 ? open : rotated(open, random_rotation(seed)), 96, 1e-9, random);
    EXPECT_EQ(checked.report.first_aid.holes_closed, 26u);
    if (seed == 0) {
      EXPECT_EQ(checked.report.self_intersections.count, 0u) << told(checked.report);
    }
    EXPECT_NEAR(checked.report.first_aid.surface_change, 96.0 / (96 + 96 + 44 + 100), 1e-9);
  }
}

TEST(FirstAid, ClosesSmallHoles) {
  Random random(10);
  const Mesh sphere = icosphere(1, 6);
  for (std::uint64_t seed = 0; seed < 8; ++seed) {
    SCOPED_TRACE(seed);
    const Mesh mesh = placed(sphere, random, seed);
    const auto every = static_cast<std::size_t>(random.uniform(500, 5000));
    const Mesh broken = without(mesh, [&](std::size_t t) { return t % every < 2; });
    const CheckedMesh checked = expect_mended(broken, volume(mesh), 1e-4, random);
    EXPECT_GT(checked.report.first_aid.holes_closed, 10u);
  }
}

TEST(FirstAid, AllAtOnce) {
  Random random(11);
  for (std::uint64_t seed = 0; seed < 40; ++seed) {
    SCOPED_TRACE(seed);
    const Mesh mesh = placed(solid(seed), random, seed);
    Mesh broken = with_strays(with_t_junctions(mesh, 5, random), 1, random);
    const auto gone = static_cast<std::size_t>(random.uniform(0, static_cast<double>(mesh.triangles.size())));
    broken = jittered(without(broken, [gone](std::size_t t) { return t == gone; }), 1e-7, random);
    expect_mended(broken, volume(mesh), 1e-5, random);
  }
}

// ----------------------------------------------------------------------------------------------------------- what is refused

/// A sphere with a bent opening: its triangles in a wavy cap are gone.
Mesh opened_sphere(double level) {
  const Mesh sphere = icosphere(10, 4);
  return without(sphere, [&](std::size_t t) {
    const Vector3d p = (sphere.corner(t, 0) + sphere.corner(t, 1) + sphere.corner(t, 2)) / 3;
    return p.z() > level + std::cos(2 * std::atan2(p.y(), p.x()));
  });
}

TEST(FirstAid, ABentHoleIsClosedOnRequestOnly) {
  for (const double level : {5.0, 7.0, 8.5}) {
    const Mesh open = opened_sphere(level);
    const CheckedMesh refused = check_mesh(open);
    EXPECT_FALSE(refused.report.usable);
    EXPECT_TRUE(refused.report.repairable);
    EXPECT_FALSE(refused.report.first_aid);
    EXPECT_TRUE(triangles_of(refused.mesh) == triangles_of(open));
    EXPECT_TRUE(mentions(refused.report.refusal, {"1 hole that is neither flat nor small", " around, near (",
                                                  "--repair closes the surface by a guess: it closes 1 hole: "}));

    const CheckedMesh repaired = check_mesh(open, {.repair = true});
    ASSERT_TRUE(repaired.report.usable) << repaired.report.refusal;
    EXPECT_TRUE(repaired.report.first_aid.repaired);
    EXPECT_TRUE(is_closed_solid(repaired.mesh));
    EXPECT_TRUE(mentions(told(repaired.report), {"Repair: 1 hole was closed by", "The volume has changed by"}));
    // Between the sphere without the highest possible cap, and the sphere.
    const double h = 10 - level + 1.5;
    EXPECT_GT(volume(repaired.mesh), volume(icosphere(10, 4)) - kPi * h * h * (30 - h) / 3);
    EXPECT_LT(volume(repaired.mesh), volume(icosphere(10, 4)));
    EXPECT_FALSE(check_mesh(repaired.mesh).report.first_aid);
  }
}

TEST(FirstAid, RepairOfALargeHoleIsNoLargerThanNeeded) {
  // A saddle-shaped rim of 600 vertices on a cylinder: no surface is smaller than half of what closes it from its middle.
  const int n = 600;
  Mesh mesh;
  mesh.vertices.emplace_back(0, 0, -5);
  for (int j = 0; j < n; ++j) {
    const double angle = 2 * kPi * j / n;
    mesh.vertices.emplace_back(5 * std::cos(angle), 5 * std::sin(angle), std::sin(2 * angle));
  }
  for (int j = 0; j < n; ++j) mesh.triangles.emplace_back(0, 1 + (j + 1) % n, 1 + j);
  const CheckedMesh repaired = check_mesh(mesh, {.repair = true});
  ASSERT_TRUE(repaired.report.usable) << repaired.report.refusal;
  EXPECT_EQ(repaired.report.first_aid.triangles_added, static_cast<std::size_t>(n - 2));
  double area = 0;
  for (std::size_t t = static_cast<std::size_t>(n); t < repaired.mesh.triangles.size(); ++t)
    area += 0.5 * (repaired.mesh.corner(t, 1) - repaired.mesh.corner(t, 0))
                      .cross(repaired.mesh.corner(t, 2) - repaired.mesh.corner(t, 0))
                      .norm();
  EXPECT_GT(area, kPi * 25);
  EXPECT_LT(area, 1.3 * kPi * 25);
}

TEST(FirstAid, FacesThatBelongTogetherAreNoStrays) {
  // Six squares a little apart, beside a closed body: leaving them out would lose a box.
  Mesh mesh = box({0, 0, 0}, {10, 10, 10});
  Mesh other = soup(box({20, 0, 0}, {22, 2, 2}));
  for (std::size_t t = 0; t < other.triangles.size(); t += 2)
    for (std::size_t n = 3 * t; n < 3 * t + 6; ++n) {
      const Vector3d normal = (other.corner(t, 1) - other.corner(t, 0)).cross(other.corner(t, 2) - other.corner(t, 0)).normalized();
      other.vertices[n] += 0.002 * normal;
    }
  append(mesh, other);
  const CheckedMesh checked = check_mesh(mesh);
  EXPECT_FALSE(checked.report.usable);
  EXPECT_FALSE(checked.report.first_aid);
}

TEST(FirstAid, FlatSheetsAloneAreNoBody) {
  Mesh sheet;
  sheet.vertices = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}};
  sheet.triangles = {{0, 1, 2}, {0, 2, 3}};
  for (const bool repair : {false, true}) {
    const CheckedMesh checked = check_mesh(sheet, {.repair = repair});
    EXPECT_FALSE(checked.report.usable);
    EXPECT_FALSE(checked.report.repairable);
    EXPECT_TRUE(mentions(checked.report.refusal, {"leaves pieces without thickness", "Repair the model"}));
  }
}

// ----------------------------------------------------------------------------------------------------------------- the rest

TEST(FirstAid, DoesNotDependOnTheNumberOfThreads) {
  Random random(12);
  const Mesh broken = jittered(with_t_junctions(icosphere(3, 4), 100, random), 1e-7, random);
  std::vector<Mesh> results;
  for (const int threads : {1, 3}) {
    tbb::global_control control(tbb::global_control::max_allowed_parallelism, static_cast<std::size_t>(threads));
    results.push_back(check_mesh(broken).mesh);
  }
  EXPECT_TRUE(results[0].vertices == results[1].vertices);
  EXPECT_TRUE(results[0].triangles == results[1].triangles);
}

TEST(FirstAid, StopsWhenAsked) {
  Random random(13);
  const Mesh broken = jittered(icosphere(3, 3), 1e-7, random);
  int polls = 0;
  Progress count;
  count.cancelled = [&polls] { return ++polls < 0; };
  check_mesh(broken, {}, count);
  for (int after = 0; after < polls; ++after) {
    Progress stop;
    int left = after;
    stop.cancelled = [&left] { return left-- == 0; };
    EXPECT_TRUE(mentions(message_of([&] { check_mesh(broken, {}, stop); }, ErrorCode::interrupted), {"Interrupted"}));
  }
  EXPECT_GT(polls, 5);
}

TEST(PointTree, FindsWhatIsNearASegment) {
  Random random(14);
  std::vector<Vector3d> points;
  for (int n = 0; n < 2000; ++n) points.push_back(n % 3 ? random.in_box(1) : Vector3d(0.01 * random.in_box(1)));
  std::vector<int> members;
  for (int n = 0; n < 2000; n += 2) members.push_back(n);
  const PointTree tree(points, members);
  std::vector<int> found;
  for (int n = 0; n < 300; ++n) {
    Vector3d a = random.in_box(1.2), b = random.in_box(1.2);
    if (n % 3 == 0) b = a;
    if (n % 3 == 1) b[n % 2] = a[n % 2];
    const double reach = std::pow(10, random.uniform(-3, 0));
    tree.near_segment(a, b, reach, found);
    std::vector<int> expected;
    for (const int m : members)
      if (on_segment(points[static_cast<std::size_t>(m)], a, b).distance <= reach) expected.push_back(m);
    EXPECT_EQ(found, expected) << n;
  }
  PointTree(points, {}).near_segment(points[0], points[1], 1, found);
  EXPECT_TRUE(found.empty());
}

TEST(SharedCases, MeshesThatEverySlicerPrints) {
  const std::filesystem::path cases = test::shared_meshes() / ".." / "cases";
  if (!std::filesystem::exists(cases)) GTEST_SKIP() << "no " << cases;
  // Volumes by the triangles of the files, without what is to be left out.
  const std::map<std::string, double> volumes = {{"j_tjunction.obj", 6000},
                                                 {"i_inch_round.stl", 32564.418},
                                                 {"i_jit1e-06.obj", 32564.418},
                                                 {"aj_stray.stl", 6000},
                                                 {"ag_internal_face.stl", 18000}};
  Random random(15);
  for (const auto& [name, expected] : volumes) {
    SCOPED_TRACE(name);
    expect_mended(read_mesh(cases / name).mesh, expected, 1e-6, random);
  }
}

}  // namespace
}  // namespace rayrep
