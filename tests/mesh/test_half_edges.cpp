#include <gtest/gtest.h>

#include <vector>

#include "mesh/half_edges.h"
#include "mesh/mesh_edges.h"
#include "solids.h"

namespace rayrep {
namespace {

bool can_collapse(const HalfEdges& surface, const std::vector<int>& around, std::size_t n) {
  std::vector<int> ends;
  for (const int h : around) ends.push_back(surface.to(h));
  return surface.can_collapse(around, ends, n);
}

// How many half-edges can be collapsed.
int collapsible(const Mesh& mesh) {
  HalfEdges surface(mesh, VertexCorners(mesh));
  int count = 0;
  std::vector<int> around;
  for (int v = 0; v < surface.vertices(); ++v) {
    if (!surface.regular(v)) continue;
    surface.around(v, around);
    for (std::size_t n = 0; n < around.size(); ++n) count += can_collapse(surface, around, n);
  }
  return count;
}

void expect_closed(const Mesh& mesh) {
  for_each_edge(mesh, [](auto begin, auto end) {
    EXPECT_EQ(end - begin, 2);
    EXPECT_EQ(edge_balance(begin, end), 0);
  });
}

TEST(HalfEdges, GoRoundAVertexCounterClockwise) {
  const Mesh mesh = test::icosphere(1, 1);
  const HalfEdges surface(mesh, VertexCorners(mesh));
  std::vector<int> around;
  for (int v = 0; v < surface.vertices(); ++v) {
    ASSERT_TRUE(surface.regular(v));
    surface.around(v, around);
    EXPECT_EQ(around.size(), v < 12 ? 5u : 6u);
    for (std::size_t n = 0; n < around.size(); ++n) {
      EXPECT_EQ(surface.from(around[n]), v);
      EXPECT_EQ(surface.twin(surface.twin(around[n])), around[n]);
      EXPECT_EQ(surface.to(HalfEdges::next(around[n])), surface.to(around[(n + 1) % around.size()]));
    }
  }
}

TEST(HalfEdges, NoEdgeOfATetrahedronOrOfTheSmallestTorusCanCollapse) {
  EXPECT_EQ(collapsible(test::unit_tetrahedron()), 0);
  EXPECT_EQ(collapsible(test::torus(3, 1, 3, 3)), 0);  // every edge is of a ring of three that is not a triangle
  EXPECT_EQ(collapsible(test::torus(3, 1, 4, 4)), 2 * 3 * 16);
}

TEST(HalfEdges, ABallShrinksToATetrahedronThroughClosedSurfaces) {
  const Mesh given = test::icosphere(1, 2);
  HalfEdges surface(given, VertexCorners(given));
  std::vector<int> around, kept;
  std::size_t triangles = given.triangles.size();
  for (bool collapsed = true; collapsed;) {
    collapsed = false;
    for (int v = 0; v < surface.vertices(); ++v) {
      if (surface.removed(v)) continue;
      surface.around(v, around);
      for (std::size_t n = 0; n < around.size(); ++n) {
        if (!can_collapse(surface, around, n)) continue;
        surface.collapse(around, n);
        triangles -= 2;
        collapsed = true;
        EXPECT_TRUE(surface.removed(v));
        break;
      }
      const Mesh left = surface.remaining(given.vertices, kept);
      EXPECT_EQ(left.triangles.size(), triangles);
      expect_closed(left);
    }
  }
  EXPECT_EQ(triangles, 4u);
}

TEST(HalfEdges, WhereTwoBodiesTouchIsNotRegular) {
  // At a corner, and along an edge.
  for (const Eigen::Vector3i& other : {Eigen::Vector3i(1, 1, 1), Eigen::Vector3i(1, 1, 0)}) {
    const Mesh mesh = test::polycubes({{0, 0, 0}, other});
    const HalfEdges surface(mesh, VertexCorners(mesh));
    int irregular = 0;
    for (int v = 0; v < surface.vertices(); ++v) {
      const Eigen::Vector3d& p = mesh.vertices[v];
      const bool touches = p.x() == 1 && p.y() == 1 && (other.z() == 0 || p.z() == 1);
      EXPECT_EQ(surface.regular(v), !touches);
      irregular += !surface.regular(v);
    }
    EXPECT_EQ(irregular, other.z() == 0 ? 2 : 1);
  }
}

}  // namespace
}  // namespace rayrep
