#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <random>
#include <string>
#include <vector>

#include "places.h"
#include "rayrep/base/error.h"
#include "rayrep/io/mesh_io.h"
#include "rayrep/mesh/mesh_check.h"
#include "rayrep/mesh/surface_query.h"
#include "rayrep/physics/moments.h"
#include "solids.h"

namespace rayrep {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector2d;
using Eigen::Vector3d;
using namespace test;

double volume(const Mesh& mesh) { return mesh_moments(mesh)[M1]; }

bool same(const Mesh& a, const Mesh& b) { return a.vertices == b.vertices && a.triangles == b.triangles; }

/// |sum of area vectors| / sum of areas: 0 for every closed surface.
double openness(const Mesh& mesh) {
  Vector3d sum = Vector3d::Zero();
  double total = 0;
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    const Vector3d n = (mesh.corner(t, 1) - mesh.corner(t, 0)).cross(mesh.corner(t, 2) - mesh.corner(t, 0));
    sum += n;
    total += n.norm();
  }
  return sum.norm() / total;
}

/// Moments of a rotated body about the origin.
Moments rotated_moments(const Moments& s, const Matrix3d& R) {
  Matrix3d second;
  second << s[MXX], s[MXY], s[MXZ], s[MXY], s[MYY], s[MYZ], s[MXZ], s[MYZ], s[MZZ];
  second = (R * second * R.transpose()).eval();
  Moments r;
  r << s[M1], R * s.segment<3>(MX), second(0, 0), second(1, 1), second(2, 2), second(0, 1), second(1, 2), second(0, 2);
  return r;
}

/// The union of `mesh`, in many orientations, has the expected moments and a closed surface.
void expect_union(const Mesh& mesh, const Moments& expected, double length_mm, double relative = 1e-11) {
  for (std::uint64_t seed = 0; seed < 25; ++seed) {
    const Matrix3d R = seed == 0 ? Matrix3d::Identity() : random_rotation(seed);
    const Mesh result = boundary_of_union(rotated(mesh, R));
    SCOPED_TRACE("rotation " + std::to_string(seed));
    expect_moments_near(mesh_moments(result), rotated_moments(expected, R), relative, length_mm);
    EXPECT_LT(openness(result), 1e-12);
  }
}

// ---------------------------------------------------------------------------------------------------- nothing to be done

TEST(BoundaryOfUnion, ComesBackAsItIsWhenNothingOverlaps) {
  const Mesh ball = icosphere(10, 3);
  const Mesh tori =
      merged({torus(10, 2, 40, 20),
              moved(rotated(torus(10, 2, 40, 20), Eigen::AngleAxisd(kPi / 2, Vector3d::UnitX()).matrix()), {10, 0, 0})});  // linked
  for (const Mesh& mesh : {ball, l_shape(), staircase(5), hollow(ball, icosphere(4, 2)),
                           merged({hollow(ball, icosphere(4, 2)), icosphere(1, 1)}), merged({ball, icosphere(10, 2, {30, 0, 0})}),
                           tori, merged({box({0, 0, 0}, {1, 1, 1}), box({1, 1, 0}, {2, 2, 1})}), soup(icosphere(3, 2)), Mesh{}})
    EXPECT_TRUE(same(boundary_of_union(mesh), mesh));
}

TEST(BoundaryOfUnion, StopsWhenAsked) {
  Progress progress;
  progress.cancelled = [] { return true; };
  try {
    boundary_of_union(icosphere(1, 2), progress);
    FAIL() << "not interrupted";
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), ErrorCode::interrupted);
  }
}

// ---------------------------------------------------------------------------------------------------------------- boxes

TEST(BoundaryOfUnion, OverlappingBoxes) {
  const Vector3d a0(0, 0, 0), a1(2, 2, 2), b0(1, 1.1, 1.2), b1(3, 3.3, 3.4);
  const Moments expected = box_moments(a0, a1) + box_moments(b0, b1) - box_moments(b0, a1);
  expect_union(merged({box(a0, a1), box(b0, b1)}), expected, 5);
  expect_union(merged({box(b0, b1), box(a0, a1)}), expected, 5);
}

