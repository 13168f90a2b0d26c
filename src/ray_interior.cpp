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

void add_segment(Moments& s, const Eigen::Vector2d& xy, double lo, double hi) {
  const PowerIntegrals i(lo, hi);
  const double x = xy.x();
  const double y = xy.y();
  s[M1] += i.i0;
  s[MX] += x * i.i0;
  s[MY] += y * i.i0;
  s[MZ] += i.i1;
  s[MXX] += x * x * i.i0;
  s[MYY] += y * y * i.i0;
  s[MZZ] += i.i2;
  s[MXY] += x * y * i.i0;
  s[MYZ] += y * i.i1;
  s[MXZ] += x * i.i1;
}

}  // namespace

BottomFilledRays::BottomFilledRays(RayRep domain) : domain_(std::move(domain)) {
  xy_.reserve(domain_.intervals.size());
  for (std::size_t ray = 0; ray < domain_.grid.size(); ++ray)
    for (std::uint32_t n = domain_.first[ray]; n < domain_.first[ray + 1]; ++n) xy_.push_back(domain_.grid.at(ray));
}

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

Moments BottomFilledRays::moments(const Eigen::VectorXd& z1) const {
  assert(z1.size() == variables());
  Moments s = Moments::Zero();
  for (std::size_t n = 0; n < xy_.size(); ++n) add_segment(s, xy_[n], domain_.intervals[n].lo, z1[static_cast<Eigen::Index>(n)]);
  return s * domain_.grid.cell_area_mm2();
}

Eigen::Matrix<double, 10, Eigen::Dynamic> BottomFilledRays::jacobian(const Eigen::VectorXd& z1) const {
  Eigen::Matrix<double, 10, Eigen::Dynamic> J(10, variables());
  for (Eigen::Index n = 0; n < J.cols(); ++n) {
    const Eigen::Vector2d& xy = xy_[static_cast<std::size_t>(n)];
    J.col(n) = domain_.grid.cell_area_mm2() * monomials({xy.x(), xy.y(), z1[n]});
  }
  return J;
}

Eigen::VectorXd BottomFilledRays::hessian_diagonal(const Eigen::VectorXd& z1, const Moments& w) const {
  Eigen::VectorXd h(variables());
  for (Eigen::Index n = 0; n < h.size(); ++n) {
    const Eigen::Vector2d& xy = xy_[static_cast<std::size_t>(n)];
    h[n] = domain_.grid.cell_area_mm2() * (w[MZ] + 2 * z1[n] * w[MZZ] + xy.y() * w[MYZ] + xy.x() * w[MXZ]);
  }
  return h;
}

Moments ray_moments(const RayRep& rays) {
  Moments s = Moments::Zero();
  for (std::size_t ray = 0; ray < rays.grid.size(); ++ray)
    for (std::uint32_t n = rays.first[ray]; n < rays.first[ray + 1]; ++n)
      add_segment(s, rays.grid.at(ray), rays.intervals[n].lo, rays.intervals[n].hi);
  return s * rays.grid.cell_area_mm2();
}

}  // namespace rayrep
