// Clips by quadrics, and what they are made of: triangulations in the plane that keep sides, and charts of quadrics.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "mesh/decimate.h"
#include "mesh/mesh_edges.h"
#include "mesh/planar_triangulation.h"
#include "mesh/predicates.h"
#include "mesh/quadric_cap.h"
#include "mesh/quadric_chart.h"
#include "mesh/quadric_clip.h"
#include "mesh/quadric_landing.h"
#include "mesh/quadric_refiner.h"
#include "rayrep/base/error.h"
#include "rayrep/make/cavity.h"
#include "rayrep/mesh/clip.h"
#include "rayrep/mesh/level_set.h"
#include "solids.h"

namespace rayrep {
namespace {

using namespace test;
using Eigen::Vector2d;
using Eigen::Vector3d;

/// Every triangle counter-clockwise, and every side the same seen from both of its triangles.
bool is_sound(const PlanarTriangulation& plane) {
  const auto& triangles = plane.triangles();
  for (int t = 0; t < static_cast<int>(triangles.size()); ++t) {
    const auto& c = triangles[t].corner;
    if (orient2d(plane.point(c[0]), plane.point(c[1]), plane.point(c[2])) <= 0) return false;
    for (int k = 0; k < 3; ++k) {
      const int u = triangles[t].neighbour[k];
      if (u < 0) continue;
      bool is_there = false;
      for (int j = 0; j < 3; ++j)
        is_there =
            is_there || (triangles[u].neighbour[j] == t && triangles[u].corner[(j + 1) % 3] == c[(k + 2) % 3] &&
                         triangles[u].corner[(j + 2) % 3] == c[(k + 1) % 3] && triangles[u].fixed[j] == triangles[t].fixed[k]);
      if (!is_there) return false;
    }
  }
  return true;
}

TEST(PlanarTriangulation, StaysOneOnAGridWhereAllIsInLine) {
  Random random(5);
  PlanarTriangulation plane({0, 0}, {12, 12});
  std::map<std::pair<int, int>, int> seen;
  for (int n = 0; n < 500; ++n) {
    const std::pair<int, int> at{static_cast<int>(random.uniform(0, 13)), static_cast<int>(random.uniform(0, 13))};
    const int number = plane.add(Vector2d(at.first, at.second), -1);
    EXPECT_EQ(number < 0, !seen.try_emplace(at, number).second);
    ASSERT_TRUE(is_sound(plane)) << n;
  }
  // Euler: with three points of a triangle around all others.
  EXPECT_EQ(plane.triangles().size(), 2 * (seen.size() + 3) - 5);
}

TEST(PlanarTriangulation, IsDelaunay) {
  Random random(6);
  PlanarTriangulation plane({-1, -1}, {1, 1});
  for (int n = 0; n < 200; ++n) plane.add(random.in_box(1).head<2>(), -1);
  for (const auto& triangle : plane.triangles()) {
    if (*std::min_element(triangle.corner.begin(), triangle.corner.end()) < PlanarTriangulation::kFirst) continue;
    const Vector2d a = plane.point(triangle.corner[0]);
    Eigen::Matrix2d sides;
    sides << (plane.point(triangle.corner[1]) - a).transpose(), (plane.point(triangle.corner[2]) - a).transpose();
    const Vector2d centre = sides.inverse() * (0.5 * sides.rowwise().squaredNorm());
    for (int n = PlanarTriangulation::kFirst; n < PlanarTriangulation::kFirst + 200; ++n)
      EXPECT_GT((plane.point(n) - a - centre).norm(), (1 - 1e-6) * centre.norm());
  }
}

/// A star with a hole: sides and area.
std::vector<std::array<int, 2>> add_ring(PlanarTriangulation& plane, int corners, double inner, double outer, int way) {
  std::vector<int> number;
  for (int n = 0; n < corners; ++n) {
    const double angle = way * 2 * kPi * n / corners;
    number.push_back(plane.add((n % 2 ? inner : outer) * Vector2d(std::cos(angle), std::sin(angle)), -1));
  }
  std::vector<std::array<int, 2>> sides;
  for (int n = 0; n < corners; ++n) sides.push_back({number[n], number[(n + 1) % corners]});
  return sides;
}

double area(const PlanarTriangulation& plane, const std::vector<char>& inside) {
  double sum = 0;
  for (std::size_t t = 0; t < inside.size(); ++t) {
    const auto& c = plane.triangles()[t].corner;
    const Vector2d u = plane.point(c[1]) - plane.point(c[0]);
    const Vector2d v = plane.point(c[2]) - plane.point(c[0]);
    if (inside[t]) sum += 0.5 * (u.x() * v.y() - u.y() * v.x());
  }
  return sum;
}

TEST(PlanarTriangulation, KeepsSidesAndTellsWhatTheyBound) {
  PlanarTriangulation plane({-10, -10}, {10, 10});
  auto sides = add_ring(plane, 30, 4, 10, 1);
  const auto hole = add_ring(plane, 14, 1, 3, -1);
  sides.insert(sides.end(), hole.begin(), hole.end());
  for (const auto& [a, b] : sides) ASSERT_TRUE(plane.fix(a, b));
  plane.improve();
  ASSERT_TRUE(is_sound(plane));
  const auto star = [](int corners, double inner, double outer) {
    return 0.5 * corners * inner * outer * std::sin(2 * kPi / corners);
  };
  EXPECT_NEAR(area(plane, plane.left_of(sides)), star(30, 4, 10) - star(14, 1, 3), 1e-10);
  std::reverse(sides.begin(), sides.end());
  for (auto& side : sides) std::swap(side[0], side[1]);
  EXPECT_TRUE(plane.left_of(sides).empty()) << "to the right of them lies the end of the plane";
}

TEST(PlanarTriangulation, RefusesSidesThatCrossAndThatRunThroughPoints) {
  PlanarTriangulation plane({0, 0}, {4, 4});
  const int a = plane.add({0, 0}, -1);
  const int b = plane.add({4, 4}, -1);
  const int c = plane.add({0, 4}, -1);
  const int d = plane.add({4, 0}, -1);
  EXPECT_TRUE(plane.fix(a, b));
  EXPECT_FALSE(plane.fix(c, d));
  const int e = plane.add({2, 0}, -1);
  EXPECT_FALSE(plane.fix(a, d));
  EXPECT_TRUE(plane.fix(a, e));
  EXPECT_TRUE(is_sound(plane));
}

enum class Kind {
  plane,
  one_sheet,
  ellipsoid,
  elliptic_cylinder,
  hyperbolic_cylinder,
  parabolic_cylinder,
  paraboloid,
  two_sheets,
  count
};

/// A quadric of a kind, of the size of the solids below, anywhere near the origin.
Quadric quadric(Kind kind, Random& random) {
  const Eigen::Matrix3d R = random_rotation(static_cast<std::uint64_t>(random.uniform(0, 1e9)));
  Vector3d bends = 0.1 * Vector3d::Ones() + random.in_box(0.05);
  double value = random.uniform(2, 5);  // at the centre, against the bends
  Vector3d slope = Vector3d::Zero();
  switch (kind) {
    case Kind::plane:
      bends.setZero(), slope = Vector3d::UnitX();
      break;
    case Kind::one_sheet:
      bends.z() *= -1;
      break;
    case Kind::two_sheets:
      bends.z() *= -1, value = -value;
      break;
    case Kind::elliptic_cylinder:
      bends.z() = 0;
      break;
    case Kind::hyperbolic_cylinder:
      bends.y() *= -1, bends.z() = 0;
      break;
    case Kind::parabolic_cylinder:
      bends.y() = bends.z() = 0, slope = Vector3d(0, 0, 0.5);
      break;
    case Kind::paraboloid:
      bends.z() = 0, slope = Vector3d(0, 0, 0.7);
      break;
    default:
      break;
  }
  const double sign = random.uniform() < 0.5 ? 1 : -1;
  const Vector3d centre = random.in_box(8);
  Quadric f;
  f.hessian = sign * R.transpose() * bends.asDiagonal() * R;
  f.slope = sign * R.transpose() * slope - f.hessian * centre;
  f.constant = -sign * value + 0.5 * centre.dot(f.hessian * centre) - sign * (R.transpose() * slope).dot(centre);
  return f;
}

TEST(QuadricChart, LiftsToWhatIsMappedThere) {
  Random random(8);
  int lifted = 0;
  for (int n = 0; n < 400; ++n) {
    const Quadric f = quadric(static_cast<Kind>(n % static_cast<int>(Kind::count)), random);
    std::vector<Vector3d> points;
    for (int k = 0; k < 40; ++k) {
      const Vector3d p = f.nearest(random.in_box(10));
      if (std::abs(f.value(p)) < 1e-9 && p.norm() < 30) points.push_back(p);
    }
    if (points.empty()) continue;
    for (const QuadricChart& chart : quadric_charts(f, {points}, 0.02))
      for (const Vector3d& p : points) {
        const Vector2d at = chart.at(p);
        const int turn = chart.orientation(f, p);
        if (turn == 0 || !at.allFinite() || at.norm() > 1e4) continue;
        const bool is_steep = std::abs(chart.axes.row(2).dot(f.gradient(p).normalized())) < 0.01;
        if (chart.kind == QuadricChart::Kind::graph && is_steep) continue;
        const std::optional<Vector3d> again = chart.lifted(f, at, turn);
        // A tube holds what is seen from its axis, which of two sheets along it is nothing.
        if (!again || (chart.at(*again) - at).norm() > 1e-6 * (1 + at.norm())) {
          EXPECT_NE(chart.kind, QuadricChart::Kind::graph) << n;
          continue;
        }
        ++lifted;
        if (chart.kind == QuadricChart::Kind::graph) {
          EXPECT_LT((*again - p).norm(), 1e-5) << n;
        }
      }
  }
  EXPECT_GT(lifted, 10000);
}

struct Solid {
  std::string name;
  std::function<double(const Vector3d&)> height;  ///< signed distance to its surface, exact near it
};
std::vector<Solid> solids() {
  return {{"ball", [](const Vector3d& p) { return p.norm() - 12; }},
          {"torus", [](const Vector3d& p) { return std::hypot(std::hypot(p.x(), p.y()) - 9, p.z()) - 4; }},
          {"box", [](const Vector3d& p) {
             return std::max({std::abs(p.x()) - 11, std::abs(p.y()) - 8, std::abs(p.z()) - 6});
           }}};
}

LevelSurface level_of(const Solid& solid) {
  return [height = solid.height](const Vector3d& p) -> std::optional<LevelAt> {
    constexpr double kStep = 1e-6;
    Vector3d slope;
    for (int k = 0; k < 3; ++k) slope[k] = height(p + kStep * Vector3d::Unit(k)) - height(p - kStep * Vector3d::Unit(k));
    return LevelAt{height(p), slope.normalized()};
  };
}

Mesh mesh_of(const Solid& solid, double spacing) {
  Mesh mesh = mesh_implicit(solid.height, {Vector3d::Constant(-14), Vector3d::Constant(14)}, spacing);
  const LevelSurface level = level_of(solid);
  for (Vector3d& v : mesh.vertices)
    for (int step = 0; step < 3; ++step) v -= level(v)->height_mm * level(v)->normal;
  return mesh;
}

int edges_not_of_two(const Mesh& mesh) {
  int count = 0;
  for_each_edge(mesh, [&](auto begin, auto end) { count += end - begin != 2 || edge_balance(begin, end) != 0; });
  return count;
}

/// Whether p is inside, by the solid angles that triangles have from there.
bool is_inside(const Mesh& mesh, const Vector3d& p) {
  double angle = 0;
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    const Vector3d a = mesh.corner(t, 0) - p;
    const Vector3d b = mesh.corner(t, 1) - p;
    const Vector3d c = mesh.corner(t, 2) - p;
    angle += 2 * std::atan2(a.dot(b.cross(c)),
                            a.norm() * b.norm() * c.norm() + a.dot(b) * c.norm() + b.dot(c) * a.norm() + c.dot(a) * b.norm());
  }
  return angle > 2 * kPi;
}

TEST(QuadricClip, OfEveryKindIsClosedAndHoldsWhatIsAbove) {
  constexpr int kCases = 20;  // of each kind
  constexpr double kError = 0.05;
  Random random(9);
  for (const Solid& solid : solids()) {
    const Mesh mesh = mesh_of(solid, 0.8);
    const double volume = mesh_moments(mesh)[M1];
    QuadricClipOptions options;
    options.error_mm = kError;
    options.surface = level_of(solid);
    int refused = 0;
    for (int n = 0; n < kCases * static_cast<int>(Kind::count); ++n) {
      const Quadric f = quadric(static_cast<Kind>(n % static_cast<int>(Kind::count)), random);
      const auto above = clip_by_quadric(mesh, f, options);
      const auto below = clip_by_quadric(mesh, -f, options);
      if (!above || !below) {
        ++refused;
        continue;
      }
      SCOPED_TRACE(solid.name + " " + std::to_string(n));
      EXPECT_EQ(edges_not_of_two(above->mesh), 0);
      for (std::size_t v = 0; v < above->on.size(); ++v) {
        if (above->on[v] != QuadricClipped::On::surface)
          EXPECT_LT(std::abs(f.distance(above->mesh.vertices[v])), 1e-6);
        else
          EXPECT_GT(f.value(above->mesh.vertices[v]), 0);
      }
      const double caps = surface_area(above->mesh) + surface_area(below->mesh);
      if (!above->mesh.triangles.empty() && !below->mesh.triangles.empty()) {
        EXPECT_NEAR(mesh_moments(above->mesh)[M1] + mesh_moments(below->mesh)[M1], volume, kError * caps);
      }
      for (int k = 0; k < 6; ++k) {
        const Vector3d p = random.in_box(14);
        const double d = f.distance(f.nearest(p)) == 0 ? (f.nearest(p) - p).norm() : std::abs(f.distance(p));
        if (d < 8 * kError || std::abs(solid.height(p)) < 8 * kError) continue;
        EXPECT_EQ(is_inside(above->mesh, p), solid.height(p) < 0 && f.value(p) > 0) << p.transpose();
      }
    }
    EXPECT_LE(refused, kCases * static_cast<int>(Kind::count) / 25) << solid.name;
  }
}

TEST(QuadricClip, CreasesLieOnBothSurfaces) {
  Random random(10);
  const Solid ball = solids().front();
  const Mesh mesh = mesh_of(ball, 1.0);
  QuadricClipOptions options;
  options.surface = level_of(ball);
  int creases = 0;
  for (int n = 0; n < 40; ++n) {
    const Quadric f = quadric(static_cast<Kind>(n % static_cast<int>(Kind::count)), random);
    const auto cut = clip_by_quadric(mesh, f, options);
    if (!cut) continue;
    double sum = 0;
    int here = 0;
    for (std::size_t v = 0; v < cut->on.size(); ++v)
      if (cut->on[v] == QuadricClipped::On::crease) {
        sum += std::pow(ball.height(cut->mesh.vertices[v]), 2);
        ++here;
      }
    // But for those whose surfaces all but touch.
    if (here > 0) {
      EXPECT_LT(std::sqrt(sum / here), 0.02) << n;
    }
    creases += here;
  }
  EXPECT_GT(creases, 2000);
}

/// Points at which caps meet the rest, whether they have found their place or not.
std::vector<Vector3d> rim_of(const QuadricClipped& cut) {
  std::vector<char> at_surface(cut.on.size(), 0);
  for (const Eigen::Vector3i& t : cut.mesh.triangles)
    for (const int a : t)
      for (const int b : t) at_surface[a] |= cut.on[b] == QuadricClipped::On::surface;
  std::vector<Vector3d> rim;
  for (std::size_t v = 0; v < cut.on.size(); ++v)
    if (cut.on[v] == QuadricClipped::On::crease || (cut.on[v] == QuadricClipped::On::cap && at_surface[v]))
      rim.push_back(cut.mesh.vertices[v]);
  return rim;
}

/// What chords may be off, as for cavities.
constexpr double kChord = 0.02;

TEST(QuadricClip, CreasesAreOnTheCurveWhereTheMeshCutsOffRidges) {
  Random random(13);
  for (const Solid& solid : solids())
    for (const double spacing : {0.8, 1.6}) {
      // Contouring leaves chamfers along the box's edges, deeper than the error.
      const Mesh mesh = mesh_of(solid, spacing);
      QuadricClipOptions options;
      options.error_mm = kChord;
      options.surface = level_of(solid);
      std::vector<double> off;
      int refused = 0;
      for (int n = 0; n < 6 * static_cast<int>(Kind::count); ++n) {
        SCOPED_TRACE(solid.name + " " + std::to_string(n));
        const Quadric f = quadric(static_cast<Kind>(n % static_cast<int>(Kind::count)), random);
        const auto cut = clip_by_quadric(mesh, f, options);
        refused += !cut;
        if (!cut) continue;
        EXPECT_EQ(edges_not_of_two(cut->mesh), 0);
        for (const Vector3d& p : rim_of(*cut)) off.push_back(std::max(std::abs(solid.height(p)), std::abs(f.distance(p))));
      }
      std::sort(off.begin(), off.end());
      ASSERT_GT(off.size(), 1000u);
      EXPECT_LE(refused, 4);
      EXPECT_LT(off[off.size() * 99 / 100], 1.5 * kChord) << solid.name << " " << spacing;
      EXPECT_LT(off.back(), 0.25) << solid.name << " " << spacing;
    }
}

/// Of the sides along creases of what is left of the surface.
std::vector<Vector3d> middles_of_creases(const QuadricClipped& cut) {
  using On = QuadricClipped::On;
  std::vector<Vector3d> middles;
  for (const Eigen::Vector3i& t : cut.mesh.triangles)
    for (int k = 0; k < 3; ++k) {
      const int a = t[k];
      const int b = t[(k + 1) % 3];
      if (cut.on[a] == On::crease && cut.on[b] == On::crease && cut.on[t[(k + 2) % 3]] == On::surface)
        middles.push_back(0.5 * (cut.mesh.vertices[a] + cut.mesh.vertices[b]));
    }
  return middles;
}

TEST(QuadricClip, ChordsOfCreasesDoNotLeaveTheSurface) {
  // A wall is outside: where a torus bends inward chords of the mesh take 0.06 mm of it.
  const Solid ring = solids()[1];
  const Mesh mesh = mesh_of(ring, 1.6);
  QuadricClipOptions options;
  options.error_mm = kChord;
  options.surface = level_of(ring);
  Random random(15);
  int creases = 0;
  for (int n = 0; n < 12; ++n) {
    const auto cut = clip_by_quadric(mesh, Quadric::plane(random.in_box(1).normalized(), random.uniform(-5, 5)), options);
    if (!cut) continue;
    for (const Vector3d& p : middles_of_creases(*cut)) {
      ++creases;
      EXPECT_LT(ring.height(p), 0.6 * kChord) << n;
    }
  }
  EXPECT_GT(creases, 500);
}

TEST(QuadricClip, ChordsOfCreasesOnFlatWallsAreCapped) {
  // On the walls of a box that few triangles are left of chords are long.
  const Solid cuboid = solids()[2];
  const Mesh mesh = decimated(mesh_of(cuboid, 0.4), {kChord, {}}).mesh;
  ASSERT_LT(mesh.triangles.size(), 3000u);
  QuadricClipOptions options;
  options.error_mm = kChord;
  options.surface = level_of(cuboid);
  Random random(16);
  int creases = 0;
  int far = 0;
  for (int n = 0; n < 40; ++n) {
    const double sign = random.uniform() < 0.5 ? 1 : -1;
    const double radius = random.uniform(7, 14);
    const Vector3d centre = random.in_box(5);
    const Quadric ball{sign * Eigen::Matrix3d::Identity() / radius, -sign * centre / radius,
                       0.5 * sign * (centre.squaredNorm() / radius - radius)};
    const auto cut = clip_by_quadric(mesh, ball, options);
    ASSERT_TRUE(cut) << n;
    for (const Vector3d& p : middles_of_creases(*cut)) {
      ++creases;
      far += std::abs(ball.distance(p)) > 1.2 * kChord;
    }
  }
  EXPECT_GT(creases, 2000);
  EXPECT_LE(far, creases / 100);
}

TEST(QuadricClip, TrianglesAtCreasesDoNotLeaveTheSurface) {
  const Solid ring = solids()[1];
  const Mesh mesh = mesh_of(ring, 1.6);
  QuadricClipOptions options;
  options.error_mm = kChord;
  options.surface = level_of(ring);
  Random random(16);
  int sides = 0;
  int leaving = 0;
  for (int n = 0; n < 12; ++n) {
    const auto cut = clip_by_quadric(mesh, Quadric::plane(random.in_box(1).normalized(), random.uniform(-5, 5)), options);
    if (!cut) continue;
    const auto is_on = [&cut](int v, QuadricClipped::On what) { return cut->on[v] == what; };
    for (const Eigen::Vector3i& t : cut->mesh.triangles)
      for (int k = 0; k < 3; ++k) {
        const int a = t[k];
        const int b = t[(k + 1) % 3];
        if (!is_on(a, QuadricClipped::On::crease) || !is_on(b, QuadricClipped::On::surface)) continue;
        ++sides;
        leaving += ring.height(0.5 * (cut->mesh.vertices[a] + cut->mesh.vertices[b])) > 0.6 * kChord;
      }
  }
  EXPECT_GT(sides, 1000);
  EXPECT_LE(leaving, sides / 50);
}

TEST(QuadricClip, CreasesAreOnTheCurveWhereTheMeshIsNotOnTheSurface) {
  Random random(17);
  for (const Solid& solid : {solids()[0], solids()[1]}) {
    const Mesh sound = mesh_of(solid, 1.0);
    QuadricClipOptions options;
    options.error_mm = kChord;
    options.surface = level_of(solid);
    std::vector<double> off;
    for (int n = 0; n < 24; ++n) {
      const Quadric f = quadric(static_cast<Kind>(n % static_cast<int>(Kind::count)), random);
      Mesh dented = sound;
      for (Vector3d& v : dented.vertices)
        if (std::abs(f.distance(v)) < 0.06) v -= 0.08 * options.surface(v)->normal;
      const auto cut = clip_by_quadric(dented, f, options);
      if (!cut) continue;
      EXPECT_EQ(edges_not_of_two(cut->mesh), 0);
      for (const Vector3d& p : rim_of(*cut)) off.push_back(std::max(std::abs(solid.height(p)), std::abs(f.distance(p))));
    }
    std::sort(off.begin(), off.end());
    ASSERT_GT(off.size(), 1000u);
    EXPECT_LT(off[off.size() * 999 / 1000], kChord) << solid.name;
  }
}

TEST(QuadricClip, IsSoundWhereSurfacesAllButTouch) {
  // Planes about the top of a ball, a torus and a box, level and all but level.
  for (const Solid& solid : solids()) {
    const Mesh mesh = mesh_of(solid, 1.2);
    QuadricClipOptions options;
    options.error_mm = kChord;
    options.surface = level_of(solid);
    const double top = bounding_box(mesh).max().z();
    for (double depth : {-1e-3, 1e-3, 0.01, 0.02, 0.05, 0.2, 1.0})
      for (const double sign : {1., -1.})
        for (const double slope : {0., 0.02}) {
          SCOPED_TRACE(solid.name + " " + std::to_string(sign * depth) + " " + std::to_string(slope));
          const Vector3d normal = sign * Vector3d(slope, 0.3 * slope, 1);
          const auto cut = clip_by_quadric(mesh, Quadric::plane(normal, sign * (top - depth)), options);
          ASSERT_TRUE(cut);
          EXPECT_EQ(edges_not_of_two(cut->mesh), 0);
          EXPECT_TRUE(crossing_triangles(cut->mesh).empty());
        }
  }
}

/// Triangles with an edge whose middle is inside of the solid by more than so much.
std::vector<std::size_t> chamfers(const Mesh& mesh, const Solid& solid, double depth) {
  std::vector<std::size_t> triangles;
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t)
    for (int k = 0; k < 3; ++k)
      if (solid.height(0.5 * (mesh.corner(t, k) + mesh.corner(t, (k + 1) % 3))) < -depth) {
        triangles.push_back(t);
        break;
      }
  return triangles;
}