TEST(BoundaryOfUnion, BoxesThatTouch) {
  const Moments base = box_moments({0, 0, 0}, {2, 2, 2});
  struct Case {
    std::string name;
    Vector3d min, max;
  };
  const std::vector<Case> cases = {
      {"equal faces", {2, 0, 0}, {4, 2, 2}},          {"smaller face inside", {2, 0.5, 0.6}, {3, 1.5, 1.7}},
      {"overlapping faces", {2, 0.5, -1}, {3, 3, 1}}, {"an edge", {2, 2, 0}, {3, 3, 2}},
      {"part of an edge", {2, 2, 0.5}, {3, 3, 1}},    {"a corner", {2, 2, 2}, {3, 3, 3}},
      {"larger face around", {2, -1, -1}, {3, 3, 3}}};
  for (const auto& [name, min, max] : cases) {
    SCOPED_TRACE(name);
    const Moments expected = base + box_moments(min, max);
    expect_union(merged({box({0, 0, 0}, {2, 2, 2}), box(min, max)}), expected, 5);
    expect_union(merged({box(min, max), box({0, 0, 0}, {2, 2, 2})}), expected, 5);
  }
}

TEST(BoundaryOfUnion, FacesThatNearlyTouch) {
  // Gaps, overlaps and tilts from far below to far above the tolerance in which sheets count as lying on each other.
  const Mesh base = box({0, 0, 0}, {2, 2, 2});
  for (int power = -17; power <= -5; ++power)
    for (const double gap : {0.0, std::pow(10, power), -std::pow(10, power)})
      for (const double tilt : {0.0, std::pow(10, power)})
        for (std::uint64_t seed = 0; seed < 4; ++seed) {
          const Matrix3d R = seed == 0 ? Matrix3d::Identity() : random_rotation(seed);
          const Mesh top =
              moved(rotated(box({0.3, 0.4, 0}, {1.5, 2.5, 1}), Eigen::AngleAxisd(tilt, Vector3d(1, 1, 0).normalized()).matrix()),
                    {0, 0, 2 + gap});
          const Mesh result = boundary_of_union(rotated(merged({base, top}), R));
          const double slack = 5e-6 + 20 * (std::abs(gap) + tilt);  // rounding over tilt moves the line where they cross
          EXPECT_NEAR(volume(result), 8 + 1.2 * 2.1, slack) << power << " " << gap << " " << tilt << " " << seed;
          EXPECT_LT(openness(result), 2e-6) << power << " " << gap << " " << tilt << " " << seed;
        }
}

TEST(BoundaryOfUnion, TouchingFacesDisappear) {
  const Mesh result = boundary_of_union(merged({box({0, 0, 0}, {1, 1, 1}), box({1, 0, 0}, {2, 1, 1})}));
  double area = 0;
  for (std::size_t t = 0; t < result.triangles.size(); ++t)
    area += (result.corner(t, 1) - result.corner(t, 0)).cross(result.corner(t, 2) - result.corner(t, 0)).norm() / 2;
  EXPECT_NEAR(area, 10, 1e-12);
}

TEST(BoundaryOfUnion, BoxesWithCommonFacePlanes) {
  const Moments long_box = box_moments({0, 0, 0}, {3, 1, 1});
  expect_union(merged({box({0, 0, 0}, {2, 1, 1}), box({1, 0, 0}, {3, 1, 1})}), long_box, 4);          // four planes in common
  expect_union(merged({box({0, 0, 0}, {3, 1, 1}), box({1, 0.25, 0.5}, {2, 0.75, 1})}), long_box, 4);  // inside, one flush face
  expect_union(merged({box({0, 0, 0}, {3, 1, 1}), box({0, 0, 0}, {1, 1, 1})}), long_box, 4);          // inside, five flush faces
  expect_union(merged({box({0, 0, 0}, {3, 1, 1}), box({0, 0, 0}, {3, 1, 1})}), long_box, 4);          // twice the same
  expect_union(merged({box({0, 0, 0}, {3, 1, 1}), box({0, 0, 0}, {3, 1, 1}), box({0, 0, 0}, {3, 1, 1})}), long_box, 4);
  const Moments cross =
      box_moments({-3, -1, 0}, {3, 1, 1}) + box_moments({-1, -3, 0}, {1, 3, 1}) - box_moments({-1, -1, 0}, {1, 1, 1});
  expect_union(merged({box({-3, -1, 0}, {3, 1, 1}), box({-1, -3, 0}, {1, 3, 1})}), cross, 6);  // a cross lying flat
}

