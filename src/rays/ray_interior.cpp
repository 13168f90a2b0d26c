#include "rayrep/rays/ray_interior.h"

#include <algorithm>
#include <cassert>
#include <limits>

namespace rayrep {
namespace {

/// The ten moments at (x, y) from the integrals of 1, z and z^2 along the ray.
Moments along_ray(const Eigen::Vector2d& xy, double i0, double i1, double i2) {
  const double x = xy.x();
  const double y = xy.y();
  Moments s;
  s << i0, x * i0, y * i0, i1, x * x * i0, y * y * i0, i2, x * y * i0, y * i1, x * i1;
  return s;
}

std::vector<Eigen::Vector2d> places(const RayRep& domain) {
  std::vector<Eigen::Vector2d> xy;
  xy.reserve(domain.intervals.size());
  for (std::size_t ray = 0; ray < domain.grid.size(); ++ray)
    for (std::uint32_t n = domain.first[ray]; n < domain.first[ray + 1]; ++n) xy.push_back(domain.grid.at(ray));
  return xy;
}

/// d2(w.s)/dz2 of the upper end of a segment, per unit of cell area.
double end_curvature(const Eigen::Vector2d& xy, double z, const Moments& w) {
  return w[MZ] + 2 * z * w[MZZ] + xy.y() * w[MYZ] + xy.x() * w[MXZ];
}

}  // namespace

Moments segment_moments(const Eigen::Vector2d& xy, double lo, double hi) {
  const double length = hi - lo;
  return along_ray(xy, length, length * (hi + lo) / 2, length * (hi * hi + hi * lo + lo * lo) / 3);
}

BottomFilledRays::BottomFilledRays(RayRep domain) : domain_(std::move(domain)), xy_(places(domain_)) {}

Eigen::Index BottomFilledRays::variables() const { return static_cast<Eigen::Index>(domain_.intervals.size()); }

Eigen::VectorXd BottomFilledRays::lower_bounds() const {
  Eigen::VectorXd lo(variables());
  for (Eigen::Index n = 0; n < lo.size(); ++n) lo[n] = domain_.intervals[static_cast<std::size_t>(n)].lo;
  return lo;
}

Eigen::VectorXd BottomFilledRays::upper_bounds() const {
  Eigen::VectorXd hi(variables());
  for (Eigen::Index n = 0; n < hi.size(); ++n) hi[n] = domain_.intervals[static_cast<std::size_t>(n)].hi;
  return hi;
}

Eigen::VectorXd BottomFilledRays::start(double fill) const { return (1 - fill) * lower_bounds() + fill * upper_bounds(); }

Eigen::Matrix<double, 10, Eigen::Dynamic> BottomFilledRays::contributions(const Eigen::VectorXd& z1) const {
  assert(z1.size() == variables());
  Eigen::Matrix<double, 10, Eigen::Dynamic> parts(10, variables());
  for (Eigen::Index n = 0; n < parts.cols(); ++n) {
    const auto i = static_cast<std::size_t>(n);
    parts.col(n) = domain_.grid.weighted_area_mm2() * segment_moments(xy_[i], domain_.intervals[i].lo, z1[n]);
  }
  return parts;
}

Eigen::Matrix<double, 10, Eigen::Dynamic> BottomFilledRays::jacobian(const Eigen::VectorXd& z1) const {
  Eigen::Matrix<double, 10, Eigen::Dynamic> J(10, variables());
  for (Eigen::Index n = 0; n < J.cols(); ++n) {
    const Eigen::Vector2d& xy = xy_[static_cast<std::size_t>(n)];
    J.col(n) = domain_.grid.weighted_area_mm2() * monomials({xy.x(), xy.y(), z1[n]});
  }
  return J;
}

Eigen::VectorXd BottomFilledRays::hessian_diagonal(const Eigen::VectorXd& z1, const Moments& w, Eigen::Index first,
                                                   Eigen::Index count) const {
  Eigen::VectorXd h(count);
  for (Eigen::Index n = 0; n < count; ++n)
    h[n] = domain_.grid.weighted_area_mm2() * end_curvature(xy_[static_cast<std::size_t>(first + n)], z1[first + n], w);
  return h;
}

CentredSegmentRays::CentredSegmentRays(RayRep domain, Between between)
    : domain_(std::move(domain)), between_(between), xy_(places(domain_)) {}

Eigen::Index CentredSegmentRays::variables() const { return 2 * static_cast<Eigen::Index>(domain_.intervals.size()); }

Eigen::VectorXd CentredSegmentRays::lower_bounds() const {
  Eigen::VectorXd lo(variables());
  for (std::size_t n = 0; n < xy_.size(); ++n) {
    const Interval& interval = domain_.intervals[n];
    const auto v = static_cast<Eigen::Index>(2 * n);
    lo[v] = interval.lo;
    lo[v + 1] = interval.middle();
  }
  return lo;
}

Eigen::VectorXd CentredSegmentRays::upper_bounds() const {
  Eigen::VectorXd hi(variables());
  for (std::size_t n = 0; n < xy_.size(); ++n) {
    const Interval& interval = domain_.intervals[n];
    const auto v = static_cast<Eigen::Index>(2 * n);
    hi[v] = interval.middle();
    hi[v + 1] = interval.hi;
  }
  return hi;
}

Eigen::VectorXd CentredSegmentRays::start(double fill) const {
  Eigen::VectorXd z(variables());
  for (std::size_t n = 0; n < xy_.size(); ++n) {
    const double half = 0.5 * (between_ == Between::material ? fill : 1 - fill) * domain_.intervals[n].length();
    const auto v = static_cast<Eigen::Index>(2 * n);
    z[v] = domain_.intervals[n].middle() - half;
    z[v + 1] = domain_.intervals[n].middle() + half;
  }
  return z;
}

Eigen::Matrix<double, 10, Eigen::Dynamic> CentredSegmentRays::contributions(const Eigen::VectorXd& z) const {
  assert(z.size() == variables());
  Eigen::Matrix<double, 10, Eigen::Dynamic> parts(10, variables());
  for (Eigen::Index v = 0; v < parts.cols(); ++v) {
    const auto i = static_cast<std::size_t>(v / 2);
    const Interval& interval = domain_.intervals[i];
    // The segment z0 z1 is counted from the interval's middle, what surrounds a cavity from the interval's ends.
    const double from = between_ == Between::material ? interval.middle() : v % 2 == 0 ? interval.lo : interval.hi;
    parts.col(v) = end_sign(v) * domain_.grid.weighted_area_mm2() * segment_moments(xy_[i], from, z[v]);
  }
  return parts;
}

Eigen::Matrix<double, 10, Eigen::Dynamic> CentredSegmentRays::jacobian(const Eigen::VectorXd& z) const {
  Eigen::Matrix<double, 10, Eigen::Dynamic> J(10, variables());
  for (Eigen::Index v = 0; v < J.cols(); ++v) {
    const Eigen::Vector2d& xy = xy_[static_cast<std::size_t>(v / 2)];
    J.col(v) = end_sign(v) * domain_.grid.weighted_area_mm2() * monomials({xy.x(), xy.y(), z[v]});
  }
  return J;
}

Eigen::VectorXd CentredSegmentRays::hessian_diagonal(const Eigen::VectorXd& z, const Moments& w, Eigen::Index first,
                                                     Eigen::Index count) const {
  Eigen::VectorXd h(count);
  for (Eigen::Index n = 0; n < count; ++n) {
    const Eigen::Index v = first + n;
    h[n] = end_sign(v) * domain_.grid.weighted_area_mm2() * end_curvature(xy_[static_cast<std::size_t>(v / 2)], z[v], w);
  }
  return h;
}

SegmentRays::SegmentRays(RayRep domain, Between between)
    : domain_(std::move(domain)),
      area_mm2_((between == Between::material ? 1 : -1) * domain_.grid.weighted_area_mm2()),
      between_(between),
      xy_(places(domain_)) {}

/// What a pair of variables stands for.
struct SegmentRays::Segment {
  double L, middle;  ///< of the interval
  double length;     ///< z1 - z0
  double shift;      ///< zeta0 + zeta1: twice the way from the interval's middle to the segment's
};

SegmentRays::Segment SegmentRays::segment(const Eigen::VectorXd& ab, Eigen::Index k) const {
  const Interval& interval = domain_.intervals[static_cast<std::size_t>(k)];
  const double length = ab[2 * k] + ab[2 * k + 1];
  const double L = interval.length();
  return {L, interval.middle(), length, length > 0 ? L * (ab[2 * k] - ab[2 * k + 1]) / length : 0};
}

Eigen::Index SegmentRays::variables() const { return 2 * static_cast<Eigen::Index>(domain_.intervals.size()); }

Eigen::VectorXd SegmentRays::lower_bounds() const { return Eigen::VectorXd::Zero(variables()); }

Eigen::VectorXd SegmentRays::upper_bounds() const {
  return Eigen::VectorXd::Constant(variables(), std::numeric_limits<double>::infinity());
}

Eigen::VectorXd SegmentRays::pair_lengths() const {
  Eigen::VectorXd L(variables() / 2);
  for (Eigen::Index k = 0; k < L.size(); ++k) L[k] = domain_.intervals[static_cast<std::size_t>(k)].length();
  return L;
}

Eigen::VectorXd SegmentRays::start(double fill) const {
  const Eigen::VectorXd L = pair_lengths();
  Eigen::VectorXd ab(variables());
  for (Eigen::Index v = 0; v < ab.size(); ++v) ab[v] = 0.5 * (between_ == Between::material ? fill : 1 - fill) * L[v / 2];
  return ab;
}

Eigen::Matrix<double, 10, Eigen::Dynamic> SegmentRays::contributions(const Eigen::VectorXd& ab) const {
  assert(ab.size() == variables());
  Eigen::Matrix<double, 10, Eigen::Dynamic> parts = Eigen::Matrix<double, 10, Eigen::Dynamic>::Zero(10, variables());
  for (Eigen::Index k = 0; k < variables() / 2; ++k) {
    const auto i = static_cast<std::size_t>(k);
    const Segment s = segment(ab, k);
    const double centre = s.middle + s.shift / 2;
    const double squares = s.length * (centre * centre + s.length * s.length / 12);
    parts.col(2 * k) = area_mm2_ * along_ray(xy_[i], s.length, s.length * centre, squares);
    if (between_ == Between::cavity)
      parts.col(2 * k) -= area_mm2_ * segment_moments(xy_[i], domain_.intervals[i].lo, domain_.intervals[i].hi);
  }
  return parts;
}

Eigen::Matrix<double, 10, Eigen::Dynamic> SegmentRays::jacobian(const Eigen::VectorXd& ab) const {
  Eigen::Matrix<double, 10, Eigen::Dynamic> J(10, variables());
  for (Eigen::Index k = 0; k < variables() / 2; ++k) {
    const Eigen::Vector2d& xy = xy_[static_cast<std::size_t>(k)];
    const Segment s = segment(ab, k);
    // By z1 - z0 at constant L (a - b), and by L (a - b) at constant z1 - z0.
    const double squares = s.middle * s.middle + (s.length * s.length - s.shift * s.shift) / 4;
    const Moments by_length = area_mm2_ * along_ray(xy, 1, s.middle, squares);
    const Moments by_moment = area_mm2_ * s.L * along_ray(xy, 0, 0.5, s.middle + s.shift / 2);
    J.col(2 * k) = by_length + by_moment;
    J.col(2 * k + 1) = by_length - by_moment;
  }
  return J;
}

Eigen::VectorXd SegmentRays::hessian_diagonal(const Eigen::VectorXd& ab, const Moments& w, Eigen::Index first,
                                              Eigen::Index count) const {
  Eigen::VectorXd h(count);
  for (Eigen::Index n = 0; n < count; ++n) {
    const Eigen::Index v = first + n;
    const Segment s = segment(ab, v / 2);
    const double arm = v % 2 == 0 ? s.L - s.shift : s.L + s.shift;
    h[n] = area_mm2_ * w[MZZ] * (arm * arm / s.length + s.length) / 2;
  }
  return h;
}

Eigen::VectorXd SegmentRays::hessian_of_pairs(const Eigen::VectorXd& ab, const Moments& w, Eigen::Index first,
                                              Eigen::Index count) const {
  assert(first % 2 == 0 && count % 2 == 0);
  Eigen::VectorXd h(count / 2);
  for (Eigen::Index n = 0; n < h.size(); ++n) {
    const Segment s = segment(ab, first / 2 + n);
    h[n] = area_mm2_ * w[MZZ] * (s.length - (s.L + s.shift) * (s.L - s.shift) / s.length) / 2;
  }
  return h;
}

Eigen::VectorXd SegmentRays::ends(const Eigen::VectorXd& ab) const {
  Eigen::VectorXd z(variables());
  for (Eigen::Index k = 0; k < variables() / 2; ++k) {
    const Interval& interval = domain_.intervals[static_cast<std::size_t>(k)];
    const Segment s = segment(ab, k);
    z[2 * k] = std::clamp(s.middle + (s.shift - s.length) / 2, interval.lo, interval.hi);
    z[2 * k + 1] = std::clamp(s.middle + (s.shift + s.length) / 2, z[2 * k], interval.hi);
  }
  return z;
}

Eigen::VectorXd SegmentRays::from_ends(const Eigen::VectorXd& z) const {
  Eigen::VectorXd ab(variables());
  for (Eigen::Index k = 0; k < variables() / 2; ++k) {
    const Interval& interval = domain_.intervals[static_cast<std::size_t>(k)];
    const double half = (z[2 * k + 1] - z[2 * k]) / 2;
    const double shift = (z[2 * k] + z[2 * k + 1] - interval.lo - interval.hi) / interval.length();
    ab[2 * k] = half * (1 + shift);
    ab[2 * k + 1] = half * (1 - shift);
  }
  return ab;
}

Moments ray_moments(const RayRep& rays) {
  Moments s = Moments::Zero();
  for (std::size_t ray = 0; ray < rays.grid.size(); ++ray)
    for (std::uint32_t n = rays.first[ray]; n < rays.first[ray + 1]; ++n)
      s += segment_moments(rays.grid.at(ray), rays.intervals[n].lo, rays.intervals[n].hi);
  return s * rays.grid.weighted_area_mm2();
}

}  // namespace rayrep