TEST(QuadricRefiner, GivesBackTheRidgesThatAMeshCutsOff) {
  const Solid cuboid = solids().back();
  Mesh mesh = mesh_of(cuboid, 1.6);
  QuadricClipOptions options;
  options.error_mm = kChord;
  options.surface = level_of(cuboid);
  const Quadric nowhere = Quadric::plane(Vector3d::UnitZ(), 100);
  QuadricRefiner refiner(mesh, nowhere, options);
  const double lost_at_first = 8 * 11 * 8 * 6 - mesh_moments(mesh)[M1];
  for (int round = 0; round < 6; ++round)
    if (!refiner.split(chamfers(mesh, cuboid, kChord))) break;
  EXPECT_EQ(edges_not_of_two(mesh), 0);
  EXPECT_TRUE(crossing_triangles(mesh).empty());
  EXPECT_EQ(refiner.values().size(), mesh.vertices.size());
  for (const Vector3d& v : mesh.vertices) EXPECT_NEAR(cuboid.height(v), 0, 1e-6);
  EXPECT_LT(8 * 11 * 8 * 6 - mesh_moments(mesh)[M1], 0.1 * lost_at_first);
}

TEST(QuadricRefiner, MakesNothingCrossAtSharpEdges) {
  Random random(14);
  const Quadric nowhere = Quadric::plane(Vector3d::UnitZ(), 100);
  int split = 0;
  for (const double half_angle : {0.1, 0.2, 0.3, 0.5})
    for (int n = 0; n < 4; ++n) {
      const Eigen::Matrix3d R = random_rotation(static_cast<std::uint64_t>(random.uniform(0, 1e9)));
      const Solid wedge{"wedge", [R, half_angle](const Vector3d& p) {
                          const Vector3d q = R * p;
                          const double slope = std::cos(half_angle) * std::abs(q.x()) + std::sin(half_angle) * (q.z() - 9);
                          return std::max({slope, std::abs(q.y()) - 8, -q.z() - 7});
                        }};
      Mesh mesh = mesh_of(wedge, 1.3);
      if (!crossing_triangles(mesh).empty()) continue;
      QuadricClipOptions options;
      options.error_mm = kChord;
      options.surface = level_of(wedge);
      QuadricRefiner refiner(mesh, nowhere, options);
      for (int round = 0; round < 5; ++round) split += refiner.split(chamfers(mesh, wedge, kChord));
      EXPECT_EQ(edges_not_of_two(mesh), 0);
      EXPECT_TRUE(crossing_triangles(mesh).empty()) << half_angle << " " << n;
    }
  EXPECT_GT(split, 20);
}

