#pragma once

// Test bodies with known moments, all exactly closed (triangles share vertices) and facing outward, and the matchers that go with
// them. Lengths in mm.

#include <gtest/gtest.h>
#include <unistd.h>

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <filesystem>
#include <initializer_list>
#include <map>
#include <numbers>
#include <random>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

#include "rayrep/base/error.h"
#include "rayrep/mesh/delivery.h"
#include "rayrep/mesh/mesh.h"
#include "rayrep/physics/moments.h"
#include "shapes.h"

namespace rayrep::test {

inline constexpr double kPi = std::numbers::pi;

// ---------------------------------------------------------------------------------------------------------------- bodies

/// Corners at the origin and the three unit points: moments 1/6, 1/24, 1/60 (xx) and 1/120 (xy).
inline Mesh unit_tetrahedron() {
  Mesh mesh;
  mesh.vertices = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
  mesh.triangles = {{0, 2, 1}, {0, 1, 3}, {0, 3, 2}, {1, 2, 3}};
  return mesh;
}

/// Each triangle cut into four at the middles of its edges, `times` times.
inline Mesh subdivided(Mesh mesh, int times) {
  for (int s = 0; s < times; ++s) {
    std::map<std::pair<int, int>, int> middles;
    const auto middle = [&](int a, int b) {
      const auto [it, added] = middles.try_emplace(std::minmax(a, b), static_cast<int>(mesh.vertices.size()));
      if (added) mesh.vertices.push_back((mesh.vertices[a] + mesh.vertices[b]) / 2);
      return it->second;
    };
    std::vector<Eigen::Vector3i> finer;
    finer.reserve(4 * mesh.triangles.size());
    for (const auto& t : mesh.triangles) {
      const int a = middle(t[0], t[1]);
      const int b = middle(t[1], t[2]);
      const int c = middle(t[2], t[0]);
      finer.insert(finer.end(), {{t[0], a, c}, {a, t[1], b}, {c, b, t[2]}, {a, b, c}});
    }
    mesh.triangles = std::move(finer);
  }
  return mesh;
}

/// An icosahedron with each triangle cut into four `subdivisions` times, all vertices at `radius` from `centre`: 20 * 4^s
/// triangles.
inline Mesh icosphere(double radius, int subdivisions, const Eigen::Vector3d& centre = Eigen::Vector3d::Zero()) {
  const double g = std::numbers::phi;
  Mesh mesh;
  mesh.vertices = {{-1, g, 0},  {1, g, 0},  {-1, -g, 0}, {1, -g, 0}, {0, -1, g},  {0, 1, g},
                   {0, -1, -g}, {0, 1, -g}, {g, 0, -1},  {g, 0, 1},  {-g, 0, -1}, {-g, 0, 1}};
  mesh.triangles = {{0, 11, 5},  {0, 5, 1},  {0, 1, 7},  {0, 7, 10}, {0, 10, 11}, {1, 5, 9}, {5, 11, 4},
                    {11, 10, 2}, {10, 7, 6}, {7, 1, 8},  {3, 9, 4},  {3, 4, 2},   {3, 2, 6}, {3, 6, 8},
                    {3, 8, 9},   {4, 9, 5},  {2, 4, 11}, {6, 2, 10}, {8, 6, 7},   {9, 8, 1}};
  for (int s = 0; s < subdivisions; ++s) {
    mesh = subdivided(std::move(mesh), 1);
    for (auto& v : mesh.vertices) v.normalize();
  }
  for (auto& v : mesh.vertices) v.normalize();
  for (auto& v : mesh.vertices) v = centre + radius * v;
  return mesh;
}

/// Half axes a, b, c; n latitude bands and 2n meridians: 4 n (n - 1) triangles.
inline Mesh uv_ellipsoid(double a, double b, double c, int n, const Eigen::Vector3d& centre = Eigen::Vector3d::Zero()) {
  Mesh mesh;
  const int m = 2 * n;
  mesh.vertices.emplace_back(centre + Eigen::Vector3d(0, 0, -c));
  for (int i = 1; i < n; ++i) {
    const double latitude = kPi * i / n;
    for (int j = 0; j < m; ++j) {
      const double longitude = 2 * kPi * j / m;
      mesh.vertices.emplace_back(centre + Eigen::Vector3d(a * std::sin(latitude) * std::cos(longitude),
                                                          b * std::sin(latitude) * std::sin(longitude), -c * std::cos(latitude)));
    }
  }
  mesh.vertices.emplace_back(centre + Eigen::Vector3d(0, 0, c));
  const int top = static_cast<int>(mesh.vertices.size()) - 1;
  const auto at = [&](int i, int j) { return 1 + (i - 1) * m + j % m; };
  for (int j = 0; j < m; ++j) {
    mesh.triangles.emplace_back(0, at(1, j + 1), at(1, j));
    for (int i = 1; i + 1 < n; ++i) {
      mesh.triangles.emplace_back(at(i, j), at(i, j + 1), at(i + 1, j + 1));
      mesh.triangles.emplace_back(at(i, j), at(i + 1, j + 1), at(i + 1, j));
    }
    mesh.triangles.emplace_back(top, at(n - 1, j), at(n - 1, j + 1));
  }
  return mesh;
}

/// Tube of radius r around the circle of radius R in the plane z = 0; 2 nu nv triangles.
inline Mesh torus(double R, double r, int nu, int nv) {
  Mesh mesh;
  for (int i = 0; i < nu; ++i)
    for (int j = 0; j < nv; ++j) {
      const double u = 2 * kPi * i / nu;
      const double v = 2 * kPi * j / nv;
      const double across = R + r * std::cos(v);
      mesh.vertices.emplace_back(across * std::cos(u), across * std::sin(u), r * std::sin(v));
    }
  const auto at = [&](int i, int j) { return i % nu * nv + j % nv; };
  for (int i = 0; i < nu; ++i)
    for (int j = 0; j < nv; ++j) {
      mesh.triangles.emplace_back(at(i, j), at(i + 1, j), at(i + 1, j + 1));
      mesh.triangles.emplace_back(at(i, j), at(i + 1, j + 1), at(i, j + 1));
    }
  return mesh;
}

/// Frustum around z from z = 0 (radius `bottom`) to z = height (radius `top`, 0 for a cone); the circles are regular n-gons.
inline Mesh frustum(double bottom, double top, double height, int n) {
  Mesh mesh;
  mesh.vertices = {{0, 0, 0}, {0, 0, height}};
  const bool pointed = top == 0;
  for (int ring = 0; ring < (pointed ? 1 : 2); ++ring)
    for (int j = 0; j < n; ++j) {
      const double angle = 2 * kPi * j / n;
      const double radius = ring ? top : bottom;
      mesh.vertices.emplace_back(radius * std::cos(angle), radius * std::sin(angle), ring ? height : 0);
    }
  const auto at = [&](int ring, int j) { return 2 + ring * n + j % n; };
  for (int j = 0; j < n; ++j) {
    mesh.triangles.emplace_back(0, at(0, j + 1), at(0, j));
    if (pointed) {
      mesh.triangles.emplace_back(1, at(0, j), at(0, j + 1));
    } else {
      mesh.triangles.emplace_back(1, at(1, j), at(1, j + 1));
      mesh.triangles.emplace_back(at(0, j), at(0, j + 1), at(1, j + 1));
      mesh.triangles.emplace_back(at(0, j), at(1, j + 1), at(1, j));
    }
  }
  return mesh;
}

inline Mesh cylinder(double radius, double height, int n) { return frustum(radius, radius, height, n); }
inline Mesh cone(double radius, double height, int n) { return frustum(radius, 0, height, n); }

/// Three unit cells: (0,0,0), (1,0,0), (0,0,1).
inline Mesh l_shape(double size = 1) { return polycubes({{0, 0, 0}, {1, 0, 0}, {0, 0, 1}}, size); }

/// Steps rising along x: the column at x in [i, i + 1] is i + 1 cells high.
inline Mesh staircase(int steps, double size = 1) {
  std::vector<Eigen::Vector3i> cells;
  for (int i = 0; i < steps; ++i)
    for (int k = 0; k <= i; ++k) cells.emplace_back(i, 0, k);
  return polycubes(cells, size);
}

// ------------------------------------------------------------------------------------------------------------ combining

inline Mesh flipped(Mesh mesh) {
  flip(mesh);
  return mesh;
}

inline Mesh merged(std::initializer_list<Mesh> meshes) {
  Mesh result;
  for (const auto& mesh : meshes) append(result, mesh);
  return result;
}

/// `outer` with a cavity bounded by `inner` (given facing outward, as a solid; must lie inside).
/// A mesh as what is delivered.
inline Delivery delivery(Mesh mesh) {
  Delivery result;
  result.parts.push_back({.mesh = std::move(mesh)});
  return result;
}
inline Mesh hollow(const Mesh& outer, const Mesh& inner) { return merged({outer, flipped(inner)}); }

/// A mesh whose triangles share no vertices, as STL files store them.
inline Mesh soup(const Mesh& mesh) {
  Mesh result;
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    const int first = static_cast<int>(result.vertices.size());
    for (int k = 0; k < 3; ++k) result.vertices.push_back(mesh.corner(t, k));
    result.triangles.emplace_back(first, first + 1, first + 2);
  }
  return result;
}

