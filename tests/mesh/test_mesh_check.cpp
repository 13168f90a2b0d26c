#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <array>
#include <boost/multiprecision/cpp_int.hpp>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <limits>
#include <map>
#include <nlohmann/json.hpp>
#include <set>
#include <string>
#include <vector>

#include "mesh/predicates.h"
#include "places.h"
#include "rayrep/base/error.h"
#include "rayrep/io/mesh_io.h"
#include "rayrep/mesh/mesh_check.h"
#include "rayrep/physics/moments.h"
#include "solids.h"

namespace rayrep {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;
using Eigen::Vector3i;
using namespace test;

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
constexpr double kInfinity = std::numeric_limits<double>::infinity();

bool mentions(const std::string& text, const std::string& part) { return text.find(part) != std::string::npos; }

bool noted(const MeshReport& report, const std::string& part) {
  for (const auto& note : report.notes)
    if (mentions(note, part)) return true;
  return false;
}

double volume(const Mesh& mesh) { return mesh_moments(mesh)[M1]; }

/// The same triangles in the same order, however their vertices are numbered.
bool same(const Mesh& a, const Mesh& b) {
  const Mesh p = soup(a), q = soup(b);
  return p.vertices == q.vertices && p.triangles == q.triangles;
}

/// Every k-th triangle reversed.
Mesh with_every_turned(Mesh mesh, std::size_t k) {
  for (std::size_t t = 0; t < mesh.triangles.size(); t += k) std::swap(mesh.triangles[t][0], mesh.triangles[t][1]);
  return mesh;
}

void expect_clean(const MeshReport& r) {
  EXPECT_TRUE(r.usable) << r.refusal;
  EXPECT_TRUE(r.refusal.empty()) << r.refusal;
  EXPECT_EQ(r.not_finite.count, 0u);
  EXPECT_EQ(r.degenerate.count, 0u);
  EXPECT_EQ(r.duplicate.count, 0u);
  EXPECT_EQ(r.open_edges.count, 0u);
  EXPECT_EQ(r.non_manifold_edges.count, 0u);
  EXPECT_EQ(r.misoriented_edges.count, 0u);
  EXPECT_EQ(r.unbalanced_edges.count, 0u);
  EXPECT_EQ(r.self_intersections.count, 0u);
  EXPECT_EQ(r.triangles_turned, 0u);
  EXPECT_TRUE(r.notes.empty()) << r.notes.front();
}

// ------------------------------------------------------------------------------------------------------------ predicates

using Exact = boost::multiprecision::cpp_rational;

int exact_orient2d(const Vector2d& a, const Vector2d& b, const Vector2d& c) {
  const Exact det =
      (Exact(b.x()) - Exact(a.x())) * (Exact(c.y()) - Exact(a.y())) - (Exact(b.y()) - Exact(a.y())) * (Exact(c.x()) - Exact(a.x()));
  return det.sign();
}

int exact_orient3d(const Vector3d& a, const Vector3d& b, const Vector3d& c, const Vector3d& d) {
  std::array<std::array<Exact, 3>, 3> m;
  for (int k = 0; k < 3; ++k) {
    const auto i = static_cast<std::size_t>(k);
    m[0][i] = Exact(b[k]) - Exact(a[k]);
    m[1][i] = Exact(c[k]) - Exact(a[k]);
    m[2][i] = Exact(d[k]) - Exact(a[k]);
  }
  const Exact det = m[0][0] * (m[1][1] * m[2][2] - m[1][2] * m[2][1]) - m[0][1] * (m[1][0] * m[2][2] - m[1][2] * m[2][0]) +
                    m[0][2] * (m[1][0] * m[2][1] - m[1][1] * m[2][0]);
  return det.sign();
}

double nudged(double x, int ulps) {
  for (; ulps > 0; --ulps) x = std::nextafter(x, kInfinity);
  for (; ulps < 0; ++ulps) x = std::nextafter(x, -kInfinity);
  return x;
}

TEST(Predicates, AgreeWithRationalArithmeticOnNearlyFlatInput) {
  Random random(1);
  const auto ulps = [&random] { return static_cast<int>(random.uniform(-3, 4)); };
  std::map<int, int> seen2, seen3;
  for (int n = 0; n < 4000; ++n) {
    const double scale = std::pow(10, random.uniform(-6, 6));
    const Vector3d offset = n % 2 ? Vector3d::Zero() : Vector3d(scale * 100 * random.in_box(1));
    const Vector3d a = offset + scale * random.in_box(1);
    const Vector3d b = offset + scale * random.in_box(1);
    const Vector3d c = offset + scale * random.in_box(1);
    Vector3d d = a + random.uniform(-1, 1) * (b - a) + random.uniform(-1, 1) * (c - a);
    for (int k = 0; k < 3; ++k) d[k] = nudged(d[k], n % 4 ? ulps() : 0);
    const int s3 = exact_orient3d(a, b, c, d);
    ASSERT_EQ(orient3d(a, b, c, d), s3) << n;
    ASSERT_EQ(orient3d(b, a, c, d), -s3) << n;
    ASSERT_EQ(orient3d(b, c, d, a), -s3) << n;

    Vector2d p = a.head<2>() + random.uniform(-1, 1) * (b - a).head<2>();
    p.x() = nudged(p.x(), n % 4 ? ulps() : 0);
    const int s2 = exact_orient2d(a.head<2>(), b.head<2>(), p);
    ASSERT_EQ(orient2d(a.head<2>(), b.head<2>(), p), s2) << n;
    ASSERT_EQ(orient2d(b.head<2>(), p, a.head<2>()), s2) << n;
    ++seen2[s2];
    ++seen3[s3];
  }
  for (int s = -1; s <= 1; ++s) {
    EXPECT_GT(seen3[s] + (s == 0), 0);
    EXPECT_GT(seen2[s] + (s == 0), 0);
  }
}

TEST(Predicates, ZeroIsFoundOnGridsOfDyadicNumbers) {
  Random random(2);
  int zeros = 0;
  const auto grid = [&random] { return std::floor(random.uniform(-3, 4)) / 1024 + 1e3; };
  for (int n = 0; n < 5000; ++n) {
    Vector3d p[4];
    for (auto& v : p) v = {grid(), grid(), grid()};
    const int s = exact_orient3d(p[0], p[1], p[2], p[3]);
    ASSERT_EQ(orient3d(p[0], p[1], p[2], p[3]), s);
    zeros += s == 0;
  }
  EXPECT_GT(zeros, 100);
}

TEST(Predicates, OrientationSigns) {
  EXPECT_EQ(orient2d({0, 0}, {1, 0}, {0, 1}), 1);
  EXPECT_EQ(orient3d({0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}), 1);
  EXPECT_TRUE(collinear({0, 0, 0}, {1, 2, 3}, {3, 6, 9}));
  EXPECT_FALSE(collinear({0, 0, 0}, {1, 2, 3}, {3, 6, nudged(9, 1)}));
  EXPECT_FALSE(collinear({0, 0, 0}, {0, 0, 1}, {0, 1e-300, 0}));
}

struct Triangle {
  Vector3d p[3];
};

bool intersect(const Triangle& s, const Vector3i& is, const Triangle& t, const Vector3i& it) {
  return triangles_intersect(s.p, is, t.p, it);
}

/// The answer must not depend on the order of the triangles, of their corners, or on the orientation.
void expect_intersect(bool expected, const Triangle& s, const Vector3i& is, const Triangle& t, const Vector3i& it,
                      const std::string& what) {
  const int order[6][3] = {{0, 1, 2}, {1, 2, 0}, {2, 0, 1}, {0, 2, 1}, {2, 1, 0}, {1, 0, 2}};
  for (const auto& o : order)
    for (const auto& q : order) {
      const Triangle a{{s.p[o[0]], s.p[o[1]], s.p[o[2]]}};
      const Triangle b{{t.p[q[0]], t.p[q[1]], t.p[q[2]]}};
      const Vector3i ia(is[o[0]], is[o[1]], is[o[2]]);
      const Vector3i ib(it[q[0]], it[q[1]], it[q[2]]);
      EXPECT_EQ(intersect(a, ia, b, ib), expected) << what;
      EXPECT_EQ(intersect(b, ib, a, ia), expected) << what;
    }
}

TEST(TriangleIntersection, KnownPairs) {
  const Triangle base{{{0, 0, 0}, {4, 0, 0}, {0, 4, 0}}};
  const Vector3i ib(0, 1, 2);
  const Vector3i apart(3, 4, 5);
  expect_intersect(true, base, ib, {{{1, 1, -1}, {1, 1, 1}, {2, 1, 1}}}, apart, "pierces");
  expect_intersect(false, base, ib, {{{1, 1, 1}, {1, 1, 2}, {2, 1, 1}}}, apart, "above");
  expect_intersect(false, base, ib, {{{5, 5, -1}, {5, 5, 1}, {6, 5, 1}}}, apart, "beside");
  expect_intersect(true, base, ib, {{{1, 1, 0}, {1, 1, 2}, {2, 1, 1}}}, apart, "corner on face");
  expect_intersect(true, base, ib, {{{4, 0, 0}, {5, 0, 2}, {5, 1, 1}}}, apart, "equal corners with different numbers");
  expect_intersect(true, base, ib, {{{2, -1, 0}, {2, 1, 0}, {2, 0, 5}}}, apart, "edge in plane");
  expect_intersect(true, base, ib, {{{1, 1, 0}, {2, 1, 0}, {1, 2, 0}}}, apart, "coplanar, inside");
  expect_intersect(true, base, ib, {{{-1, 1, 0}, {5, 1, 0}, {5, 2, 0}}}, apart, "coplanar, crossing");
  expect_intersect(false, base, ib, {{{3, 3, 0}, {5, 3, 0}, {3, 5, 0}}}, apart, "coplanar, apart");
  expect_intersect(false, base, ib, {{{1, 1, 1e-300}, {2, 1, 1}, {1, 2, 1}}}, apart, "hardly above");

  expect_intersect(false, base, ib, {{{0, 0, 0}, {1, 1, 1}, {1, 2, 1}}}, {0, 4, 5}, "shared corner, above");
  expect_intersect(true, base, ib, {{{0, 0, 0}, {1, 1, 1}, {1, 1, -1}}}, {0, 4, 5}, "shared corner, cutting");
  expect_intersect(true, base, ib, {{{0, 0, 0}, {9, 9, 1}, {9, 9, -1}}}, {0, 4, 5}, "shared corner, cutting the whole triangle");
  expect_intersect(false, base, ib, {{{0, 0, 0}, {-1, -1, 1}, {-1, -1, -1}}}, {0, 4, 5}, "shared corner, behind");
  expect_intersect(true, base, ib, {{{0, 0, 0}, {1, 1, 0}, {1, 2, 3}}}, {0, 4, 5}, "shared corner, an edge on the face");
  expect_intersect(true, base, ib, {{{0, 0, 0}, {2, 1, 0}, {1, 2, 0}}}, {0, 4, 5}, "shared corner, coplanar inside");
  expect_intersect(true, base, ib, {{{0, 0, 0}, {5, -1, 0}, {5, 1, 0}}}, {0, 4, 5}, "shared corner, coplanar over an edge");
  expect_intersect(false, base, ib, {{{0, 0, 0}, {-2, -1, 0}, {-1, -2, 0}}}, {0, 4, 5}, "shared corner, coplanar opposite");

  expect_intersect(false, base, ib, {{{0, 0, 0}, {4, 0, 0}, {1, 1, 1}}}, {0, 1, 5}, "shared edge, hinge");
  expect_intersect(false, base, ib, {{{0, 0, 0}, {4, 0, 0}, {1, -1, 0}}}, {0, 1, 5}, "shared edge, flat");
  expect_intersect(true, base, ib, {{{0, 0, 0}, {4, 0, 0}, {1, 1, 0}}}, {0, 1, 5}, "shared edge, folded over");
  expect_intersect(false, base, ib, base, ib, "duplicate");
  expect_intersect(false, base, ib, {{base.p[0], base.p[2], base.p[1]}}, {0, 2, 1}, "opposite duplicate");
}

// ------------------------------------------------------------------------------------------------------ what is accepted

TEST(MeshCheck, AClosedSolidPassesUntouched) {
  for (const Mesh& mesh :
       {box({0, 0, 0}, {1, 2, 3}), unit_tetrahedron(), icosphere(10, 3), torus(10, 3, 24, 12), l_shape(), staircase(4)}) {
    const CheckedMesh checked = check_mesh(mesh);
    expect_clean(checked.report);
    EXPECT_EQ(checked.report.components, 1u);
    EXPECT_EQ(checked.report.nested_components, 0u);
    EXPECT_TRUE(same(checked.mesh, mesh));
  }
}

TEST(MeshCheck, MergesASoupBackIntoTheSolid) {
  const Mesh sphere = icosphere(10, 3);
  Mesh loose = soup(sphere);
  for (auto& v : loose.vertices)
    for (int k = 0; k < 3; ++k)
      if (v[k] == 0 && (&v - loose.vertices.data()) % 2) v[k] = -0.0;
  const CheckedMesh checked = check_mesh(loose);
  expect_clean(checked.report);
  EXPECT_EQ(checked.mesh.vertices.size(), sphere.vertices.size());
  EXPECT_EQ(checked.report.vertices_merged, loose.vertices.size() - sphere.vertices.size());
  expect_moments_near(mesh_moments(checked.mesh), mesh_moments(sphere), 1e-14, 10);
}

TEST(MeshCheck, MergesOnBitsOnly) {
  Mesh mesh = soup(box({0, 0, 0}, {1, 1, 1}));
  mesh.vertices[0].x() = nudged(1, 1);  // was a corner of the box or is now beside one: either way an edge opens
  EXPECT_FALSE(check_mesh(mesh).report.usable);
}

TEST(MeshCheck, DropsUnusedVertices) {
  Mesh mesh = box({0, 0, 0}, {1, 1, 1});
  mesh.vertices.insert(mesh.vertices.begin(), Vector3d(100, 100, 100));
  mesh.vertices.emplace_back(kNaN, 0, 0);
  for (auto& t : mesh.triangles) t.array() += 1;
  const CheckedMesh checked = check_mesh(mesh);
  expect_clean(checked.report);
  EXPECT_TRUE(same(checked.mesh, box({0, 0, 0}, {1, 1, 1})));
  EXPECT_EQ(checked.mesh.vertices.size(), 8u);
}

TEST(MeshCheck, IsIdempotent) {
  const Mesh inner = box({1, 1, 1}, {2, 2, 2});
  const Mesh outer = icosphere(10, 2);
  Mesh doubled = outer;
  doubled.triangles.push_back(doubled.triangles[5]);
  for (const Mesh& mesh : {flipped(hollow(outer, inner)), with_every_turned(outer, 3), doubled, merged({outer, inner})}) {
    const CheckedMesh once = check_mesh(mesh);
    ASSERT_TRUE(once.report.usable) << once.report.refusal;
    const CheckedMesh twice = check_mesh(once.mesh);
    EXPECT_TRUE(same(once.mesh, twice.mesh));
    EXPECT_EQ(twice.report.triangles_turned, 0u);
    EXPECT_EQ(twice.report.degenerate.count + twice.report.duplicate.count, 0u);
  }
}

TEST(MeshCheck, DoesNotDependOnTheNumberOfThreads) {
  Mesh mesh;
  for (int n = 0; n < 12; ++n) append(mesh, rotated(box({-1, -2, -3}, {3, 2, 1}), random_rotation(static_cast<std::uint64_t>(n))));
  std::vector<CheckedMesh> results;
  for (const std::size_t threads : {1u, 2u, 7u}) {
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
    results.push_back(check_mesh(mesh));
  }
  EXPECT_GT(results[0].report.self_intersections.count, 100u);
  for (const auto& r : results) {
    EXPECT_EQ(r.report.self_intersections.count, results[0].report.self_intersections.count);
    EXPECT_EQ(r.report.self_intersections.first_mm, results[0].report.self_intersections.first_mm);
    EXPECT_EQ(r.report.notes, results[0].report.notes);
    EXPECT_TRUE(same(r.mesh, results[0].mesh));
  }
}

TEST(MeshCheck, StopsWhenAsked) {
  Progress progress;
  progress.cancelled = [] { return true; };
  try {
    check_mesh(icosphere(1, 2), {}, progress);
    FAIL() << "not interrupted";
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), ErrorCode::interrupted);
  }
}

