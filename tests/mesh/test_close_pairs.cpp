#include <gtest/gtest.h>
#include <tbb/task_arena.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <filesystem>
#include <string>
#include <utility>
#include <vector>

#include "mesh/close_pairs.h"
#include "mesh/mesh_edges.h"
#include "mesh/predicates.h"
#include "rayrep/io/mesh_io.h"
#include "rayrep/mesh/mesh_check.h"
#include "solids.h"

namespace rayrep {
namespace {

using Eigen::Vector3d;
using namespace test;
using Pairs = std::vector<std::pair<int, int>>;

bool meet(const Mesh& mesh, int s, int t) {
  const Vector3d p[3] = {mesh.corner(s, 0), mesh.corner(s, 1), mesh.corner(s, 2)};
  const Vector3d q[3] = {mesh.corner(t, 0), mesh.corner(t, 1), mesh.corner(t, 2)};
  return triangles_intersect(p, mesh.triangles[s], q, mesh.triangles[t]);
}

/// All pairs that meet, by a test of every pair.
Pairs meeting(const Mesh& mesh) {
  Pairs pairs;
  const int n = static_cast<int>(mesh.triangles.size());
  for (int s = 0; s < n; ++s)
    for (int t = s + 1; t < n; ++t)
      if (meet(mesh, s, t)) pairs.emplace_back(s, t);
  return pairs;
}

/// The law: what meets is found. Returns how many pairs meet.
std::size_t expect_all_found(const Mesh& mesh, const std::string& what) {
  const Pairs expected = meeting(mesh);
  const Pairs found = close_pairs(mesh);
  EXPECT_TRUE(std::is_sorted(found.begin(), found.end())) << what;
  EXPECT_EQ(std::adjacent_find(found.begin(), found.end()), found.end()) << what;
  EXPECT_TRUE(std::includes(found.begin(), found.end(), expected.begin(), expected.end())) << what;
  return expected.size();
}

Vector3d random_point(Random& random) { return {random.uniform(), random.uniform(), random.uniform()}; }

TEST(ClosePairs, OfSoupsWithTrianglesOfEverySize) {
  Random random(1);
  std::size_t met = 0;
  for (int n = 0; n < 20; ++n) {
    Mesh soup;
    for (int t = 0; t < 150; ++t) {
      const double size = std::pow(10, -2 * random.uniform());
      const Vector3d at = random_point(random);
      for (int k = 0; k < 3; ++k) soup.vertices.push_back(at + size * random_point(random));
      soup.triangles.emplace_back(3 * t, 3 * t + 1, 3 * t + 2);
    }
    met += expect_all_found(soup, "soup " + std::to_string(n));
  }
  EXPECT_GT(met, 200u);
}

TEST(ClosePairs, OfTrianglesThatShareAnyCorners) {
  // Few vertices, so that triangles share one, two or none, and fold onto each other; on a coarse grid, so that many are coplanar.
  Random random(2);
  std::size_t met = 0;
  for (int n = 0; n < 60; ++n) {
    Mesh mesh;
    for (int v = 0; v < 24; ++v) {
      Vector3d p = random_point(random);
      if (n % 2 == 0) p = (4 * p).array().floor().matrix();
      if (n % 3 == 0) p.z() *= 1e-7;
      mesh.vertices.push_back(p);
    }
    while (mesh.triangles.size() < 60) {
      const auto pick = [&random] { return static_cast<int>(24 * random.uniform()); };
      const Eigen::Vector3i t(pick(), pick(), pick());
      if (t[0] == t[1] || t[1] == t[2] || t[2] == t[0]) continue;
      if (!collinear(mesh.vertices[t[0]], mesh.vertices[t[1]], mesh.vertices[t[2]])) mesh.triangles.push_back(t);
    }
    met += expect_all_found(mesh, "mesh " + std::to_string(n));
  }
  EXPECT_GT(met, 10000u);
}

TEST(ClosePairs, OfLargeFans) {
  // Rows of many triangles about a vertex: flat, as cones and waves, of part of a turn to several turns, some turned over, with
  // others across them.
  Random random(3);
  std::size_t met = 0;
  for (int n = 0; n < 60; ++n) {
    const int count = 20 + static_cast<int>(100 * random.uniform());
    const double turns = n % 3 == 0 ? 1 : random.uniform(0.2, n % 3 == 1 ? 1.0 : 2.5);
    const bool closes = n % 3 == 0;
    const double wave = n % 4 == 0 ? 0 : random.uniform(0, 2);
    Mesh mesh;
    mesh.vertices.emplace_back(0, 0, n % 5 == 0 ? 3 : 0);
    for (int k = 0; k < count + (closes ? 0 : 1); ++k) {
      const double angle = 2 * kPi * turns * k / count;
      const double radius = n % 2 == 0 ? 10 : random.uniform(1, 10);
      mesh.vertices.emplace_back(radius * std::cos(angle), radius * std::sin(angle), wave * std::sin(7 * angle));
    }
    for (int k = 0; k < count; ++k) {
      const int next = 1 + (closes ? (k + 1) % count : k + 1);
      const bool over = n % 7 == 6 && random.uniform() < 0.1;
      mesh.triangles.emplace_back(0, over ? next : 1 + k, over ? 1 + k : next);
    }
    for (int k = 0; k < n % 6; ++k) append(mesh, moved(icosphere(3, 1), 8 * random_point(random) - Vector3d(4, 4, 4)));
    for (std::size_t t = mesh.triangles.size() - 1; t > 0; --t)
      std::swap(mesh.triangles[t], mesh.triangles[static_cast<std::size_t>(random.uniform() * static_cast<double>(t))]);
    met += expect_all_found(rotated(mesh, random_rotation(static_cast<std::uint64_t>(n))), "fan " + std::to_string(n));
  }
  EXPECT_GT(met, 1000u);
}

TEST(ClosePairs, OfAFanAreFew) {
  // The ends of a cylinder: every box there meets thousands of others.
  for (const double height : {2.0, 1e-3}) {
    const Mesh mesh = cylinder(20, height, 3000);
    EXPECT_LT(close_pairs(mesh).size(), 20 * mesh.triangles.size()) << height;
  }
}

TEST(ClosePairs, OfClosedBodiesThatCross) {
  Random random(4);
  for (std::uint64_t seed = 0; seed < 4; ++seed) {
    const Mesh tori =
        merged({rotated(torus(8, 3, 12, 8), random_rotation(seed)), rotated(torus(7, 2, 10, 6), random_rotation(seed + 9))});
    EXPECT_GT(expect_all_found(tori, "tori"), 20u);
    // Both face the same way where they cross, and nearly agree: nothing bends there.
    const Mesh twins = merged({icosphere(10, 3), moved(icosphere(10, 3), 1e-3 * random_point(random))});
    EXPECT_GT(expect_all_found(rotated(twins, random_rotation(seed)), "twins"), 20u);
    // A few large triangles among many small ones.
    const Mesh pierced = merged({box({-20, -20, -20}, {20, 20, 20}), moved(icosphere(2, 2), {20, 3, 4})});
    EXPECT_GT(expect_all_found(rotated(pierced, random_rotation(seed)), "pierced"), 5u);
  }
}

/// Triangles around vertex 0, the others at the given heights.
Mesh fan(int corners, double turns, const std::vector<double>& heights) {
  Mesh mesh;
  mesh.vertices.push_back(Vector3d::Zero());
  for (int k = 0; k < corners; ++k) {
    const double angle = 2 * kPi * turns * k / corners;
    mesh.vertices.emplace_back(std::cos(angle), std::sin(angle), heights[static_cast<std::size_t>(k)]);
    mesh.triangles.emplace_back(0, k + 1, (k + 1) % corners + 1);
  }
  return mesh;
}

TEST(ClosePairs, AFanIsOpenOnlyWhenItGoesRoundOnce) {
  Random random(3);
  for (std::uint64_t seed = 0; seed < 20; ++seed) {
    const auto heights = [&random](int n) {
      std::vector<double> h;
      for (int k = 0; k < n; ++k) h.push_back(0.1 * random.uniform());
      return h;
    };
    const auto R = random_rotation(seed);
    EXPECT_TRUE(close_pairs(rotated(fan(7, 1, heights(7)), R)).empty());
    // Twice round, closed, every triangle facing up: one ring runs through the other.
    EXPECT_GT(expect_all_found(rotated(fan(11, 2, heights(11)), R), "twice"), 0u);
    // Two rings of their own around one vertex.
    Mesh two = fan(6, 1, {0.05, -0.05, 0.05, -0.05, 0.05, -0.05});
    for (Mesh other = rotated(fan(6, 1, std::vector<double>(6, 0.0)), Eigen::AngleAxisd(0.3, Vector3d::UnitZ()).matrix());
         const auto& t : other.triangles) {
      const int v = static_cast<int>(two.vertices.size());
      two.vertices.push_back(other.vertices[t[1]]);
      two.vertices.push_back(other.vertices[t[2]]);
      two.triangles.emplace_back(0, v, v + 1);
    }
    two = with_merged_vertices(two);
    EXPECT_GT(expect_all_found(rotated(two, R), "two rings"), 0u);
    // A flap on a ring, and a ring with a triangle folded over.
    Mesh flap = fan(6, 1, heights(6));
    flap.vertices.emplace_back(0.5, 0.2, 0);
    flap.triangles.emplace_back(0, 1, static_cast<int>(flap.vertices.size()) - 1);
    expect_all_found(rotated(flap, R), "flap");
    Mesh folded = fan(6, 1, std::vector<double>(6, 0.0));
    folded.vertices[1] = {std::cos(1.3), std::sin(1.3), 0};
    EXPECT_GT(expect_all_found(folded, "folded"), 0u);
  }
}

TEST(ClosePairs, SheetsThatNearlyTouchAreFound) {
  for (std::uint64_t seed = 0; seed < 10; ++seed)
    for (const double gap : {0.0, 1e-15, 1e-13, -1e-13, 1e-11}) {
      const Mesh boxes = merged({box({0, 0, 0}, {2, 2, 2}), box({0.3, 0.4, 2 + gap}, {1.5, 2.5, 4})});
      const Pairs found = close_pairs(rotated(boxes, seed == 0 ? Eigen::Matrix3d::Identity() : random_rotation(seed)));
      EXPECT_TRUE(std::any_of(found.begin(), found.end(), [](const auto& pair) { return pair.first < 12 && pair.second >= 12; }));
    }
}

TEST(ClosePairs, CleanSurfacesHaveNone) {
  for (const Mesh& mesh : {icosphere(10, 4), torus(10, 3, 60, 30), subdivided(box({0, 0, 0}, {3, 2, 1}), 4),
                           hollow(icosphere(10, 3), icosphere(9, 3)), cone(3, 5, 12)})
    EXPECT_TRUE(close_pairs(mesh).empty());
  EXPECT_TRUE(close_pairs(Mesh{}).empty());
  EXPECT_GE(close_pairs(merged({icosphere(1, 1), icosphere(1, 1)})).size(), 80u);  // every triangle with its copy
}

TEST(ClosePairs, DoNotDependOnTheNumberOfThreads) {
  const Mesh mesh = merged({torus(8, 3, 60, 30), rotated(torus(7, 2, 60, 30), random_rotation(5))});
  Pairs one, four;
  tbb::task_arena(1).execute([&] { one = close_pairs(mesh); });
  tbb::task_arena(4).execute([&] { four = close_pairs(mesh); });
  EXPECT_FALSE(one.empty());
  EXPECT_EQ(one, four);
}

TEST(ClosePairs, PointsAndNeedlesDoNoHarm) {
  Mesh mesh = merged({icosphere(1, 1), icosphere(1, 1, {0.5, 0, 0})});
  const int v = mesh.triangles[0][0];
  const int w = mesh.triangles[0][1];
  mesh.vertices.push_back(0.3 * mesh.vertices[v] + 0.7 * mesh.vertices[w]);
  mesh.triangles.emplace_back(v, w, static_cast<int>(mesh.vertices.size()) - 1);
  mesh.triangles.emplace_back(v, v, w);
  mesh.triangles.emplace_back(v, v, v);
  const Pairs found = close_pairs(mesh);
  Pairs expected = meeting(merged({icosphere(1, 1), icosphere(1, 1, {0.5, 0, 0})}));
  EXPECT_TRUE(std::includes(found.begin(), found.end(), expected.begin(), expected.end()));
  const Mesh point{{Vector3d(1, 2, 3), Vector3d(1, 2, 3), Vector3d(1, 2, 3)}, {{0, 1, 2}, {0, 1, 2}}};
  EXPECT_EQ(close_pairs(point), Pairs({{0, 1}}));
}

// ---------------------------------------------------------------------------------------------------------------- edges

TEST(MeshEdges, EveryEdgeOfAClosedSurfaceHasTwoUses) {
  const Mesh mesh = rotated(torus(5, 2, 20, 10), random_rotation(1));
  std::size_t edges = 0;
  std::pair<int, int> last{-1, -1};
  for_each_edge(mesh, [&](auto begin, auto end) {
    ++edges;
    const std::pair edge(begin->low, begin->high);
    EXPECT_LT(last, edge);
    last = edge;
    ASSERT_EQ(end - begin, 2);
    EXPECT_LT(begin->triangle, (begin + 1)->triangle);
    EXPECT_EQ(begin->direction + (begin + 1)->direction, 0);
    for (auto use = begin; use != end; ++use) {
      const Eigen::Vector3i& t = mesh.triangles[use->triangle];
      const int from = use->direction > 0 ? use->low : use->high;
      const int to = use->direction > 0 ? use->high : use->low;
      EXPECT_TRUE((t[0] == from && t[1] == to) || (t[1] == from && t[2] == to) || (t[2] == from && t[0] == to));
    }
  });
  EXPECT_EQ(2 * edges, 3 * mesh.triangles.size());
}

TEST(MeshEdges, CornersAreWhereTheirVertexIs) {
  const Mesh mesh = merged({icosphere(1, 2), l_shape()});
  const VertexCorners at(mesh);
  ASSERT_EQ(at.corners.size(), 3 * mesh.triangles.size());
  for (std::size_t v = 0; v < mesh.vertices.size(); ++v)
    for (int n = at.first[v]; n < at.first[v + 1]; ++n) {
      const int c = at.corners[n];
      EXPECT_EQ(mesh.triangles[c / 3][c % 3], static_cast<int>(v));
      if (n > at.first[v]) {
        EXPECT_LT(at.corners[n - 1], c);
      }
    }
}

}  // namespace
}  // namespace rayrep
