#include "rayrep/ray_interior.h"

#include <cassert>

namespace rayrep {
namespace {

/// Integral of z^k from lo to hi, k = 0, 1, 2.
struct PowerIntegrals {
  double i0, i1, i2;
  PowerIntegrals(double lo, double hi) {
    i0 = hi - lo;
    i1 = i0 * (hi + lo) / 2;
    i2 = i0 * (hi * hi + hi * lo + lo * lo) / 3;
  }
};

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
  const PowerIntegrals i(lo, hi);
  const double x = xy.x();
  const double y = xy.y();
  Moments s;
  s << i.i0, x * i.i0, y * i.i0, i.i1, x * x * i.i0, y * y * i.i0, i.i2, x * y * i.i0, y * i.i1, x * i.i1;
  return s;
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
    parts.col(n) = domain_.grid.cell_area_mm2() * segment_moments(xy_[i], domain_.intervals[i].lo, z1[n]);
  }
  return parts;
}

Eigen::Matrix<double, 10, Eigen::Dynamic> BottomFilledRays::jacobian(const Eigen::VectorXd& z1) const {
  Eigen::Matrix<double, 10, Eigen::Dynamic> J(10, variables());
  for (Eigen::Index n = 0; n < J.cols(); ++n) {
    const Eigen::Vector2d& xy = xy_[static_cast<std::size_t>(n)];
    J.col(n) = domain_.grid.cell_area_mm2() * monomials({xy.x(), xy.y(), z1[n]});
  }
  return J;
}

Eigen::VectorXd BottomFilledRays::hessian_diagonal(const Eigen::VectorXd& z1, const Moments& w, Eigen::Index first,
                                                   Eigen::Index count) const {
  Eigen::VectorXd h(count);
  for (Eigen::Index n = 0; n < count; ++n)
    h[n] = domain_.grid.cell_area_mm2() * end_curvature(xy_[static_cast<std::size_t>(first + n)], z1[first + n], w);
  return h;
}

SegmentRays::SegmentRays(RayRep domain, SegmentBounds bounds, Between between)
    : domain_(std::move(domain)), bounds_(bounds), between_(between), xy_(places(domain_)) {}

Eigen::Index SegmentRays::variables() const { return 2 * static_cast<Eigen::Index>(domain_.intervals.size()); }

Eigen::VectorXd SegmentRays::lower_bounds() const {
  Eigen::VectorXd lo(variables());
  for (std::size_t n = 0; n < xy_.size(); ++n) {
    const Interval& interval = domain_.intervals[n];
    const auto v = static_cast<Eigen::Index>(2 * n);
    lo[v] = interval.lo;
    lo[v + 1] = bounds_ == SegmentBounds::paper ? interval.middle() : interval.lo;
  }
  return lo;
}

Eigen::VectorXd SegmentRays::upper_bounds() const {
  Eigen::VectorXd hi(variables());
  for (std::size_t n = 0; n < xy_.size(); ++n) {
    const Interval& interval = domain_.intervals[n];
    const auto v = static_cast<Eigen::Index>(2 * n);
    hi[v] = bounds_ == SegmentBounds::paper ? interval.middle() : interval.hi;
    hi[v + 1] = interval.hi;
  }
  return hi;
}

std::vector<std::pair<int, int>> SegmentRays::ordered_pairs() const {
  std::vector<std::pair<int, int>> pairs;
  if (bounds_ == SegmentBounds::complete)
    for (int v = 0; v < static_cast<int>(variables()); v += 2) pairs.emplace_back(v, v + 1);
  return pairs;
}

Eigen::VectorXd SegmentRays::start(double fill) const {
  Eigen::VectorXd z(variables());
  for (std::size_t n = 0; n < xy_.size(); ++n) {
    const double half = 0.5 * (between_ == Between::material ? fill : 1 - fill) * domain_.intervals[n].length();
    const auto v = static_cast<Eigen::Index>(2 * n);
    z[v] = domain_.intervals[n].middle() - half;
    z[v + 1] = domain_.intervals[n].middle() + half;
  }
  return z;
}

Eigen::Matrix<double, 10, Eigen::Dynamic> SegmentRays::contributions(const Eigen::VectorXd& z) const {
  assert(z.size() == variables());
  Eigen::Matrix<double, 10, Eigen::Dynamic> parts(10, variables());
  for (Eigen::Index v = 0; v < parts.cols(); ++v) {
    const auto i = static_cast<std::size_t>(v / 2);
    const Interval& interval = domain_.intervals[i];
    // The segment z0 z1 is counted from the interval's middle, what surrounds a cavity from the interval's ends.
    const double from = between_ == Between::material ? interval.middle() : v % 2 == 0 ? interval.lo : interval.hi;
    parts.col(v) = end_sign(v) * domain_.grid.cell_area_mm2() * segment_moments(xy_[i], from, z[v]);
  }
  return parts;
}

Eigen::Matrix<double, 10, Eigen::Dynamic> SegmentRays::jacobian(const Eigen::VectorXd& z) const {
  Eigen::Matrix<double, 10, Eigen::Dynamic> J(10, variables());
  for (Eigen::Index v = 0; v < J.cols(); ++v) {
    const Eigen::Vector2d& xy = xy_[static_cast<std::size_t>(v / 2)];
    J.col(v) = end_sign(v) * domain_.grid.cell_area_mm2() * monomials({xy.x(), xy.y(), z[v]});
  }
  return J;
}

Eigen::VectorXd SegmentRays::hessian_diagonal(const Eigen::VectorXd& z, const Moments& w, Eigen::Index first,
                                              Eigen::Index count) const {
  Eigen::VectorXd h(count);
  for (Eigen::Index n = 0; n < count; ++n) {
    const Eigen::Index v = first + n;
    h[n] = end_sign(v) * domain_.grid.cell_area_mm2() * end_curvature(xy_[static_cast<std::size_t>(v / 2)], z[v], w);
  }
  return h;
}

Moments ray_moments(const RayRep& rays) {
  Moments s = Moments::Zero();
  for (std::size_t ray = 0; ray < rays.grid.size(); ++ray)
    for (std::uint32_t n = rays.first[ray]; n < rays.first[ray + 1]; ++n)
      s += segment_moments(rays.grid.at(ray), rays.intervals[n].lo, rays.intervals[n].hi);
  return s * rays.grid.cell_area_mm2();
}

}  // namespace rayrep