// ------------------------------------------------------------------------------------------- degenerate, duplicate, flat

TEST(MeshCheck, DropsTrianglesWithARepeatedCorner) {
  Mesh mesh = box({0, 0, 0}, {1, 1, 1});
  mesh.triangles.insert(mesh.triangles.begin() + 3, Vector3i(2, 2, 7));
  mesh.triangles.emplace_back(4, 4, 4);
  const CheckedMesh checked = check_mesh(mesh);
  EXPECT_TRUE(checked.report.usable);
  EXPECT_EQ(checked.report.degenerate.count, 2u);
  EXPECT_TRUE(noted(checked.report, "2 triangles of zero area were left out"));
  EXPECT_TRUE(same(checked.mesh, box({0, 0, 0}, {1, 1, 1})));
}

TEST(MeshCheck, KeepsAZeroAreaTriangleThatHoldsTheSurfaceTogether) {
  // The edge 1-3 of the box is split at its middle on one side only; a triangle of zero area fills the slit.
  Mesh mesh = box({0, 0, 0}, {1, 1, 1});
  mesh.vertices.emplace_back(1, 0.5, 0);
  ASSERT_EQ(mesh.triangles[10], Vector3i(1, 3, 7));
  mesh.triangles[10] = {1, 8, 7};
  mesh.triangles.emplace_back(8, 3, 7);
  mesh.triangles.emplace_back(1, 3, 8);
  const CheckedMesh checked = check_mesh(mesh);
  EXPECT_TRUE(checked.report.usable) << checked.report.refusal;
  EXPECT_EQ(checked.report.degenerate.count, 1u);
  EXPECT_TRUE(noted(checked.report, "kept, because the surface would not be closed without"));
  EXPECT_TRUE(is_closed_solid(checked.mesh));
  EXPECT_NEAR(volume(checked.mesh), 1, 1e-15);
}