TEST(QuadricRefiner, DoesNotSplitWhatCannotBeBetter) {
  const Solid ball = solids().front();
  Mesh mesh = mesh_of(ball, 1.2);
  QuadricClipOptions options;
  options.error_mm = 1;  // four of them are longer than any edge
  options.surface = level_of(ball);
  const Quadric nowhere = Quadric::plane(Vector3d::UnitZ(), 100);
  QuadricRefiner refiner(mesh, nowhere, options);
  const std::size_t before = mesh.triangles.size();
  EXPECT_FALSE(refiner.split({0, 1, 2}));
  EXPECT_EQ(mesh.triangles.size(), before);
}

TEST(QuadricRefiner, LandsCornersThatTheSurfaceHasOnTheOtherSide) {
  const Solid ball = solids().front();
  Mesh mesh = mesh_of(ball, 1.2);
  const int dented = mesh.triangles[40][0];
  const Vector3d place = mesh.vertices[dented];
  const Vector3d normal = place.normalized();
  mesh.vertices[dented] -= 0.08 * normal;
  QuadricClipOptions options;
  options.error_mm = kChord;
  options.surface = level_of(ball);
  const Mesh before = mesh;
  for (const double depth : {0.04, 0.2}) {
    mesh = before;
    const Quadric f = Quadric::plane(normal, place.dot(normal) - depth);
    QuadricRefiner refiner(mesh, f, options);
    const bool is_between = depth < 0.08;  // the vertex is below it and its place above
    EXPECT_EQ(refiner.land({40}), is_between);
    for (int n = 0; n < static_cast<int>(mesh.vertices.size()); ++n) {
      EXPECT_EQ(refiner.is_moved()[n] != 0, is_between && n == dented);
      EXPECT_EQ(refiner.is_new()[n], refiner.is_moved()[n]);
    }
    EXPECT_NEAR((mesh.vertices[dented] - place).norm(), is_between ? 0 : 0.08, 1e-6);
    EXPECT_DOUBLE_EQ(refiner.values()[dented], f.value(mesh.vertices[dented]));
  }
}