TEST(BoundaryOfUnion, AFullBlockOfTouchingCells) {
  Mesh cells;
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j)
      for (int k = 0; k < 3; ++k) append(cells, box(Vector3d(i, j, k), Vector3d(i + 1, j + 1, k + 1)));
  expect_union(cells, box_moments({0, 0, 0}, {3, 3, 3}), 4);
  const Mesh result = boundary_of_union(cells);
  for (const auto& v : result.vertices) {  // nothing is left inside
    const double depth = std::min(v.minCoeff(), (Vector3d(3, 3, 3) - v).minCoeff());
    EXPECT_NEAR(depth, 0, 1e-12);
  }
}

TEST(BoundaryOfUnion, NestedBodiesOfTheSameOrientation) {
  const Mesh outer = box({0, 0, 0}, {4, 4, 4});
  const Mesh result = boundary_of_union(merged({box({1, 1, 1}, {2, 2, 2}), outer, box({1.2, 1.2, 1.2}, {1.5, 1.5, 1.5})}));
  EXPECT_EQ(result.triangles.size(), outer.triangles.size());
  EXPECT_EQ(result.vertices.size(), outer.vertices.size());
  expect_moments_near(mesh_moments(result), box_moments({0, 0, 0}, {4, 4, 4}), 1e-14, 4);
}

TEST(BoundaryOfUnion, CavitiesAreRespected) {
  const Mesh shell = hollow(box({0, 0, 0}, {10, 10, 10}), box({1, 1, 1}, {9, 9, 9}));
  const Moments walls = box_moments({0, 0, 0}, {10, 10, 10}) - box_moments({1, 1, 1}, {9, 9, 9});
  // A rod through both walls, and a block that fills part of the cavity and lies on its floor.
  expect_union(merged({shell, box({-5, 4, 4}, {15, 5, 5})}),
               walls + box_moments({-5, 4, 4}, {0, 5, 5}) + box_moments({1, 4, 4}, {9, 5, 5}) + box_moments({10, 4, 4}, {15, 5, 5}),
               15);
  expect_union(merged({shell, box({3, 3, 1}, {5, 5, 4})}), walls + box_moments({3, 3, 1}, {5, 5, 4}), 15);
  // The cavity filled exactly.
  expect_union(merged({shell, box({1, 1, 1}, {9, 9, 9})}), box_moments({0, 0, 0}, {10, 10, 10}), 15);
}

TEST(BoundaryOfUnion, BoxThroughBoxInGeneralRotation) {
  // A square rod through a slab: the slab is as high as the rod's middle part, whatever the rotation about the rod's axis.
  const Mesh slab = box({-5, -5, -1}, {5, 5, 1});
  for (std::uint64_t seed = 0; seed < 10; ++seed) {
    Random random(seed);
    const Matrix3d about_axis = Eigen::AngleAxisd(random.uniform(0, 3), Vector3d::UnitZ()).matrix();
    const Mesh rod = rotated(box({-1, -1, -4}, {1, 1, 4}), about_axis);
    const Moments expected =
        box_moments({-5, -5, -1}, {5, 5, 1}) + box_moments({-1, -1, -4}, {1, 1, 4}) - box_moments({-1, -1, -1}, {1, 1, 1});
    const Matrix3d R = random_rotation(seed + 100);
    const Mesh result = boundary_of_union(rotated(merged({slab, rod}), R));
    expect_moments_near(mesh_moments(result), rotated_moments(expected, R), 1e-12, 10);
    EXPECT_LT(openness(result), 1e-13);
  }
}

// --------------------------------------------------------------------------------------------------------- other bodies

