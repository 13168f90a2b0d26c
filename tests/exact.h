#pragma once

// Rational arithmetic for twins: what the library computes in double is computed here without any rounding, by another route.

#include <array>
#include <boost/multiprecision/cpp_int.hpp>
#include <cstddef>
#include <optional>
#include <vector>

#include "rayrep/mesh/mesh.h"

namespace rayrep::test::exact {

using Rational = boost::multiprecision::cpp_rational;
using Point = std::array<Rational, 3>;
using Triangle = std::array<Point, 3>;

inline double rounded(const Rational& x) { return x.convert_to<double>(); }

/// Every double is a rational number: nothing is lost.
inline Point point(const Eigen::Vector3d& p) { return {Rational(p.x()), Rational(p.y()), Rational(p.z())}; }

inline Triangle triangle(const Eigen::Vector3d& a, const Eigen::Vector3d& b, const Eigen::Vector3d& c) {
  return {point(a), point(b), point(c)};
}

inline Triangle triangle(const Mesh& mesh, std::size_t t) {
  return triangle(mesh.corner(t, 0), mesh.corner(t, 1), mesh.corner(t, 2));
}

inline Point minus(const Point& a, const Point& b) { return {a[0] - b[0], a[1] - b[1], a[2] - b[2]}; }
inline Rational dot(const Point& a, const Point& b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }
inline Point cross(const Point& a, const Point& b) {
  return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}

/// Twice the vector area of a triangle.
inline Point twice_area(const Triangle& t) { return cross(minus(t[1], t[0]), minus(t[2], t[0])); }

/// The integral of x_0^p[0] x_1^p[1] x_2^p[2] over the surface of a triangle, times dA_axis / |dA|, at most three factors in all:
/// the flux of that monomial along an axis. With the midpoint and corner rules' exact weights: for a product of linear functions f,
/// g, h the mean over a triangle is the sum of all (f_i g_j h_k) weighted by how often indices agree.
inline Rational flux(const Triangle& t, const std::vector<int>& factors, int axis) {
  const auto size = factors.size();
  // Mean of a product of n barycentric coordinates: 2 prod(multiplicity!) / (n + 2)!.
  static const int factorial[] = {1, 1, 2, 6, 24, 120};
  Rational mean = 0;
  std::vector<std::size_t> corner(size, 0);
  for (;;) {
    Rational product = 1;
    int times[3] = {0, 0, 0};
    for (std::size_t k = 0; k < size; ++k) {
      product *= t[corner[k]][static_cast<std::size_t>(factors[k])];
      ++times[corner[k]];
    }
    mean += product * 2 * factorial[times[0]] * factorial[times[1]] * factorial[times[2]] / factorial[size + 2];
    std::size_t k = 0;
    while (k < size && ++corner[k] == 3) corner[k++] = 0;
    if (k == size) break;
  }
  return mean * twice_area(t)[static_cast<std::size_t>(axis)] / 2;
}

/// The parts of a triangle where z < height, as triangles.
inline std::vector<Triangle> below(const Triangle& t, const Rational& height) {
  std::vector<Point> polygon;
  for (std::size_t k = 0; k < 3; ++k) {
    const Point& a = t[k];
    const Point& b = t[(k + 1) % 3];
    if (a[2] < height) polygon.push_back(a);
    if ((a[2] < height) != (b[2] < height)) {
      const Rational share = (height - a[2]) / (b[2] - a[2]);
      polygon.push_back({a[0] + share * (b[0] - a[0]), a[1] + share * (b[1] - a[1]), height});
    }
  }
  std::vector<Triangle> parts;
  for (std::size_t k = 1; k + 1 < polygon.size(); ++k) parts.push_back({polygon[0], polygon[k], polygon[k + 1]});
  return parts;
}

/// The solution of a square system, by elimination; none where it is singular.
inline std::optional<std::vector<Rational>> solved(std::vector<std::vector<Rational>> rows) {
  const std::size_t n = rows.size();
  for (std::size_t k = 0; k < n; ++k) {
    std::size_t pivot = k;
    while (pivot < n && rows[pivot][k] == 0) ++pivot;
    if (pivot == n) return std::nullopt;
    std::swap(rows[k], rows[pivot]);
    for (std::size_t i = 0; i < n; ++i) {
      if (i == k || rows[i][k] == 0) continue;
      const Rational factor = rows[i][k] / rows[k][k];
      for (std::size_t j = k; j <= n; ++j) rows[i][j] -= factor * rows[k][j];
    }
  }
  std::vector<Rational> x(n);
  for (std::size_t k = 0; k < n; ++k) x[k] = rows[k][n] / rows[k][k];
  return x;
}

/// The square of the distance of two triangles: of all pairs of a face of one and a face of the other (corner, side, inside), the
/// points at which their planes, lines, corners are nearest, if they lie on both faces. One of them is where the triangles are
/// nearest, and all of them are points of the triangles.
inline Rational squared_distance(const Triangle& s, const Triangle& t) {
  std::optional<Rational> least;
  for (unsigned of_s = 1; of_s < 8; ++of_s)
    for (unsigned of_t = 1; of_t < 8; ++of_t) {
      // p = s_a + sum u_i (s_i - s_a), q = t_b + sum v_j (t_j - t_b): p - q upright on all of the directions.
      std::vector<std::size_t> in_s, in_t;
      for (std::size_t k = 0; k < 3; ++k) {
        if (of_s >> k & 1) in_s.push_back(k);
        if (of_t >> k & 1) in_t.push_back(k);
      }
      std::vector<Point> directions;
      for (std::size_t k = 1; k < in_s.size(); ++k) directions.push_back(minus(s[in_s[k]], s[in_s[0]]));
      for (std::size_t k = 1; k < in_t.size(); ++k) directions.push_back(minus(t[in_t[0]], t[in_t[k]]));
      const Point apart = minus(s[in_s[0]], t[in_t[0]]);
      const std::size_t n = directions.size();
      std::vector<std::vector<Rational>> rows(n, std::vector<Rational>(n + 1));
      for (std::size_t i = 0; i < n; ++i) {
        for (std::size_t j = 0; j < n; ++j) rows[i][j] = dot(directions[i], directions[j]);
        rows[i][n] = -dot(directions[i], apart);
      }
      const auto shares = solved(rows);
      if (!shares) continue;
      const std::size_t of_first = in_s.size() - 1;
      Rational sum_s = 0, sum_t = 0;
      bool inside = true;
      Point between = apart;
      for (std::size_t k = 0; k < n; ++k) {
        inside = inside && (*shares)[k] >= 0;
        (k < of_first ? sum_s : sum_t) += (*shares)[k];
        for (std::size_t c = 0; c < 3; ++c) between[c] += (*shares)[k] * directions[k][c];
      }
      if (!inside || sum_s > 1 || sum_t > 1) continue;
      const Rational squared = dot(between, between);
      if (!least || squared < *least) least = squared;
    }
  return *least;
}

}  // namespace rayrep::test::exact