TEST(QuadricRefiner, LandsNothingBeyondAnotherSheet) {
  // A lid 0.05 mm thick, and a surface that goes through it.
  const Mesh sound = hollow(box({-5, -5, -5}, {5, 5, 6}), box({-4, -4, -4}, {4, 4, 5.95}));
  QuadricClipOptions options;
  options.error_mm = kChord;
  const Quadric f = Quadric::plane(Vector3d::UnitZ(), 5.98);
  for (const double depth : {0.03, 0.12}) {
    options.surface = [depth](const Vector3d& p) { return LevelAt{p.z() - (6 - depth), Vector3d::UnitZ()}; };
    Mesh mesh = sound;
    QuadricRefiner refiner(mesh, f, options);
    std::vector<std::size_t> lid;
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t)
      if (mesh.corner(t, 0).z() == 6 && mesh.corner(t, 1).z() == 6 && mesh.corner(t, 2).z() == 6) lid.push_back(t);
    ASSERT_EQ(lid.size(), 2u);
    EXPECT_EQ(refiner.land(lid), depth < 0.05);
    EXPECT_TRUE(crossing_triangles(mesh).empty());
    EXPECT_EQ(mesh.vertices == sound.vertices, depth > 0.05);
  }
}

TEST(QuadricLanding, FindsTheRidgeThatAnEdgeCutsOff) {
  const Solid cuboid = solids().back();
  QuadricClipOptions options;
  options.error_mm = kChord;
  options.surface = level_of(cuboid);
  const Quadric f = Quadric::plane(Vector3d::UnitZ(), 0);
  const QuadricLanding land(f, options);
  const auto ridge = land.on_ridge({11, 7.6, 1}, {10.7, 8, 1.4});
  ASSERT_TRUE(ridge);
  EXPECT_NEAR(ridge->x(), 11, 1e-6);
  EXPECT_NEAR(ridge->y(), 8, 1e-6);
  EXPECT_NEAR(ridge->z(), 1.2, 1e-6);
  EXPECT_FALSE(land.on_ridge({11, 7, 1}, {11, 6, 2})) << "within a face there is none";
  EXPECT_FALSE(land.on_ridge({11, 7.999, 1}, {10.999, 8, 1})) << "none worth it";
  const Solid ball = solids().front();
  options.surface = level_of(ball);
  EXPECT_FALSE(land.on_ridge({12, 0, 0}, 12 * Vector3d(std::cos(0.4), std::sin(0.4), 0))) << "what bends is no ridge";
}