inline Mesh moved(const Mesh& mesh, const Eigen::Vector3d& t) {
  return transformed(mesh, Eigen::Affine3d(Eigen::Translation3d(t)));
}
inline Mesh rotated(const Mesh& mesh, const Eigen::Matrix3d& R) { return transformed(mesh, Eigen::Affine3d(R)); }
inline Mesh scaled(const Mesh& mesh, double s) { return transformed(mesh, Eigen::Affine3d(Eigen::Scaling(s))); }

/// The same numbers on every platform: uniform in [0, 1).
class Random {
public:
  explicit Random(std::uint64_t seed) : engine_(seed) {}
  double uniform() { return static_cast<double>(engine_() >> 11) * 0x1p-53; }
  double uniform(double lo, double hi) { return lo + (hi - lo) * uniform(); }
  Eigen::Vector3d in_box(double half) {
    const double x = uniform(-half, half);
    const double y = uniform(-half, half);
    return {x, y, uniform(-half, half)};
  }
  Eigen::Vector3d direction() {
    const double z = uniform(-1, 1);
    const double angle = uniform(0, 2 * kPi);
    const double r = std::sqrt(1 - z * z);
    return {r * std::cos(angle), r * std::sin(angle), z};
  }

private:
  std::mt19937_64 engine_;
};

