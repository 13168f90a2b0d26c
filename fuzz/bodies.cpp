#include "bodies.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <stdexcept>
#include <vector>

#include "shapes.h"

namespace fuzz {
namespace {

using rayrep::Mesh;

constexpr double kPi = std::numbers::pi;

/// Rings of n corners each, closed by a point below and one above: prisms, cones, ellipsoids.
Mesh lathe(int n, const std::vector<Eigen::Vector2d>& rings, double bottom, double top) {
  Mesh mesh;
  mesh.vertices = {{0, 0, bottom}, {0, 0, top}};
  for (const Eigen::Vector2d& ring : rings)
    for (int j = 0; j < n; ++j)
      mesh.vertices.emplace_back(ring.x() * std::cos(2 * kPi * j / n), ring.x() * std::sin(2 * kPi * j / n), ring.y());
  const int count = static_cast<int>(rings.size());
  const auto at = [n](int ring, int j) { return 2 + ring * n + j % n; };
  for (int j = 0; j < n; ++j) {
    mesh.triangles.emplace_back(0, at(0, j + 1), at(0, j));
    mesh.triangles.emplace_back(1, at(count - 1, j), at(count - 1, j + 1));
    for (int i = 0; i + 1 < count; ++i) {
      mesh.triangles.emplace_back(at(i, j), at(i, j + 1), at(i + 1, j + 1));
      mesh.triangles.emplace_back(at(i, j), at(i + 1, j + 1), at(i + 1, j));
    }
  }
  return mesh;
}

/// Cubes of a grid of 3 x 3 x 2, those whose bit is set, without walls between.
Mesh cubes(int bits, double size) {
  std::vector<Eigen::Vector3i> cells;
  for (int cell = 0; cell < 18; ++cell)
    if ((bits >> cell & 1) != 0) cells.emplace_back(cell % 3, cell / 3 % 3, cell / 9);
  return rayrep::test::polycubes(cells, size);
}

Mesh shape(Bytes& bytes) {
  switch (bytes.below(4)) {
    case 0: {
      const Eigen::Vector3d size{bytes.number(20, 80), bytes.number(20, 80), bytes.number(20, 80)};
      return rayrep::test::box({0, 0, 0}, size);
    }
    case 1: {
      const double height = bytes.number(15, 80);
      const double below = bytes.number(5, 40);
      const double above = bytes.number(5, 40);
      const int corners = 3 + bytes.below(8);
      return lathe(corners, {{below, 0}, {above, height}}, bytes.chance(32) ? bytes.number(-20, 20) : 0, height);
    }
    case 2: {
      const int rings = 2 + bytes.below(4);
      const double radius = bytes.number(10, 40);
      const double height = bytes.number(10, 40);
      std::vector<Eigen::Vector2d> profile;
      for (int i = 1; i <= rings; ++i) {
        const double latitude = kPi * i / (rings + 1);
        profile.emplace_back(radius * std::sin(latitude), -height * std::cos(latitude));
      }
      return lathe(4 + bytes.below(8), profile, -height, height);
    }
    default: {
      const int low = bytes.two_bytes();
      const int bits = low | bytes.byte() << 16;
      const Mesh mesh = cubes(bits, bytes.number(8, 25));
      return mesh.triangles.empty() ? rayrep::test::box({0, 0, 0}, {20, 30, 40}) : mesh;
    }
  }
}

}  // namespace

double Bytes::odd_number(double lo, double hi) {
  double fraction = 0;
  for (int k = 0; k < 6; ++k) fraction = (fraction + byte()) / 256;
  return lo + (hi - lo) * fraction;
}

void require(bool condition, const char* law) {
  if (!condition) throw std::logic_error(law);
}

Mesh body(Bytes& bytes) {
  Mesh mesh = shape(bytes);
  if (bytes.chance(128))
    for (Eigen::Vector3d& v : mesh.vertices) v += Eigen::Vector3d{bytes.number(0, 6), bytes.number(0, 6), bytes.number(0, 6)};
  if (bytes.chance(64)) {
    const Eigen::Vector3d axis{bytes.number(-1, 1), bytes.number(-1, 1), 1};
    mesh = transformed(mesh, Eigen::Affine3d(Eigen::AngleAxisd(bytes.odd_number(0, kPi), axis.normalized())));
  }
  const Eigen::Vector3d low = bounding_box(mesh).min();
  for (Eigen::Vector3d& v : mesh.vertices) v.z() -= low.z();
  return mesh;
}

Mesh shrunk_inside_out(const Mesh& mesh, double factor, const Eigen::Vector3d& move) {
  Mesh cavity = mesh;
  const Eigen::Vector3d middle = bounding_box(mesh).center();
  for (Eigen::Vector3d& v : cavity.vertices) v = middle + factor * (v - middle) + move;
  flip(cavity);
  return cavity;
}

Mesh bodies(Bytes& bytes) {
  Mesh mesh = body(bytes);
  const int what = bytes.byte();
  if (what < 160) return mesh;
  if (what < 200) {
    const double factor = bytes.number(0.1, 0.9);
    append(mesh, shrunk_inside_out(mesh, factor, {bytes.number(0, 5), bytes.number(0, 5), bytes.number(0, 5)}));
    return mesh;
  }
  for (int more = 1 + what % 2; more > 0; --more) {
    Mesh other = body(bytes);
    const Eigen::Vector3d move{bytes.number(0, 100), bytes.number(0, 20), bytes.number(0, 100)};
    for (Eigen::Vector3d& v : other.vertices) v += move;
    append(mesh, other);
  }
  return mesh;
}

}  // namespace fuzz