TEST(QuadricCap, TellsWhereLoopsCross) {
  const Quadric f = Quadric::plane(Vector3d::UnitZ(), 0);
  Mesh mesh;
  for (const double x : {0., 4.})
    for (const auto& [dx, dy] : {std::pair{0, 0}, {5, 0}, {5, 5}, {0, 5}}) mesh.vertices.emplace_back(x + dx, x / 2 + dy, 0);
  // Seen from where f is negative, counter-clockwise: the two squares overlap in a corner.
  const std::vector<std::vector<int>> loops{{0, 3, 2, 1}, {4, 7, 6, 5}};
  std::vector<int> tangled;
  EXPECT_FALSE(append_caps(f, loops, 0.02, mesh, tangled));
  EXPECT_TRUE(mesh.triangles.empty());
  std::sort(tangled.begin(), tangled.end());
  tangled.erase(std::unique(tangled.begin(), tangled.end()), tangled.end());
  EXPECT_EQ(tangled, (std::vector<int>{1, 2, 3, 4, 5, 7})) << "the ends of the four sides that cross";
  EXPECT_TRUE(append_caps(f, {loops[0]}, 0.02, mesh, tangled));
  EXPECT_TRUE(tangled.empty());
}

TEST(QuadricClip, OfABallByAPlaneIsItsCapToSecondOrder) {
  const Solid ball = solids().front();
  const Quadric f{Eigen::Matrix3d::Zero(), Vector3d(0.6, 0, 0.8), -5};
  const double h = 12 - 5;
  const double exact = kPi * h * h * (3 * 12 - h) / 3;
  std::vector<double> errors;
  for (const double spacing : {1.6, 0.8, 0.4}) {
    QuadricClipOptions options;
    options.surface = level_of(ball);
    const auto cut = clip_by_quadric(mesh_of(ball, spacing), f, options);
    ASSERT_TRUE(cut);
    errors.push_back(exact - mesh_moments(cut->mesh)[M1]);
  }
  EXPECT_GT(errors.back(), 0) << "chords of a ball lie inside";
  for (std::size_t n = 1; n < errors.size(); ++n) EXPECT_NEAR(std::log2(errors[n - 1] / errors[n]), 2, 0.4);
}

