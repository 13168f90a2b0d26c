#include "rays/positive_part.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

namespace rayrep {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

/// A quadratic in z: a z^2 + b z + c.
struct Quadratic {
  double a, b, c;
};

Quadratic along_ray(const Moments& q, const Eigen::Vector2d& at) {
  const double x = at.x();
  const double y = at.y();
  return {q[MZZ], q[MZ] + q[MXZ] * x + q[MYZ] * y,
          q[M1] + q[MX] * x + q[MY] * y + q[MXX] * x * x + q[MYY] * y * y + q[MXY] * x * y};
}

/// Where it is positive: two stretches at most, one of them perhaps empty.
std::array<Interval, 2> positive(const Quadratic& f) {
  const double discriminant = f.b * f.b - 4 * f.a * f.c;
  const bool bends = f.a != 0;
  if (discriminant <= 0 || (!bends && f.b == 0)) {
    const bool everywhere = bends ? f.a > 0 : f.c > 0;
    return {everywhere ? Interval{-kInfinity, kInfinity} : Interval{}, Interval{}};
  }
  const double t = -0.5 * (f.b + std::copysign(std::sqrt(discriminant), f.b));
  const double one = f.c / t;
  if (!bends) return {f.b > 0 ? Interval{one, kInfinity} : Interval{-kInfinity, one}, Interval{}};
  const double other = t / f.a;
  const Interval between{std::min(one, other), std::max(one, other)};
  if (f.a < 0) return {between, Interval{}};
  return {Interval{-kInfinity, between.lo}, Interval{between.hi, kInfinity}};
}

}  // namespace

RayRep positive_part(const RayRep& domain, const Moments& q) {
  RayRep part;
  part.grid = domain.grid;
  part.first.reserve(domain.first.size());
  part.first.push_back(0);
  for (std::size_t ray = 0; ray < domain.grid.size(); ++ray) {
    const std::array<Interval, 2> stretches = positive(along_ray(q, domain.grid.at(ray)));
    for (std::uint32_t n = domain.first[ray]; n < domain.first[ray + 1]; ++n)
      for (const Interval& stretch : stretches) {
        const Interval& whole = domain.intervals[n];
        const Interval cut{std::max(whole.lo, stretch.lo), std::min(whole.hi, stretch.hi)};
        if (cut.lo < cut.hi) part.intervals.push_back(cut);
      }
    part.first.push_back(static_cast<std::uint32_t>(part.intervals.size()));
  }
  return part;
}

}  // namespace rayrep