TEST(BoundaryOfUnion, TwoBallsAndTheirLens) {
  const double R = 10, d = 8;
  const double lens = kPi * (4 * R + d) * (2 * R - d) * (2 * R - d) / 12;
  const double expected = 2 * 4.0 / 3 * kPi * R * R * R - lens;
  std::vector<double> errors;
  for (int s = 2; s <= 5; ++s) {
    const Mesh result = boundary_of_union(merged({icosphere(R, s), icosphere(R, s, {d * 0.6, 0, d * 0.8})}));
    EXPECT_LT(openness(result), 1e-13);
    errors.push_back(std::abs(volume(result) / expected - 1));
  }
  for (std::size_t i = 1; i < errors.size(); ++i)
    EXPECT_NEAR(std::log2(errors[i - 1] / errors[i]), 2, 0.1) << errors[i];  // second order
  EXPECT_LT(errors.back(), 1e-3);
}

TEST(BoundaryOfUnion, ABallWithItself) {
  const Mesh ball = icosphere(10, 2);
  expect_union(merged({ball, ball}), mesh_moments(ball), 10);
  expect_union(merged({ball, soup(ball)}), mesh_moments(ball), 10);  // the copies share no vertex numbers
}

TEST(BoundaryOfUnion, ASurfaceThatCrossesItself) {
  // A tube along a figure of eight: one component, crossing itself in the middle. Each ring is a regular n-gon about the curve's
  // tangent.
  const int m = 160, n = 24;
  const double r = 1.5;
  Mesh tube;
  for (int i = 0; i < m; ++i) {
    const double u = 2 * kPi * i / m;
    const Vector3d centre(20 * std::sin(u), 10 * std::sin(2 * u), 0);
    const Vector3d tangent = Vector3d(20 * std::cos(u), 20 * std::cos(2 * u), 0).normalized();
    const Vector3d side = Vector3d::UnitZ().cross(tangent);
    for (int j = 0; j < n; ++j) {
      const double v = 2 * kPi * (j + 0.5) / n;
      tube.vertices.push_back(centre + r * (std::cos(v) * side + std::sin(v) * Vector3d::UnitZ()));
    }
  }
  const auto number = [](int i, int j) { return i % m * n + j % n; };
  for (int i = 0; i < m; ++i)
    for (int j = 0; j < n; ++j) {
      tube.triangles.emplace_back(number(i, j), number(i + 1, j), number(i + 1, j + 1));
      tube.triangles.emplace_back(number(i, j), number(i + 1, j + 1), number(i, j + 1));
    }
  if (volume(tube) < 0) flip(tube);
  const CheckedMesh checked = check_mesh(tube);
  ASSERT_TRUE(checked.report.usable);
  ASSERT_GT(checked.report.self_intersections.count, 0u);
  const Mesh result = boundary_of_union(tube);
  EXPECT_LT(openness(result), 1e-13);
  // The branches cross at a right angle, where two cylinders of radius r share 16 r^3 / 3.
  const double steinmetz = 16 * r * r * r / 3;
  EXPECT_NEAR((volume(tube) - volume(result)) / steinmetz, 1, 0.05);
}

// ------------------------------------------------------------------------------------------- twin: rays through true boxes

struct TurnedBox {
  Vector3d half, centre;
  Matrix3d R;
};

/// Moments of the union of boxes by midpoint quadrature over rays; each ray is clipped by the boxes' slabs, so no mesh is involved.
Moments rays_through(const std::vector<TurnedBox>& boxes, double half, int n, const Vector2d& shift) {
  Moments sum = Moments::Zero();
  const double h = 2 * half / n;
  std::vector<std::pair<double, double>> spans;
  for (int j = 0; j < n; ++j)
    for (int i = 0; i < n; ++i) {
      const Vector2d p(-half + (i + shift.x()) * h, -half + (j + shift.y()) * h);
      spans.clear();
      for (const auto& box : boxes) {
        double lo = -1e9, hi = 1e9;
        const Vector3d from = box.R.transpose() * (Vector3d(p.x(), p.y(), 0) - box.centre);
        const Vector3d along = box.R.transpose() * Vector3d::UnitZ();
        for (int k = 0; k < 3; ++k) {
          const double a = (-box.half[k] - from[k]) / along[k], b = (box.half[k] - from[k]) / along[k];
          lo = std::max(lo, std::min(a, b));
          hi = std::min(hi, std::max(a, b));
        }
        if (lo < hi) spans.emplace_back(lo, hi);
      }
      std::sort(spans.begin(), spans.end());
      double reached = -1e9;
      for (auto [lo, hi] : spans) {
        lo = std::max(lo, reached);
        if (hi <= lo) continue;
        reached = hi;
        const double z1 = hi - lo, z2 = (hi * hi - lo * lo) / 2, z3 = (hi * hi * hi - lo * lo * lo) / 3;
        Moments s;
        s << z1, p.x() * z1, p.y() * z1, z2, p.x() * p.x() * z1, p.y() * p.y() * z1, z3, p.x() * p.y() * z1, p.y() * z2, p.x() * z2;
        sum += h * h * s;
      }
    }
  return sum;
}