TEST(QuadricClip, LeavesWhatIsNotCutBitByBit) {
  const Mesh ball = icosphere(10, 4);
  const Quadric f{Eigen::Matrix3d::Zero(), Vector3d::UnitZ(), -2.03};
  const auto cut = clip_by_quadric(ball, f, {});
  ASSERT_TRUE(cut);
  std::size_t same = 0;
  std::map<std::array<double, 3>, int> vertices;
  for (const Vector3d& v : ball.vertices) vertices[{v.x(), v.y(), v.z()}] = 1;
  for (std::size_t v = 0; v < cut->on.size(); ++v) {
    const Vector3d& p = cut->mesh.vertices[v];
    if (cut->on[v] == QuadricClipped::On::surface) same += vertices.contains({p.x(), p.y(), p.z()});
  }
  EXPECT_EQ(same, static_cast<std::size_t>(
                      std::count_if(ball.vertices.begin(), ball.vertices.end(), [](const Vector3d& v) { return v.z() > 2.03; })));
}

TEST(QuadricClip, OfWhatDoesNotMeetItIsAllOrNothing) {
  const Mesh ball = icosphere(10, 2);
  const auto all = clip_by_quadric(ball, {Eigen::Matrix3d::Zero(), Vector3d::UnitZ(), 20}, {});
  const auto none = clip_by_quadric(ball, {Eigen::Matrix3d::Zero(), Vector3d::UnitZ(), -20}, {});
  ASSERT_TRUE(all && none);
  EXPECT_EQ(all->mesh.triangles.size(), ball.triangles.size());
  EXPECT_TRUE(none->mesh.triangles.empty());
}