TEST(MeshCheck, DropsAZeroAreaTriangleThatOnlyHarms) {
  Mesh mesh = box({0, 0, 0}, {1, 1, 1});
  mesh.vertices.emplace_back(2, 2, 2);
  mesh.vertices.emplace_back(3, 3, 3);
  mesh.triangles.emplace_back(7, 8, 9);
  const CheckedMesh checked = check_mesh(mesh);
  EXPECT_TRUE(checked.report.usable) << checked.report.refusal;
  EXPECT_EQ(checked.report.degenerate.count, 1u);
  EXPECT_TRUE(same(checked.mesh, box({0, 0, 0}, {1, 1, 1})));
}

TEST(MeshCheck, DropsExtraCopiesThatOpenTheSurface) {
  for (const bool reversed : {false, true}) {
    Mesh mesh = icosphere(10, 1);
    const Mesh original = mesh;
    for (const int t : {7, 30, 31}) {
      Vector3i copy = mesh.triangles[t];
      if (reversed) std::swap(copy[0], copy[1]);
      mesh.triangles.push_back(copy);
    }
    const CheckedMesh checked = check_mesh(mesh);
    EXPECT_TRUE(checked.report.usable) << checked.report.refusal;
    EXPECT_EQ(checked.report.duplicate.count, 3u);
    EXPECT_GT(checked.report.non_manifold_edges.count, 0u);
    EXPECT_TRUE(noted(checked.report, "3 triangles there more than once left out"));
    EXPECT_TRUE(same(checked.mesh, original));
  }
}

