#include "mesh/windings.h"

#include <tbb/parallel_for.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <utility>

#include "mesh/predicates.h"

namespace rayrep {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr double kHalfUlp = 0x1p-53;

Vector2d seen(const Vector3d& p, int axis) { return {p[(axis + 1) % 3], p[(axis + 2) % 3]}; }

}  // namespace

int best_axis(const Vector3d& a, const Vector3d& b, const Vector3d& c) {
  int axis = 0;
  (b - a).cross(c - a).cwiseAbs().maxCoeff(&axis);
  for (int k = 0; k < 2 && orient2d(seen(a, axis), seen(b, axis), seen(c, axis)) == 0; ++k) axis = (axis + 1) % 3;
  return axis;
}

Probe::Probe(const ExactPoint& a, const ExactPoint& b, const ExactPoint& c, int axis)
    : a_(a), b_(b), c_(c), axis_(axis), near_((a.near + b.near + c.near) / 3) {
  const double largest = std::max({a.near.cwiseAbs().maxCoeff(), b.near.cwiseAbs().maxCoeff(), c.near.cwiseAbs().maxCoeff()});
  error_ = 8 * kHalfUlp * largest;
}

const HomogeneousPoint& Probe::exact() const {
  if (!exact_) exact_ = centroid(a_.exact, b_.exact, c_.exact);
  return *exact_;
}

Windings::Windings(const Operands& all, const ExactNumbers& numbers)
    : all_(all), numbers_(numbers), triangles_(static_cast<std::size_t>(all.count)) {
  for (std::size_t t = 0; t < all.operand.size(); ++t)
    triangles_[static_cast<std::size_t>(all.operand[t])].push_back(static_cast<int>(t));
  std::vector<std::optional<BoxTree>> trees(triangles_.size());
  tbb::parallel_for(std::size_t{0}, triangles_.size(), [&](std::size_t k) {
    std::vector<Eigen::AlignedBox3d> boxes;
    boxes.reserve(triangles_[k].size());
    for (const int t : triangles_[k]) {
      boxes.emplace_back();
      for (int c = 0; c < 3; ++c) boxes.back().extend(all.mesh.corner(static_cast<std::size_t>(t), c));
    }
    trees[k].emplace(std::move(boxes));
  });
  std::vector<Eigen::AlignedBox3d> boxes;
  for (auto& tree : trees) {
    boxes.push_back(tree->box());
    trees_.push_back(std::move(*tree));
  }
  operands_.emplace(std::move(boxes));
}

/// Whether the line through the probe, moved by so little that it meets no side, passes the triangle, which faces up the axis (+1)
/// or down.
bool Windings::passes(int t, const Probe& probe, int up) const {
  const int i = (probe.axis() + 1) % 3, j = (probe.axis() + 2) % 3;
  const Vector3d& p = probe.near();
  for (int k = 0; k < 3; ++k) {
    const Vector3d& a = all_.mesh.corner(static_cast<std::size_t>(t), k);
    const Vector3d& b = all_.mesh.corner(static_cast<std::size_t>(t), (k + 1) % 3);
    const double left = (b[i] - a[i]) * (p[j] - a[j]);
    const double right = (b[j] - a[j]) * (p[i] - a[i]);
    const double bound =
        8 * kHalfUlp * (std::abs(left) + std::abs(right)) + 4 * probe.error() * (std::abs(b[i] - a[i]) + std::abs(b[j] - a[j]));
    double side = left - right;
    if (!(std::abs(side) > bound)) {
      const ExactPoint u{a, {numbers_.of(a)}}, v{b, {numbers_.of(b)}}, middle{p, probe.exact(), probe.error()};
      side = orient2d(u, v, middle, probe.axis());
      if (side == 0) side = a[j] != b[j] ? a[j] - b[j] : b[i] - a[i];  // moved along i, and far less along j
    }
    if ((side > 0) != (up > 0)) return false;
  }
  return true;
}

/// Whether the plane of a triangle that the line passes lies below the probe.
bool Windings::is_below(int t, const Probe& probe, int up) const {
  const auto n = static_cast<std::size_t>(t);
  const Vector3d &a = all_.mesh.corner(n, 0), &b = all_.mesh.corner(n, 1), &c = all_.mesh.corner(n, 2);
  const Vector3d u = b - a, v = c - a, w = probe.near() - a;
  const Vector3d normal = u.cross(v);
  const Vector3d terms(std::abs(u.y() * v.z()) + std::abs(u.z() * v.y()), std::abs(u.z() * v.x()) + std::abs(u.x() * v.z()),
                       std::abs(u.x() * v.y()) + std::abs(u.y() * v.x()));
  const double bound = 16 * kHalfUlp * terms.dot(w.cwiseAbs()) + 2 * probe.error() * terms.sum();
  double side = normal.dot(w);
  if (!(std::abs(side) > bound)) side = side_of(plane_through(numbers_.of(a), numbers_.of(b), numbers_.of(c)), probe.exact());
  return (side > 0) == (up > 0);
}

int Windings::facing(int t, int axis) const {
  const auto n = static_cast<std::size_t>(t);
  return orient2d(seen(all_.mesh.corner(n, 0), axis), seen(all_.mesh.corner(n, 1), axis), seen(all_.mesh.corner(n, 2), axis));
}

Beside Windings::beside(int operand, const Probe& probe, int group) const {
  Beside result;
  const auto k = static_cast<std::size_t>(operand);
  trees_[k].below(probe.near(), probe.axis(), probe.error(), [&](int number) {
    const int t = triangles_[k][static_cast<std::size_t>(number)];
    const int up = facing(t, probe.axis());
    if (up == 0 || !passes(t, probe, up)) return;
    if (group >= 0 && all_.group[static_cast<std::size_t>(t)] == group) {
      result.step -= up;
      result.on.push_back(t);
    } else if (is_below(t, probe, up)) {
      result.below -= up;
    }
  });
  return result;
}

}  // namespace rayrep