/// Uniform over all rotations (Shoemake 1992).
inline Eigen::Matrix3d random_rotation(std::uint64_t seed) {
  Random random(seed);
  const double u = random.uniform();
  const double a = 2 * kPi * random.uniform();
  const double b = 2 * kPi * random.uniform();
  const double r = std::sqrt(1 - u);
  const double s = std::sqrt(u);
  return Eigen::Quaterniond(s * std::cos(b), r * std::sin(a), r * std::cos(a), s * std::sin(b)).normalized().toRotationMatrix();
}

// ----------------------------------------------------------------------------------------------------- analytic moments

/// Unit-density moments about the origin of a body with volume V, centre c and second moments `central` (the matrix of the
/// integrals of p p^T about its centre).
inline Moments moments_of(double V, const Eigen::Vector3d& c, const Eigen::Matrix3d& central) {
  const Eigen::Matrix3d m = central + V * c * c.transpose();
  Moments s;
  s << V, V * c, m(0, 0), m(1, 1), m(2, 2), m(0, 1), m(1, 2), m(0, 2);
  return s;
}

inline Moments box_moments(const Eigen::Vector3d& min, const Eigen::Vector3d& max) {
  const Eigen::Vector3d d = max - min;
  return moments_of(d.prod(), (min + max) / 2, Eigen::Vector3d(d.prod() / 12 * d.array().square()).asDiagonal());
}

inline Moments ellipsoid_moments(double a, double b, double c, const Eigen::Vector3d& centre = Eigen::Vector3d::Zero()) {
  const double V = 4.0 / 3 * kPi * a * b * c;
  return moments_of(V, centre, Eigen::Vector3d(V / 5 * a * a, V / 5 * b * b, V / 5 * c * c).asDiagonal());
}

inline Moments torus_moments(double R, double r) {
  const double V = 2 * kPi * kPi * R * r * r;
  const double across = V * (4 * R * R + 3 * r * r) / 8;
  return moments_of(V, Eigen::Vector3d::Zero(), Eigen::Vector3d(across, across, V * r * r / 4).asDiagonal());
}

