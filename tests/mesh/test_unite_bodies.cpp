// Bodies of one file that overlap: check_mesh makes them one, and leaves alone all others.

#include <gtest/gtest.h>

#include <algorithm>
#include <string>
#include <vector>

#include "boolean_cases.h"
#include "mesh/close_pairs.h"
#include "mesh/crossing.h"
#include "mesh/float32.h"
#include "mesh/mesh_edges.h"
#include "rayrep/mesh/boolean.h"
#include "rayrep/mesh/mesh_check.h"
#include "rayrep/mesh/surface_query.h"
#include "solids.h"

namespace rayrep {
namespace {

using Eigen::Vector3d;
using namespace test;

double volume(const Mesh& mesh) { return mesh_moments(mesh)[M1]; }

bool same(const Mesh& a, const Mesh& b) { return a.vertices == b.vertices && a.triangles == b.triangles; }

bool noted(const MeshReport& report, const std::string& words) {
  return std::any_of(report.notes.begin(), report.notes.end(),
                     [&](const std::string& note) { return note.find(words) != std::string::npos; });
}

bool inside(const Mesh& mesh, const Vector3d& p) {
  std::vector<LineHit> hits;
  line_hits_brute_force(mesh, p.head<2>(), hits);
  return winding_below(hits, p.z()) > 0;
}

/// What must hold of all that was made one, whatever it was.
CheckedMesh united(const Mesh& mesh, std::size_t bodies) {
  const CheckedMesh checked = check_mesh(mesh);
  EXPECT_TRUE(checked.report.usable);
  EXPECT_EQ(checked.report.first_aid.bodies_united, bodies);
  EXPECT_TRUE(noted(checked.report, "First aid: " + std::to_string(bodies) + " bodies overlap: taken as one"));
  EXPECT_FALSE(noted(checked.report, "crosses or touches itself"));
  EXPECT_TRUE(crossing_pairs(checked.mesh, close_pairs(checked.mesh)).empty());
  for_each_edge(checked.mesh, [](auto begin, auto end) { EXPECT_EQ(edge_balance(begin, end), 0); });
  const double exact = volume(boundary_of_union(mesh));
  EXPECT_NEAR(volume(checked.mesh), exact, (is_float32(mesh) ? 1e-6 : 1e-12) * exact);
  EXPECT_TRUE(!is_float32(mesh) || is_float32(checked.mesh));
  Random random(1);
  const Eigen::AlignedBox3d box = bounding_box(mesh);
  EXPECT_TRUE(bounding_box(checked.mesh).isApprox(box, 1e-6));
  for (int n = 0; n < 200; ++n) {
    const Vector3d p = box.center() + 0.55 * random.in_box(1).cwiseProduct(box.sizes());
    EXPECT_EQ(inside(checked.mesh, p), inside(mesh, p)) << p.transpose();
  }
  const CheckedMesh again = check_mesh(checked.mesh);
  EXPECT_EQ(again.report.first_aid.bodies_united, 0u);
  EXPECT_TRUE(same(again.mesh, checked.mesh));
  return checked;
}

void expect_left(const Mesh& mesh) {
  const CheckedMesh with = check_mesh(mesh);
  const CheckedMesh without = check_mesh(mesh, {.unite = false});
  EXPECT_TRUE(with.report.usable);
  EXPECT_EQ(with.report.first_aid.bodies_united, 0u);
  EXPECT_TRUE(same(with.mesh, without.mesh));
  EXPECT_EQ(with.report.notes, without.report.notes);
}

TEST(UniteBodies, AHeadPushedIntoATorso) {
  const Mesh torso = icosphere(10, 3), head = icosphere(6, 3, {1, 2, 12});
  const Mesh both = as_float32(merged({torso, head}));
  ASSERT_TRUE(is_float32(both));
  const CheckedMesh checked = united(both, 2);
  EXPECT_EQ(connected_components(checked.mesh).count, 1);
  // A lens that both have in common, of two caps.
  const double d = std::sqrt(149.0), R = 10, r = 6;
  const double lens = M_PI * std::pow(R + r - d, 2) * (d * d + 2 * d * (r + R) - 3 * (R - r) * (R - r)) / (12 * d);
  EXPECT_NEAR(volume(torso) + volume(head) - volume(checked.mesh), lens, 0.05 * lens);
  for (std::uint64_t seed = 0; seed < 5; ++seed) united(rotated(both, random_rotation(seed)), 2);
}

TEST(UniteBodies, WhateverTheirOrder) {
  const Mesh a = icosphere(10, 2), b = box({5, -3, -3}, {20, 3, 3}), c = rotated(box({-4, -4, 0}, {4, 4, 14}), random_rotation(3));
  const double expected = volume(united(merged({a, b, c}), 3).mesh);
  EXPECT_NEAR(volume(united(merged({c, a, b}), 3).mesh), expected, 1e-10);
  EXPECT_NEAR(volume(united(soup(merged({b, c, a})), 3).mesh), expected, 1e-10);
}

TEST(UniteBodies, FacesInOnePlaneAndBodiesThereTwice) {
  EXPECT_DOUBLE_EQ(volume(united(merged({box({0, 0, 0}, {2, 2, 1}), box({1, 1, 0}, {3, 3, 1})}), 2).mesh), 7);
  EXPECT_DOUBLE_EQ(volume(united(merged({box({0, 0, 0}, {2, 1, 1}), box({1, 0, 0}, {3, 1, 1})}), 2).mesh), 3);
  const Mesh once = icosphere(5, 1);
  EXPECT_NEAR(volume(united(merged({once, once, moved(once, {20, 0, 0})}), 2).mesh), 2 * volume(once), 1e-10);
}

TEST(UniteBodies, OneInsideTheOther) {
  const Mesh outer = icosphere(10, 2), inner = icosphere(3, 1);
  const CheckedMesh swallowed = united(merged({outer, inner}), 2);
  EXPECT_TRUE(same(swallowed.mesh, with_merged_vertices(outer)));
  expect_left(hollow(outer, inner));                             // a cavity
  expect_left(merged({hollow(outer, inner), icosphere(1, 1)}));  // and what is loose in it
}

TEST(UniteBodies, WhatDoesNotOverlapIsLeft) {
  const Mesh a = box({0, 0, 0}, {1, 1, 1});
  for (const Vector3d& place : {Vector3d(3, 0, 0), Vector3d(1, 0, 0), Vector3d(1, 0.5, 0.25), Vector3d(1, 1, 0),
                                Vector3d(1, 1, 0.5), Vector3d(1, 1, 1), Vector3d(0, 0, -1)})
    expect_left(merged({a, moved(a, place)}));
  expect_left(merged({torus(10, 2, 24, 12), icosphere(3, 2)}));  // boxes meet, bodies do not
  Mesh crossing = icosphere(5, 2);                               // a single body that crosses itself
  for (Vector3d& v : crossing.vertices)
    if (v.x() > 4) v.x() -= 12;
  expect_left(crossing);
}

TEST(UniteBodies, TwoThatSurroundACavityKeepIt) {
  const Mesh cup = combined(std::vector<Mesh>{box({0, 0, 0}, {10, 10, 10}), box({2, 2, 2}, {8, 8, 12})},
                            {.operation = BooleanOperation::subtract})
                       .mesh;
  const CheckedMesh closed = united(merged({cup, box({1, 1, 9}, {9, 9, 12})}), 2);
  EXPECT_DOUBLE_EQ(volume(closed.mesh), 1000 + 2 * 64 - 6 * 6 * 7);
  EXPECT_EQ(closed.report.cavities, 1u);
}

/// Pairs that meet in all ways, lie on each other but for rounding, too: each is made one without triangles that cross, or left.
TEST(UniteBodies, AnyPair) {
  int made_one = 0;
  for (std::uint64_t n = 0; n < 300; ++n) {
    SCOPED_TRACE(n);
    const auto [a, b] = boolean_pair(n);
    for (const Mesh& both : {merged({a, b}), as_float32(merged({a, b}))}) {
      const CheckedMesh checked = check_mesh(both);
      if (checked.report.first_aid.bodies_united == 0) {
        EXPECT_TRUE(same(checked.mesh, check_mesh(both, {.unite = false}).mesh));
        continue;
      }
      ++made_one;
      EXPECT_TRUE(crossing_pairs(checked.mesh, close_pairs(checked.mesh)).empty());
      const double exact = volume(boundary_of_union(both));
      EXPECT_NEAR(volume(checked.mesh), exact, (is_float32(both) ? 1e-5 : 1e-12) * exact);
    }
  }
  EXPECT_GT(made_one, 250);
}

TEST(UniteBodies, FlatFacesKeepNoCornersOfWhatIsInsideNow) {
  std::vector<Mesh> boxes;
  Mesh all;
  for (int n = 0; n < 12; ++n) {
    boxes.push_back(box({0.37 * n, 0.41 * n, 0.29 * n}, {0.37 * n + 10, 0.41 * n + 10, 0.29 * n + 10}));
    append(all, boxes.back());
  }
  const Mesh as_cut = combined(boxes, {.operation = BooleanOperation::unite}).mesh;
  const double exact = volume(as_cut);
  for (const Mesh& mesh : {all, as_float32(all)}) {
    const CheckedMesh checked = united(mesh, boxes.size());
    EXPECT_NEAR(volume(checked.mesh), exact, (is_float32(mesh) ? 1e-5 : 1e-12) * exact);
    EXPECT_LT(checked.mesh.triangles.size(), as_cut.triangles.size() * 5 / 6);
  }
}

}  // namespace
}  // namespace rayrep
