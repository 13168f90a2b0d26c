#pragma once

// Pairs of small closed meshes that meet in all ways: shared by the tests of the boolean and by what holds it against others.

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <utility>
#include <vector>

#include "solids.h"

namespace rayrep::test {

inline int whole(Random& random, int from, int to) {
  return from + std::min(to - from, static_cast<int>(random.uniform() * (to - from + 1)));
}

inline Eigen::Vector3d whole_point(Random& random, int most) {
  const int x = whole(random, 0, most);
  const int y = whole(random, 0, most);
  return {1.0 * x, 1.0 * y, 1.0 * whole(random, 0, most)};
}

/// A tetrahedron with corners in whole places: many share planes, lines and corners with others.
inline Mesh whole_tetrahedron(Random& random, int most) {
  Mesh mesh = unit_tetrahedron();
  double six = 0;
  while (six == 0) {
    for (Eigen::Vector3d& v : mesh.vertices) v = whole_point(random, most);
    const auto& v = mesh.vertices;
    six = (v[1] - v[0]).cross(v[2] - v[0]).dot(v[3] - v[0]);
  }
  if (six < 0) flip(mesh);
  return mesh;
}

inline Mesh whole_box(Random& random, int most) {
  const Eigen::Vector3d low = whole_point(random, most - 1);
  const Eigen::Vector3d size = whole_point(random, 1) + Eigen::Vector3d::Ones();
  return box(low, low + size);
}

inline Mesh whole_cells(Random& random, int most) {
  std::vector<Eigen::Vector3i> cells;
  for (int k = whole(random, 1, 6); k > 0; --k) {
    const Eigen::Vector3i cell = whole_point(random, most).cast<int>();
    if (std::find(cells.begin(), cells.end(), cell) == cells.end()) cells.push_back(cell);
  }
  return polycubes(cells);
}

/// A body somewhere near the origin, of any kind and turned any way.
inline Mesh any_body(Random& random) {
  const int kind = whole(random, 0, 4);
  Mesh mesh = kind == 0   ? whole_tetrahedron(random, 3)
              : kind == 1 ? box({-1, -1, -1}, {1, 1, 1})
              : kind == 2 ? icosphere(1.2, 1)
              : kind == 3 ? cylinder(0.8, 1.7, whole(random, 3, 12))
                          : torus(1, 0.4, whole(random, 3, 8), whole(random, 3, 6));
  mesh = rotated(mesh, random_rotation(static_cast<std::uint64_t>(whole(random, 0, 1 << 30))));
  return moved(mesh, random.in_box(1));
}

inline Mesh body_in_whole_places(Random& random) {
  const int kind = whole(random, 0, 2);
  return kind == 0 ? whole_tetrahedron(random, 3) : kind == 1 ? whole_box(random, 3) : whole_cells(random, 2);
}

/// The same body moved or turned by very little, or not at all.
inline Mesh nearly(const Mesh& mesh, Random& random) {
  const double little = std::pow(10.0, -whole(random, 1, 17));
  const Eigen::AngleAxisd turn(little, random.direction());
  switch (whole(random, 0, 3)) {
    case 0:
      return mesh;
    case 1:
      return moved(mesh, little * random.direction());
    case 2:
      return rotated(mesh, turn.toRotationMatrix());
    default:
      return moved(mesh, Eigen::Vector3d{1.0 * whole(random, 0, 1), 0.5 * whole(random, 0, 2), 0});
  }
}

/// The pair with a number.
inline std::pair<Mesh, Mesh> boolean_pair(std::uint64_t number) {
  Random random(number);
  switch (number % 5) {
    case 0:
      return {body_in_whole_places(random), body_in_whole_places(random)};
    case 1:
      return {any_body(random), any_body(random)};
    case 2: {
      const Mesh a = any_body(random);
      return {a, nearly(a, random)};
    }
    case 3: {  // turned together: what was in one plane is so but for rounding
      const Eigen::Matrix3d R = random_rotation(number);
      return {rotated(body_in_whole_places(random), R), rotated(body_in_whole_places(random), R)};
    }
    default: {
      const Mesh a = body_in_whole_places(random);
      return {a, nearly(a, random)};
    }
  }
}

}  // namespace rayrep::test