// ------------------------------------------------------------------------------------------------------------- matchers

/// Every moment within relative * |V| * length^degree of the expected one; V and `length_mm` (the size that matters) of the
/// expected body.
inline ::testing::AssertionResult moments_near(const Moments& actual, const Moments& expected, double relative, double length_mm) {
  static const char* const names[] = {"1", "x", "y", "z", "xx", "yy", "zz", "xy", "yz", "xz"};
  std::ostringstream wrong;
  wrong.precision(17);
  for (int k = 0; k < 10; ++k) {
    const int degree = k == 0 ? 0 : k < 4 ? 1 : 2;
    const double allowed = relative * std::abs(expected[M1]) * std::pow(length_mm, degree);
    if (!(std::abs(actual[k] - expected[k]) <= allowed))
      wrong << "\n  s_" << names[k] << " is " << actual[k] << ", expected " << expected[k] << " within " << allowed;
  }
  if (wrong.str().empty()) return ::testing::AssertionSuccess();
  return ::testing::AssertionFailure() << "moments differ:" << wrong.str();
}

inline void expect_moments_near(const Moments& actual, const Moments& expected, double relative, double length_mm) {
  EXPECT_TRUE(moments_near(actual, expected, relative, length_mm));
}

/// |actual - expected| <= tolerance, for vectors and matrices, with both printed.
template <typename A, typename B>
::testing::AssertionResult near(const Eigen::MatrixBase<A>& actual, const Eigen::MatrixBase<B>& expected, double tolerance) {
  const double distance = (actual - expected).norm();
  if (distance <= tolerance) return ::testing::AssertionSuccess();
  std::ostringstream text;
  text.precision(17);
  text << "differ by " << distance << " > " << tolerance << "\nactual\n" << actual << "\nexpected\n" << expected;
  return ::testing::AssertionFailure() << text.str();
}

/// Finite, every edge run equally often both ways (vertices told apart by their coordinates), every component's triangles with
/// three different corners, positive volume.
inline ::testing::AssertionResult is_closed_solid(const Mesh& mesh) {
  using Key = std::array<double, 3>;
  const auto key = [](const Eigen::Vector3d& v) { return Key{v.x() + 0.0, v.y() + 0.0, v.z() + 0.0}; };
  if (mesh.triangles.empty()) return ::testing::AssertionFailure() << "no triangles";
  std::map<std::pair<Key, Key>, int> balance;
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t)
    for (int k = 0; k < 3; ++k) {
      if (!mesh.corner(t, k).allFinite())
        return ::testing::AssertionFailure() << "triangle " << t << " has a corner that is not finite";
      const Key a = key(mesh.corner(t, k));
      const Key b = key(mesh.corner(t, (k + 1) % 3));
      if (a == b) return ::testing::AssertionFailure() << "triangle " << t << " has two equal corners";
      a < b ? ++balance[{a, b}] : --balance[{b, a}];
    }
  std::size_t open = 0;
  for (const auto& [edge, count] : balance) open += count != 0;
  if (open > 0) return ::testing::AssertionFailure() << open << " edges are not run equally often both ways";
  const double volume = mesh_moments(mesh)[M1];
  if (!(volume > 0)) return ::testing::AssertionFailure() << "volume " << volume << " is not positive";
  return ::testing::AssertionSuccess();
}

/// A name of this process's own for a file in the temporary folder: tests run side by side.
inline std::filesystem::path own_file(const std::string& name) {
  return std::filesystem::temp_directory_path() / ("rayrep_test_" + std::to_string(getpid()) + "_" + name);
}

/// The message of the Error that f throws, which must have the given code.
template <typename F>
std::string message_of(const F& f, ErrorCode code) {
  try {
    f();
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), code) << error.what();
    return error.what();
  }
  ADD_FAILURE() << "no error";
  return "";
}

inline ::testing::AssertionResult mentions(const std::string& text, std::initializer_list<const char*> words) {
  for (const char* word : words)
    if (text.find(word) == std::string::npos) return ::testing::AssertionFailure() << "no '" << word << "' in: " << text;
  return ::testing::AssertionSuccess();
}

}  // namespace rayrep::test