TEST(QuadricClip, FindsWhereLargeTrianglesAreMetInTheirMiddle) {
  // A cylinder through the middle of two sides of a box, none of whose edges it meets.
  Quadric f;
  f.hessian.diagonal() << -2, -2, 0;
  f.constant = 9;
  const auto cut = clip_by_quadric(box({-20, -20, -5}, {20, 20, 5}), f, {});
  ASSERT_TRUE(cut);
  EXPECT_EQ(edges_not_of_two(cut->mesh), 0);
  EXPECT_NEAR(mesh_moments(cut->mesh)[M1], 10 * kPi * 9, 0.02 * surface_area(cut->mesh));
}

TEST(QuadricClip, FollowsSmoothlyAndComesBack) {
  Random random(11);
  const Solid ball = solids().front();
  const Mesh mesh = mesh_of(ball, 1.0);
  QuadricClipOptions options;
  options.surface = level_of(ball);
  int followed = 0;
  for (int n = 0; n < 40; ++n) {
    const Quadric f = quadric(static_cast<Kind>(n % static_cast<int>(Kind::count)), random);
    const auto cut = clip_by_quadric(mesh, f, options);
    if (!cut || cut->mesh.triangles.empty()) continue;
    const auto nearby = [&f](double by) {
      Quadric moved = f;
      moved.constant += by * f.gradient(f.nearest(Vector3d::Zero())).norm();
      return moved;
    };
    const auto volume_at = [&](double by) {
      QuadricClipped moved = *cut;
      return follow(moved, nearby(by), options) ? mesh_moments(moved.mesh)[M1] : NAN;
    };
    const double step = 1e-3;
    const double second = volume_at(step) - 2 * volume_at(0) + volume_at(-step);
    if (!std::isfinite(second)) continue;
    ++followed;
    // A cap of area A and curvature k sweeps A step + k A step^2: nothing of the order of a step itself is left.
    EXPECT_LT(std::abs(second), 0.02 * step * surface_area(cut->mesh)) << n;
    QuadricClipped there = *cut;
    ASSERT_TRUE(follow(there, nearby(step), options));
    ASSERT_TRUE(follow(there, f, options));
    EXPECT_NEAR(mesh_moments(there.mesh)[M1], mesh_moments(cut->mesh)[M1], 1e-5 * surface_area(cut->mesh)) << n;
  }
  EXPECT_GT(followed, 25);
}

TEST(QuadricClip, FollowsPastVerticesOfTheSurface) {
  // By as much as their triangles are long.
  Random random(18);
  for (const Solid& solid : {solids()[0], solids()[1]}) {
    const Mesh mesh = mesh_of(solid, 0.4);
    QuadricClipOptions options;
    options.error_mm = kChord;
    options.surface = level_of(solid);
    for (int n = 0; n < 8; ++n) {
      const Vector3d normal = (Vector3d(0, 0, 1.5) + random.in_box(1)).normalized();
      const double height = random.uniform(-2, 2);
      auto cut = clip_by_quadric(mesh, Quadric::plane(normal, height), options);
      ASSERT_TRUE(cut);
      const Quadric f = Quadric::plane(normal, height + (n % 2 == 0 ? 0.2 : -0.2));
      ASSERT_TRUE(follow(*cut, f, options, true)) << solid.name << " " << n;
      EXPECT_TRUE(crossing_triangles(cut->mesh).empty()) << solid.name << " " << n;
      for (std::size_t v = 0; v < cut->on.size(); ++v) {
        const Vector3d& p = cut->mesh.vertices[v];
        const bool is_surface = cut->on[v] == QuadricClipped::On::surface;
        EXPECT_TRUE(is_surface ? f.distance(p) > 0 : std::abs(f.distance(p)) < 1e-6) << f.distance(p);
        EXPECT_TRUE(cut->on[v] == QuadricClipped::On::cap || std::abs(solid.height(p)) < 1e-3) << solid.height(p);
      }
    }
  }
}

// Clips of meshes by quadrics, as callers have them.

/// What lies where f > 0 and where f < 0, closed and together the whole.
void expect_parts(const Mesh& mesh, const Quadric& f, double error_mm) {
  const Mesh above = clipped(mesh, f, {error_mm});
  const Mesh below = clipped(mesh, -f, {error_mm});
  EXPECT_EQ(edges_not_of_two(above), 0);
  EXPECT_EQ(edges_not_of_two(below), 0);
  expect_moments_near(mesh_moments(above) + mesh_moments(below), mesh_moments(mesh), 1e-9, 20);
}

TEST(QuadricCut, PartsAddUpToTheWholeForEveryKind) {
  Random random(12);
  const Mesh bodies[] = {box({-11, -8, -6}, {11, 8, 6}), torus(9, 4, 30, 15), icosphere(12, 3),
                         hollow(box({-11, -11, -11}, {11, 11, 11}), box({-5, -4, -3}, {3, 4, 5}))};
  int refused = 0;
  for (const Mesh& body : bodies)
    for (int n = 0; n < 20 * static_cast<int>(Kind::count); ++n) {
      SCOPED_TRACE(n);
      const Quadric f = quadric(static_cast<Kind>(n % static_cast<int>(Kind::count)), random);
      try {
        expect_parts(body, f, 0.05);
      } catch (const Error& error) {
        EXPECT_EQ(error.code(), ErrorCode::input);
        EXPECT_THROW(clipped(body, -f, {0.05}), Error) << "the other part is refused, too";
        ++refused;
      }
    }
  EXPECT_LE(refused, 20);
}