TEST(BoundaryOfUnion, TwentyBoxesAgainstRays) {
  Random random(11);
  std::vector<TurnedBox> boxes;
  Mesh mesh;
  for (std::uint64_t n = 0; n < 20; ++n) {
    TurnedBox b{Vector3d(random.uniform(0.5, 2), random.uniform(0.5, 2), random.uniform(0.5, 2)), random.in_box(2.5),
                random_rotation(n)};
    append(mesh, moved(rotated(box(-b.half, b.half), b.R), b.centre));
    boxes.push_back(b);
  }
  const Mesh result = boundary_of_union(mesh);
  EXPECT_LT(openness(result), 1e-13);
  const Moments exact = mesh_moments(result);
  EXPECT_LT(exact[M1], 0.7 * volume(mesh));  // much overlap

  // The quadrature converges to the exact moments: root mean square error over a few shifted grids.
  std::vector<double> logs;
  std::vector<double> last(10);
  for (const int n : {25, 50, 100, 200, 400}) {
    Moments square = Moments::Zero();
    const int shifts = n < 400 ? 8 : 3;
    for (int s = 0; s < shifts; ++s)
      square += (rays_through(boxes, 7, n, {random.uniform(), random.uniform()}) - exact).cwiseAbs2() / shifts;
    logs.push_back(0.5 * std::log2(square[M1]));
    for (int k = 0; k < 10; ++k) last[static_cast<std::size_t>(k)] = std::sqrt(square[k]);
  }
  EXPECT_LT((logs.back() - logs.front()) / 4, -1.2);  // mean slope; 1.5 is expected where rays meet slanted silhouettes
  EXPECT_LT(last[M1], 1e-4 * exact[M1]);
  for (std::size_t k = 0; k < 10; ++k) EXPECT_LT(last[k], 2e-4 * exact[M1] * (k < 4 ? 5 : 25)) << k;
}

TEST(BoundaryOfUnion, DoesNotDependOnOrderOrThreads) {
  std::vector<Mesh> bodies;
  for (std::uint64_t n = 0; n < 8; ++n)
    bodies.push_back(moved(rotated(box({-1, -2, -1}, {1, 2, 1}), random_rotation(n)), Random(n).in_box(1.5)));
  Mesh forward, backward;
  for (std::size_t n = 0; n < bodies.size(); ++n) {
    append(forward, bodies[n]);
    append(backward, bodies[bodies.size() - 1 - n]);
  }
  const Mesh result = boundary_of_union(forward);
  expect_moments_near(mesh_moments(boundary_of_union(backward)), mesh_moments(result), 1e-12, 5);
  for (const std::size_t threads : {1u, 5u}) {
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
    EXPECT_TRUE(same(boundary_of_union(forward), result)) << threads;
  }
}