TEST(MeshCheck, RemovesWallsWithoutThickness) {
  // Two boxes that share a whole face, each with its own copy of it: one body.
  const CheckedMesh pair =
      check_mesh(merged({box({0, 0, 0}, {1, 1, 1}), flipped(moved(flipped(box({0, 0, 0}, {1, 1, 1})), {1, 0, 0}))}));
  EXPECT_TRUE(pair.report.usable);
  EXPECT_NEAR(volume(pair.mesh), 2, 1e-15);

  Mesh mirrored = box({0, 0, 0}, {1, 1, 1});  // the same with equal diagonals: mirrored at x = 1
  for (auto& v : mirrored.vertices) v.x() = 2 - v.x();
  flip(mirrored);
  const CheckedMesh joined = check_mesh(merged({box({0, 0, 0}, {1, 1, 1}), mirrored}));
  EXPECT_TRUE(joined.report.usable);
  EXPECT_EQ(joined.report.duplicate.count, 2u);
  EXPECT_TRUE(noted(joined.report, "wall without thickness"));
  EXPECT_EQ(joined.mesh.triangles.size(), 20u);
  EXPECT_TRUE(is_closed_solid(joined.mesh));
  EXPECT_NEAR(volume(joined.mesh), 2, 1e-15);
}

TEST(MeshCheck, TakesOnceWhatIsThereSeveralTimesAsAWhole) {
  const Mesh once = hollow(icosphere(5, 1), icosphere(3, 1));
  Mesh copies = once;
  for (std::size_t times = 2; times <= 3; ++times) {
    append(copies, once);
    const CheckedMesh checked = check_mesh(copies);
    EXPECT_TRUE(checked.report.usable);
    EXPECT_EQ(checked.report.duplicate.count, (times - 1) * once.triangles.size());
    EXPECT_TRUE(noted(checked.report, "there " + std::to_string(times) + " times"));
    EXPECT_EQ(checked.mesh.triangles.size(), once.triangles.size());
    EXPECT_EQ(volume(checked.mesh), volume(check_mesh(once).mesh));
    EXPECT_EQ(check_mesh(checked.mesh).report.duplicate.count, 0u);
  }
}

