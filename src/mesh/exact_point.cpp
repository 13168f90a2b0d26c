#include "mesh/exact_point.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>

#include "mesh/predicates.h"

namespace rayrep {
namespace {

using Eigen::Vector3d;

constexpr double kHalfUlp = 0x1p-53;

Integer3 minus(const Integer3& a, const Integer3& b) { return {a[0] - b[0], a[1] - b[1], a[2] - b[2]}; }

Integer3 cross(const Integer3& a, const Integer3& b) {
  return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}

Integer dot(const Integer3& a, const Integer3& b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

HomogeneousPoint with_positive_weight(HomogeneousPoint p) {
  if (p.w < 0) {
    for (Integer& x : p.x) x = -x;
    p.w = -p.w;
  }
  return p;
}

/// The exponent of the last bit that is set; x is not 0.
int last_bit(double x) {
  int exponent = 0;
  const auto mantissa = static_cast<std::int64_t>(std::ldexp(std::frexp(x, &exponent), 53));
  return exponent - 53 + __builtin_ctzll(static_cast<std::uint64_t>(mantissa < 0 ? -mantissa : mantissa));
}

/// n / (d 2^shift), d > 0, to the nearest double.
double quotient(const Integer& n, const Integer& d, int shift) {
  if (n == 0) return 0;
  const bool negative = n < 0;
  Integer above = negative ? Integer(-n) : n;
  Integer below = d;
  const int k = 63 - (static_cast<int>(msb(above)) - static_cast<int>(msb(below)));
  if (k > 0)
    above <<= k;
  else
    below <<= -k;
  Integer q, rest;
  divide_qr(above, below, q, rest);
  auto bits = static_cast<std::uint64_t>(q);
  if (rest != 0) bits |= 1;  // far below the last bit that a double keeps: it only says that there is more
  const double result = std::ldexp(static_cast<double>(bits), -k - shift);
  return negative ? -result : result;
}

int exact_orient2d(const ExactPoint& a, const ExactPoint& b, const ExactPoint& c, int axis) {
  const auto i = static_cast<std::size_t>((axis + 1) % 3);
  const auto j = static_cast<std::size_t>((axis + 2) % 3);
  const HomogeneousPoint &p = a.exact, &q = b.exact, &r = c.exact;
  const Integer ux = q.x[i] * p.w - p.x[i] * q.w;
  const Integer uy = q.x[j] * p.w - p.x[j] * q.w;
  const Integer vx = r.x[i] * p.w - p.x[i] * r.w;
  const Integer vy = r.x[j] * p.w - p.x[j] * r.w;
  return Integer(ux * vy - uy * vx).sign();
}

}  // namespace

ExactNumbers::ExactNumbers(const std::vector<Vector3d>& points) {
  int least = std::numeric_limits<int>::max();
  for (const Vector3d& p : points)
    for (const double x : p)
      if (x != 0) least = std::min(least, last_bit(x));
  if (least != std::numeric_limits<int>::max()) shift_ = -least;
}

Integer3 ExactNumbers::of(const Vector3d& point) const {
  Integer3 result;
  for (int k = 0; k < 3; ++k) {
    if (point[k] == 0) continue;
    int exponent = 0;
    const auto mantissa = static_cast<std::int64_t>(std::ldexp(std::frexp(point[k], &exponent), 53));
    Integer& x = result[static_cast<std::size_t>(k)];
    x = mantissa < 0 ? -mantissa : mantissa;
    const int places = exponent - 53 + shift_;
    if (places >= 0)
      x <<= places;
    else
      x >>= -places;
    if (mantissa < 0) x = -x;
  }
  return result;
}

Vector3d ExactNumbers::rounded(const HomogeneousPoint& point) const {
  return {quotient(point.x[0], point.w, shift_), quotient(point.x[1], point.w, shift_), quotient(point.x[2], point.w, shift_)};
}

ExactPlane plane_through(const Integer3& a, const Integer3& b, const Integer3& c) {
  ExactPlane plane;
  plane.normal = cross(minus(b, a), minus(c, a));
  plane.offset = dot(plane.normal, a);
  return plane;
}

ExactPlane plane_along(const Integer3& a, const Integer3& b, int axis) {
  Integer3 direction;
  direction[static_cast<std::size_t>(axis)] = 1;
  ExactPlane plane;
  plane.normal = cross(minus(b, a), direction);
  plane.offset = dot(plane.normal, a);
  return plane;
}

HomogeneousPoint line_and_plane(const Integer3& a, const Integer3& b, const ExactPlane& plane) {
  const Integer3 d = minus(b, a);
  HomogeneousPoint p;
  p.w = dot(plane.normal, d);
  const Integer along = plane.offset - dot(plane.normal, a);
  for (std::size_t k = 0; k < 3; ++k) p.x[k] = a[k] * p.w + along * d[k];
  return with_positive_weight(std::move(p));
}

HomogeneousPoint three_planes(const ExactPlane& p, const ExactPlane& q, const ExactPlane& r) {
  const Integer3 qr = cross(q.normal, r.normal);
  const Integer3 rp = cross(r.normal, p.normal);
  const Integer3 pq = cross(p.normal, q.normal);
  HomogeneousPoint point;
  point.w = dot(p.normal, qr);
  for (std::size_t k = 0; k < 3; ++k) point.x[k] = p.offset * qr[k] + q.offset * rp[k] + r.offset * pq[k];
  return with_positive_weight(std::move(point));
}

HomogeneousPoint centroid(const HomogeneousPoint& a, const HomogeneousPoint& b, const HomogeneousPoint& c) {
  const Integer bc = b.w * c.w;
  const Integer ca = c.w * a.w;
  const Integer ab = a.w * b.w;
  HomogeneousPoint p;
  for (std::size_t k = 0; k < 3; ++k) p.x[k] = a.x[k] * bc + b.x[k] * ca + c.x[k] * ab;
  p.w = 3 * ab * c.w;
  return p;
}

int orient2d(const ExactPoint& a, const ExactPoint& b, const ExactPoint& c, int axis) {
  const int i = (axis + 1) % 3;
  const int j = (axis + 2) % 3;
  const double ux = b.near[i] - a.near[i], uy = b.near[j] - a.near[j];
  const double vx = c.near[i] - a.near[i], vy = c.near[j] - a.near[j];
  const double left = ux * vy;
  const double right = uy * vx;
  const double det = left - right;
  const double error = std::max({a.error, b.error, c.error});
  // Differences are off by 2 error besides their rounding; twice what that comes to.
  const double bound = 8 * kHalfUlp * (std::abs(left) + std::abs(right)) +
                       error * (4 * (std::abs(ux) + std::abs(uy) + std::abs(vx) + std::abs(vy)) + 16 * error);
  if (std::abs(det) > bound) return det > 0 ? 1 : -1;
  if (error == 0)
    return orient2d(Eigen::Vector2d(a.near[i], a.near[j]), Eigen::Vector2d(b.near[i], b.near[j]),
                    Eigen::Vector2d(c.near[i], c.near[j]));
  return exact_orient2d(a, b, c, axis);
}

int side_of(const ExactPlane& plane, const HomogeneousPoint& p) {
  return Integer(dot(plane.normal, p.x) - plane.offset * p.w).sign();
}

}  // namespace rayrep