TEST(BoundaryOfUnion, EverySheetOfTheResultSeparatesMaterialFromVoid) {
  Mesh mesh;
  for (std::uint64_t n = 0; n < 6; ++n) append(mesh, moved(rotated(icosphere(2, 1), random_rotation(n)), Random(n).in_box(2)));
  const SurfaceQuery before(mesh);
  const SurfaceQuery after(boundary_of_union(mesh));
  Random random(3);
  std::vector<LineHit> hits;
  std::size_t crossings = 0;
  for (int n = 0; n < 2000; ++n) {
    const Vector2d p(random.uniform(-4, 4), random.uniform(-4, 4));
    std::vector<double> expected;
    line_hits_brute_force(before.mesh(), p, hits);
    int winding = 0;
    for (const auto& hit : hits) {
      if ((winding > 0) != (winding + hit.sign > 0)) expected.push_back(hit.z_mm);
      winding += hit.sign;
    }
    line_hits_brute_force(after.mesh(), p, hits);
    ASSERT_EQ(hits.size(), expected.size()) << p.transpose();
    for (std::size_t k = 0; k < hits.size(); ++k) {
      ASSERT_NEAR(hits[k].z_mm, expected[k], 1e-11);
      ASSERT_EQ(hits[k].sign, k % 2 ? -1 : 1);
    }
    crossings += hits.size();
  }
  EXPECT_GT(crossings, 1000u);
}

// ------------------------------------------------------------------------------------------------------------ real meshes

TEST(SharedMeshesUnion, VolumesAgreeWithRays) {
  const std::filesystem::path folder = test::shared_meshes();
  if (!std::filesystem::exists(folder)) GTEST_SKIP() << "no " << folder;
  for (const std::string name :
       {"utah_teapot_solid.stl", "rabbit.obj", "human_man.obj", "heartgears.3mf", "thingi10k_61460_cuboctahedron_faces.stl",
        "dragon_vrip_res3.ply", "cycloidal.ply", "slic3r_4486_100_000.stl"}) {
    SCOPED_TRACE(name);
    CheckOptions options;
    options.self_intersections = false;
    const Mesh given = require_solid(read_mesh(folder / name).mesh, name, options).mesh;
    const Mesh mesh = rotated(given, random_rotation(5));  // so that walls do not run along the grid of rays
    const Mesh result = boundary_of_union(mesh);
    EXPECT_LT(openness(result), 1e-9);  // sheets folded onto each other: cut to the touching tolerance only

    const SurfaceQuery surface(mesh);
    const Eigen::AlignedBox3d bounds = bounding_box(mesh);
    const int n = 400;
    const Vector2d step = bounds.sizes().head<2>() / n;
    std::vector<LineHit> hits;
    double sum = 0;
    for (int j = 0; j < n; ++j)
      for (int i = 0; i < n; ++i) {
        surface.line_hits(bounds.min().head<2>() + Vector2d((i + 0.4877) * step.x(), (j + 0.5123) * step.y()), hits);
        int winding = 0;
        double entered = 0;
        for (const auto& hit : hits) {
          if (winding <= 0 && winding + hit.sign > 0) entered = hit.z_mm;
          if (winding > 0 && winding + hit.sign <= 0) sum += hit.z_mm - entered;
          winding += hit.sign;
        }
      }
    EXPECT_NEAR(sum * step.prod() / volume(result), 1, 3e-4);
  }
}

TEST(BoundaryOfUnion, AThicketOfHundredsOfBoxes) {
  Mesh thicket;
  std::mt19937_64 random(7);
  std::uniform_real_distribution<double> shift(0, 1);
  std::vector<Vector3d> low;
  for (int n = 0; n < 300; ++n) {
    const Vector3d at{shift(random), shift(random), shift(random)};
    low.push_back(at);
    append(thicket, moved(box({0, 0, 0}, {10, 10, 10}), at));
  }
  const SurfaceQuery boundary(boundary_of_union(thicket));
  for (int n = 0; n < 500; ++n) {
    const Vector2d p{11 * shift(random), 11 * shift(random)};
    double bottom = 100, top = -100;  // all of them overlap in z
    for (const Vector3d& at : low)
      if ((p.array() > at.head<2>().array()).all() && (p.array() < at.head<2>().array() + 10).all()) {
        bottom = std::min(bottom, at.z());
        top = std::max(top, at.z() + 10);
      }
    std::vector<LineHit> hits;
    line_hits_brute_force(boundary.mesh(), p, hits);
    ASSERT_EQ(hits.size(), top > bottom ? 2u : 0u) << p.transpose();
    if (hits.empty()) continue;
    EXPECT_NEAR(hits[0].z_mm, bottom, 1e-12);
    EXPECT_NEAR(hits[1].z_mm, top, 1e-12);
  }
}

}  // namespace
}  // namespace rayrep