TEST(MeshCheck, KeepsABodyThatIsThereTwiceBesideOthers) {
  const Mesh once = icosphere(5, 1);
  const CheckedMesh both = check_mesh(merged({once, once, moved(once, {20, 0, 0})}));
  EXPECT_NEAR(volume(boundary_of_union(both.mesh)), 2 * volume(once), 1e-11);
  const CheckedMesh checked = check_mesh(merged({once, flipped(icosphere(3, 1)), once}));  // dropping one would open the cavity
  EXPECT_TRUE(checked.report.usable);
  EXPECT_EQ(checked.report.duplicate.count, once.triangles.size());
  EXPECT_TRUE(noted(checked.report, "there more than once and kept"));
  EXPECT_NEAR(volume(boundary_of_union(checked.mesh)), volume(once), 1e-11);
}

TEST(MeshCheck, FlatSurfacesHaveNoVolume) {
  const Mesh flat = box({0, 0, 0}, {1, 1, 0});
  Mesh sheet;  // a square, both sides
  sheet.vertices = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}};
  sheet.triangles = {{0, 1, 2}, {0, 2, 3}, {0, 2, 1}, {0, 3, 2}};
  for (const Mesh& mesh : {flat, sheet}) {
    const CheckedMesh checked = check_mesh(mesh);
    EXPECT_FALSE(checked.report.usable);
    EXPECT_TRUE(mentions(checked.report.refusal, "no volume")) << checked.report.refusal;
  }
  EXPECT_TRUE(mentions(check_mesh({}).report.refusal, "not a single triangle"));
}

// ------------------------------------------------------------------------------------------------------------ orientation

TEST(MeshCheck, TurnsTrianglesToAgreeWithTheirNeighbours) {
  const Mesh sphere = icosphere(10, 2);
  for (const std::size_t k : {2u, 3u, 7u, 1000u}) {
    const CheckedMesh checked = check_mesh(with_every_turned(sphere, k));
    EXPECT_TRUE(checked.report.usable) << checked.report.refusal;
    EXPECT_GT(checked.report.misoriented_edges.count, 0u);
    EXPECT_EQ(checked.report.triangles_turned, (sphere.triangles.size() + k - 1) / k);
    EXPECT_TRUE(noted(checked.report, "turned to agree"));
    EXPECT_TRUE(is_closed_solid(checked.mesh));
    EXPECT_NEAR(volume(checked.mesh), volume(sphere), 1e-10);
  }
}

TEST(MeshCheck, TurnsABodyThatIsInsideOut) {
  const Mesh sphere = icosphere(10, 1);
  const CheckedMesh checked = check_mesh(flipped(sphere));
  EXPECT_TRUE(checked.report.usable);
  EXPECT_EQ(checked.report.components_turned, 1u);
  EXPECT_EQ(checked.report.triangles_turned, sphere.triangles.size());
  EXPECT_TRUE(noted(checked.report, "inside out"));
  EXPECT_NEAR(volume(checked.mesh), volume(sphere), 1e-10);
}

TEST(MeshCheck, TurnsOnePartWithoutTheOther) {
  const Mesh a = box({0, 0, 0}, {1, 1, 1});
  for (const double gap : {1.0, 0.0, -0.5}) {  // apart, touching by a face, crossing
    const Mesh b = box({1 + gap, 0.25, 0.25}, {2 + gap, 0.5, 0.5});
    const CheckedMesh checked = check_mesh(merged({a, flipped(b)}), {.unite = false});
    EXPECT_TRUE(checked.report.usable);
    EXPECT_EQ(checked.report.components, 2u);
    EXPECT_EQ(checked.report.components_turned, 1u) << gap;
    EXPECT_EQ(checked.report.nested_components, 0u) << gap;
    EXPECT_NEAR(volume(checked.mesh), volume(a) + volume(b), 1e-12);
  }
}