TEST(QuadricCut, ADrillTakesOutItsCylinder) {
  const Mesh plate = box({-20, -15, -5}, {20, 15, 5});
  const Vector3d axis = Vector3d(0.1, 0.2, 1).normalized();
  const Quadric drill = Quadric::cylinder({3, -2, 1}, axis, 4);
  const double exact = kPi * 16 * 10 / axis.z();
  std::vector<double> missing;
  for (const double error : {0.04, 0.01, 0.0025}) {
    const Mesh core = clipped(plate, -drill, {error});
    missing.push_back(exact - mesh_moments(core)[M1]);
    EXPECT_GT(missing.back(), 0) << "chords lie inside";
    EXPECT_LT(missing.back(), error * 2 * kPi * 4 * 10 / axis.z());
    expect_parts(plate, drill, error);
    for (const Vector3d& v : core.vertices) {
      EXPECT_LT(drill.distance(v), 1e-12);
      EXPECT_LT(std::abs(v.z()), 5 + 1e-12);
    }
  }
  for (std::size_t n = 1; n < missing.size(); ++n)
    EXPECT_NEAR(std::log2(missing[n - 1] / missing[n]), 2, 1) << "of first order in it";
}

TEST(QuadricCut, CreasesAreOnBothSurfaces) {
  const Vector3d half(11, 8, 6);
  const Quadric f = Quadric::cylinder({4, 3, 0}, Vector3d(1, 2, 3).normalized(), 5);
  const Mesh cut = clipped(box(-half, half), f);
  int creases = 0;
  for (const Vector3d& v : cut.vertices) {
    const double to_box = (v.cwiseAbs() - half).maxCoeff();
    const double to_f = f.distance(v);
    EXPECT_LT(to_box, 1e-12);
    EXPECT_GT(to_f, -1e-12);
    EXPECT_LT(std::min(-to_box, to_f), 1e-12) << "on one of them at least";
    creases += -to_box < 1e-12 && to_f < 1e-12;
  }
  EXPECT_GT(creases, 50);
}

TEST(QuadricCut, RunsAlongEdgesAndThroughCorners) {
  const Mesh cube = box({-5, -5, -5}, {5, 5, 5});
  const Vector3d z = Vector3d::UnitZ();
  for (const double radius : {5., 5 * std::sqrt(2.), 2.5, 10.})
    for (const Vector3d& at :
         {Vector3d(0, 0, 0), Vector3d(5, 5, 0), Vector3d(0, 5, 0), Vector3d(5, 10, 0), Vector3d(2.5, 2.5, 2.5)})
      for (const Vector3d& axis : {z, Vector3d(Vector3d::UnitX()), Vector3d(Vector3d(1, 1, 1).normalized())}) {
        SCOPED_TRACE(radius);
        SCOPED_TRACE(at.transpose());
        SCOPED_TRACE(axis.transpose());
        expect_parts(cube, Quadric::cylinder(at, axis, radius), 0.02);
      }
  const Mesh quarter = clipped(cube, -Quadric::cylinder({5, 5, 0}, z, 5));
  EXPECT_NEAR(mesh_moments(quarter)[M1], kPi * 25 / 4 * 10, 0.02 * 80);
}

TEST(QuadricCut, AnEllipsoidWithinIsAShell) {
  Quadric f;  // positive inside of semi-axes 3, 4 and 5 about (1, 2, 0)
  f.hessian.diagonal() << -2. / 9, -2. / 16, -2. / 25;
  f.slope = -f.hessian * Vector3d(1, 2, 0);
  f.constant = 1 + 0.5 * Vector3d(1, 2, 0).dot(f.hessian * Vector3d(1, 2, 0));
  const double volume = 4 * kPi / 3 * 60;
  const Mesh body = box({-11, -11, -11}, {11, 11, 11});
  for (const double error : {0.1, 0.01}) {
    const Mesh inside = clipped(body, f, {error});
    EXPECT_TRUE(is_closed_solid(inside));
    EXPECT_LT(mesh_moments(inside)[M1], volume);
    EXPECT_GT(mesh_moments(inside)[M1], volume - error * 160);
    for (std::size_t t = 0; t < inside.triangles.size(); ++t) {
      const Vector3d middle = (inside.corner(t, 0) + inside.corner(t, 1) + inside.corner(t, 2)) / 3;
      EXPECT_LT(std::abs(f.distance(middle)), error);
    }
    expect_parts(body, f, error);
  }
  EXPECT_TRUE(clipped(box({20, 20, 20}, {30, 30, 30}), f).triangles.empty()) << "outside of the mesh it is nothing";
  const Mesh around = hollow(body, box({-8, -8, -8}, {8, 8, 8}));
  EXPECT_TRUE(clipped(around, f).triangles.empty()) << "nor is it in a hole of it";
}

TEST(QuadricCut, ByAPlaneIsTheClipByIt) {
  const Mesh body = torus(9, 4, 30, 15);
  const Vector3d normal = Vector3d(1, 2, 3).normalized();
  const Mesh by_quadric = clipped(body, Quadric::plane(3 * normal, 3 * 0.7));
  const Mesh by_plane = clipped(body, ClipPlane{normal, 0.7});
  EXPECT_EQ(by_quadric.triangles.size(), by_plane.triangles.size());
  expect_moments_near(mesh_moments(by_quadric), mesh_moments(by_plane), 1e-12, 20);
}

}  // namespace
}  // namespace rayrep