TEST(MeshCheck, BoxesJoinedAtAnEdgeAreTurnedOneByOne) {
  const Mesh a = box({0, 0, 0}, {1, 1, 1});
  const Mesh b = box({1, 1, 0}, {2, 2, 1});
  const CheckedMesh checked = check_mesh(merged({a, flipped(b)}));
  EXPECT_EQ(checked.report.components, 1u);
  EXPECT_EQ(checked.report.non_manifold_edges.count, 1u);
  EXPECT_EQ(checked.report.components_turned, 1u);
  EXPECT_TRUE(checked.report.usable) << checked.report.refusal;
  EXPECT_NEAR(volume(checked.mesh), 2, 1e-12);
}

TEST(MeshCheck, KeepsCavities) {
  const Mesh outer = icosphere(10, 2);
  const Mesh inner = moved(icosphere(3, 1), {2, 0, 0});
  const Mesh other = moved(box({-1, -1, -1}, {1, 1, 1}), {-4, 0, 0});
  const CheckedMesh checked = check_mesh(hollow(hollow(outer, inner), other));
  EXPECT_TRUE(checked.report.usable);
  EXPECT_EQ(checked.report.components, 3u);
  EXPECT_EQ(checked.report.nested_components, 2u);
  EXPECT_EQ(checked.report.cavities, 2u);
  EXPECT_EQ(checked.report.triangles_turned, 0u);
  EXPECT_TRUE(noted(checked.report, "cavities"));
  EXPECT_NEAR(volume(checked.mesh), volume(outer) - volume(inner) - volume(other), 1e-9);
}

TEST(MeshCheck, TurnsAHollowBodyThatIsInsideOutAsAWhole) {
  const Mesh outer = icosphere(10, 2);
  const Mesh inner = icosphere(6, 2);
  const Mesh island = icosphere(2, 2);
  const double expected = volume(outer) - volume(inner) + volume(island);
  for (const Mesh& mesh : {merged({outer, flipped(inner), island}), merged({flipped(outer), inner, flipped(island)})}) {
    const CheckedMesh checked = check_mesh(mesh);
    EXPECT_TRUE(checked.report.usable);
    EXPECT_EQ(checked.report.cavities, 1u);
    EXPECT_EQ(checked.report.nested_components, 2u);
    EXPECT_NEAR(volume(checked.mesh), expected, 1e-9);
  }
  // Only the island is wrong: no material can be taken away from a void.
  const CheckedMesh checked = check_mesh(merged({outer, flipped(inner), flipped(island)}));
  EXPECT_EQ(checked.report.components_turned, 1u);
  EXPECT_NEAR(volume(checked.mesh), expected, 1e-9);
}

TEST(MeshCheck, ABodyInsideABodyIsAUnion) {
  const Mesh outer = icosphere(10, 2);
  const CheckedMesh checked = check_mesh(merged({outer, icosphere(3, 1)}));
  EXPECT_TRUE(checked.report.usable);
  EXPECT_EQ(checked.report.nested_components, 1u);
  EXPECT_EQ(checked.report.cavities, 0u);
  EXPECT_TRUE(noted(checked.report, "union"));
  EXPECT_NEAR(volume(boundary_of_union(checked.mesh)), volume(outer), 1e-9);
}

TEST(MeshCheck, NestingDoesNotDependOnTheFrame) {
  const Mesh body = hollow(merged({box({0, 0, 0}, {10, 10, 10}), box({20, 0, 0}, {30, 10, 10})}), box({1, 1, 1}, {9, 9, 9}));
  for (std::uint64_t seed = 0; seed < 20; ++seed) {
    const CheckedMesh checked = check_mesh(rotated(body, random_rotation(seed)));
    EXPECT_EQ(checked.report.nested_components, 1u);
    EXPECT_EQ(checked.report.cavities, 1u);
    EXPECT_NEAR(volume(checked.mesh), 2000 - 512, 1e-8);
  }
}

// ----------------------------------------------------------------------------------------------------- what is refused

TEST(MeshCheck, WithoutFirstAidRefusesOpenSurfacesAndSaysWhere) {
  Mesh mesh = box({0, 0, 0}, {10, 10, 10});
  ASSERT_EQ(mesh.triangles[10], Vector3i(1, 3, 7));
  mesh.triangles.erase(mesh.triangles.begin() + 10);
  const CheckedMesh checked = check_mesh(mesh, {.first_aid = false});
  EXPECT_FALSE(checked.report.usable);
  EXPECT_EQ(checked.report.open_edges.count, 3u);
  EXPECT_EQ(checked.report.unbalanced_edges.count, 3u);
  EXPECT_TRUE(near(checked.report.open_edges.first_mm, Vector3d(10, 5, 0), 0));
  EXPECT_TRUE(mentions(checked.report.refusal, "3 edges belong to one triangle only (rims of holes), the first near (10, 5, 0)"))
      << checked.report.refusal;
  EXPECT_TRUE(mentions(checked.report.refusal, "Repair the model"));
}

TEST(MeshCheck, WithoutFirstAidAFinInTheSurfaceIsRefused) {
  Mesh mesh = box({0, 0, 0}, {1, 1, 1});
  mesh.vertices.emplace_back(2, 2, 2);
  mesh.triangles.emplace_back(1, 3, 8);
  const CheckedMesh checked = check_mesh(mesh, {.first_aid = false});
  EXPECT_FALSE(checked.report.usable);
  EXPECT_EQ(checked.report.non_manifold_edges.count, 1u);
  EXPECT_EQ(checked.report.open_edges.count, 2u);
  EXPECT_TRUE(mentions(checked.report.refusal, "1 edge has more triangles on one side than on the other"))
      << checked.report.refusal;
}

TEST(MeshCheck, RefusesOneSidedSurfaces) {
  // A Klein bottle as a grid: closed, every edge of two triangles, yet no orientation fits.
  const int n = 12;
  Mesh mesh;
  for (int i = 0; i < n; ++i)
    for (int j = 0; j < n; ++j) {
      const double u = 2 * kPi * i / n, v = 2 * kPi * j / n;
      const double r = 4 + std::cos(u / 2) * std::sin(v) - std::sin(u / 2) * std::sin(2 * v);
      mesh.vertices.emplace_back(r * std::cos(u), r * std::sin(u),
                                 std::sin(u / 2) * std::sin(v) + std::cos(u / 2) * std::sin(2 * v));
    }
  const auto number = [n](int i, int j) {  // u + 2 pi is u with v reversed
    if (i == n) j = n - j;
    return (i % n) * n + (j + n) % n;
  };
  for (int i = 0; i < n; ++i)
    for (int j = 0; j < n; ++j) {
      mesh.triangles.emplace_back(number(i, j), number(i + 1, j), number(i + 1, j + 1));
      mesh.triangles.emplace_back(number(i, j), number(i + 1, j + 1), number(i, j + 1));
    }
  const CheckedMesh checked = check_mesh(mesh);
  EXPECT_EQ(checked.report.open_edges.count, 0u);
  EXPECT_GT(checked.report.misoriented_edges.count, 0u);
  EXPECT_FALSE(checked.report.usable);
  EXPECT_TRUE(mentions(checked.report.refusal, "only one side")) << checked.report.refusal;
}

TEST(MeshCheck, RefusesNumbersThatAreNotFinite) {
  for (const double bad : {kNaN, kInfinity, -kInfinity}) {
    Mesh mesh = soup(box({0, 0, 0}, {1, 1, 1}));
    mesh.vertices[3 * 4 + 1].y() = bad;
    const CheckedMesh checked = check_mesh(mesh);
    EXPECT_FALSE(checked.report.usable);
    EXPECT_EQ(checked.report.not_finite.count, 1u);
    EXPECT_TRUE(mentions(checked.report.refusal, "triangle 5 of 12")) << checked.report.refusal;
    EXPECT_FALSE(mentions(checked.report.refusal, "nan")) << checked.report.refusal;
  }
}

TEST(MeshCheck, RequireSolidThrowsTheRefusal) {
  EXPECT_NEAR(volume(require_solid(flipped(box({0, 0, 0}, {1, 1, 1})), "box.stl").mesh), 1, 1e-15);
  Mesh mesh = box({0, 0, 0}, {1, 1, 1});
  mesh.triangles.pop_back();
  try {
    require_solid(mesh, "box.stl", {.first_aid = false});
    FAIL() << "accepted";
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), ErrorCode::input);
    EXPECT_EQ(std::string(error.what()), "box.stl: " + check_mesh(mesh, {.first_aid = false}).report.refusal);
  }
}

// ---------------------------------------------------------------------------------------------------- self-intersections

TEST(MeshCheck, CountsCrossingPairs) {
  // A tetrahedron through the face of another: its three faces that meet in the tip cross that face's one triangle each.
  Mesh mesh =
      merged({unit_tetrahedron(),
              moved(rotated(unit_tetrahedron(), Eigen::AngleAxisd(kPi, Vector3d::UnitX()).toRotationMatrix()), {0.2, 0.3, 0.5})});
  const CheckedMesh checked = check_mesh(mesh, {.unite = false});
  EXPECT_TRUE(checked.report.usable);
  EXPECT_GT(checked.report.self_intersections.count, 0u);
  EXPECT_TRUE(noted(checked.report, "crosses or touches itself"));
  CheckOptions without;
  without.self_intersections = false;
  EXPECT_EQ(check_mesh(mesh, without).report.self_intersections.count, 0u);

  std::size_t brute_force = 0;
  for (std::size_t s = 0; s < mesh.triangles.size(); ++s)
    for (std::size_t t = s + 1; t < mesh.triangles.size(); ++t) {
      const Vector3d p[3] = {mesh.corner(s, 0), mesh.corner(s, 1), mesh.corner(s, 2)};
      const Vector3d q[3] = {mesh.corner(t, 0), mesh.corner(t, 1), mesh.corner(t, 2)};
      brute_force += triangles_intersect(p, mesh.triangles[s], q, mesh.triangles[t]);
    }
  EXPECT_EQ(checked.report.self_intersections.count, brute_force);
}

// ------------------------------------------------------------------------------------------------------------ real meshes

namespace fs = std::filesystem;

nlohmann::json shared_stats() {
  std::ifstream file(test::shared_meshes() / "stats.json");
  return file ? nlohmann::json::parse(file) : nlohmann::json();
}

TEST(SharedMeshes, CountsAgreeWithTheirTable) {
  const nlohmann::json stats = shared_stats();
  if (stats.empty()) GTEST_SKIP() << "no " << test::shared_meshes();
  std::size_t seen = 0;
  for (const auto& expected : stats) {
    const std::string name = expected["file"];
    const fs::path path = test::shared_meshes() / fs::path(std::u8string(name.begin(), name.end()));
    if (!fs::exists(path)) continue;
    SCOPED_TRACE(name);
    ++seen;
    const MeshFile file = read_mesh(path);
    const CheckedMesh checked = check_mesh(file.mesh, {.first_aid = false});
    const MeshReport& r = checked.report;
    // The table was made from fans: faces that are not flat are split another way here, and enclose another volume.
    const bool bent =
        std::any_of(file.notes.begin(), file.notes.end(), [](const std::string& n) { return n.find("not flat") != n.npos; });
    const auto count = [&expected](const char* key) { return expected[key].get<std::size_t>(); };
    EXPECT_EQ(r.triangles_read, count("triangles"));
    EXPECT_EQ(r.degenerate.count, count("degenerate"));
    EXPECT_EQ(r.duplicate.count, count("duplicate"));
    EXPECT_EQ(r.open_edges.count, count("boundary_edges"));
    EXPECT_EQ(r.non_manifold_edges.count, count("nonmanifold_edges"));
    EXPECT_EQ(r.misoriented_edges.count, count("misoriented_edges"));
    EXPECT_EQ(r.components, count("components"));
    if (file.polygons == file.mesh.triangles.size()) {
      EXPECT_EQ(r.self_intersections.count, count("self_intersecting_pairs"));
    }
    if (r.duplicate.count == 0) {
      EXPECT_EQ(checked.mesh.vertices.size(), count("vertices"));
    }

    EXPECT_EQ(r.usable, r.refusal.empty());
    EXPECT_EQ(r.usable, count("boundary_edges") == 0) << r.refusal;  // on these meshes everything else can be mended
    if (!r.usable) continue;
    if (!r.notes.empty()) {
      EXPECT_TRUE(is_closed_solid(checked.mesh));
    }
    if (expected["closed"].get<bool>() && count("negative_components") == 0) {
      EXPECT_NEAR(volume(checked.mesh) / expected["volume"].get<double>(), 1, bent ? 1e-3 : 1e-6);
    }
  }
  EXPECT_EQ(seen, stats.size());
}

TEST(SharedMeshes, HowTheDifficultOnesAreMended) {
  if (shared_stats().empty()) GTEST_SKIP() << "no " << test::shared_meshes();
  const auto checked = [](const std::string& name) { return check_mesh(read_mesh(test::shared_meshes() / name).mesh); };

  const CheckedMesh crystal = checked("thingi10k_100827_chrystal.stl");  // T-junctions
  EXPECT_TRUE(crystal.report.usable) << crystal.report.refusal;
  EXPECT_EQ(crystal.report.first_aid.sides_split, 18u);
  EXPECT_EQ(crystal.report.components, 1u);

  const CheckedMesh arm = checked("thingi10k_73336_durgaarmright.stl");  // some triangles turned, and inside out
  EXPECT_NEAR(volume(arm.mesh), 1862.04, 0.01);
  EXPECT_EQ(arm.report.components_turned, 1u);

  const CheckedMesh tori = checked("torus3_in.obj");  // three equal tori, one inside out, one with turned triangles
  EXPECT_EQ(tori.report.components_turned, 1u);
  EXPECT_EQ(tori.report.cavities, 0u);
  const Components parts = connected_components(tori.mesh);
  ASSERT_EQ(parts.count, 3);
  std::vector<Mesh> torus(3, Mesh{tori.mesh.vertices, {}});
  for (std::size_t t = 0; t < tori.mesh.triangles.size(); ++t)
    torus[static_cast<std::size_t>(parts.of_triangle[t])].triangles.push_back(tori.mesh.triangles[t]);
  for (const Mesh& part : torus) EXPECT_GT(volume(part), 0);

  const CheckedMesh cuboctahedron = checked("thingi10k_61460_cuboctahedron_faces.stl");
  EXPECT_TRUE(noted(cuboctahedron.report, "2 pairs of triangles that lie on each other"));
  EXPECT_EQ(cuboctahedron.mesh.triangles.size(), 108u);

  const CheckedMesh dragon = checked("dragon_vrip_res3.ply");
  EXPECT_TRUE(noted(dragon.report, "wall without thickness"));
  EXPECT_EQ(dragon.report.first_aid.bodies_united, 4u);
  EXPECT_NEAR(volume(dragon.mesh), 0.000476154358, 1e-10);
}

}  // namespace
}  // namespace rayrep
