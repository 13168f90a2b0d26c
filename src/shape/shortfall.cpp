#include "shape/shortfall.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include "base/linear_algebra.h"

namespace rayrep::detail {
namespace {

/// A mixture of interiors and of what inequalities leave open.
class Mixture {
public:
  Mixture(const Wanted& wanted, const Moments& s, const Eigen::VectorXd& values) : wanted_(wanted), point_(values) {
    parts_.push_back({s, values, 1, true});
  }

  const Eigen::VectorXd& point() const { return point_; }

  void add(const Moments& s, const Eigen::VectorXd& values) { parts_.push_back({s, values, 0, true}); }

  Moments moments() const {
    Moments s = Moments::Zero();
    for (const Part& part : parts_)
      if (part.interior) s += part.weight * part.s;
    return s;
  }

  /// The point of least norm of all mixtures of the parts there are.
  void settle() {
    // Each inequality comes in once at most, but for rounding, and a matrix with few directions.
    auto left = 2 * point_.size() + 30;
    do {
      while (!step()) {
      }
    } while (open() && --left > 0);
  }

private:
  struct Part {
    Moments s;
    Eigen::VectorXd values;
    double weight;
    bool interior;  ///< else the direction of an inequality
  };

  /// Towards the nearest point of the affine hull. @returns false when a part had to leave on the way
  bool step() {
    const auto n = static_cast<Eigen::Index>(parts_.size());
    const auto first = std::find_if(parts_.begin(), parts_.end(), [](const Part& part) { return part.interior; });
    const auto base = static_cast<Eigen::Index>(first - parts_.begin());
    Eigen::MatrixXd edges(point_.size(), n - 1);
    for (Eigen::Index k = 0, e = 0; k < n; ++k) {
      if (k == base) continue;
      const Part& part = parts_[static_cast<std::size_t>(k)];
      edges.col(e++) = part.interior ? Eigen::VectorXd(part.values - first->values) : part.values;
    }
    Eigen::VectorXd rest(n - 1);
    if (n > 1) rest = -least_squares(edges, first->values);
    Eigen::VectorXd target(n);
    double sum = 0;
    for (Eigen::Index k = 0, e = 0; k < n; ++k) {
      if (k == base) continue;
      target[k] = rest[e++];
      if (parts_[static_cast<std::size_t>(k)].interior) sum += target[k];
    }
    target[base] = 1 - sum;
    double length = 1;
    for (Eigen::Index k = 0; k < n; ++k)
      if (const double w = parts_[static_cast<std::size_t>(k)].weight; target[k] <= 0)
        length = std::min(length, w / std::max(w - target[k], 1e-300));
    for (Eigen::Index k = 0; k < n; ++k) {
      double& w = parts_[static_cast<std::size_t>(k)].weight;
      w += length * (target[k] - w);
    }
    if (length < 1)
      parts_.erase(
          std::min_element(parts_.begin(), parts_.end(), [](const Part& a, const Part& b) { return a.weight < b.weight; }));
    point_.setZero();
    for (const Part& part : parts_) point_ += part.weight * part.values;
    return length == 1;
  }

  /// Lets in what is met with most to spare: an inequality, or a direction of the matrix. @returns false when there is none
  bool open() {
    const double rounding = 1e-12 * std::max(1.0, point_.norm());
    double least = -rounding;
    Eigen::VectorXd direction;
    for (Eigen::Index k = wanted_.equations; k < wanted_.equations + wanted_.inequalities(); ++k)
      if (point_[k] < least) {
        least = point_[k];
        direction = Eigen::VectorXd::Unit(point_.size(), k);
      }
    if (wanted_.matrix) {
      const Eigen::Vector3d m = point_.tail<3>();
      const double angle = 0.5 * std::atan2(-std::numbers::sqrt2 * m[2], m[1] - m[0]);  // of the lower eigenvalue
      const Eigen::Vector2d v(std::cos(angle), std::sin(angle));
      const Eigen::Vector3d lowest(v.x() * v.x(), v.y() * v.y(), std::numbers::sqrt2 * v.x() * v.y());
      if (m.dot(lowest) < least) {
        direction = Eigen::VectorXd::Zero(point_.size());
        direction.tail<3>() = lowest;
      }
    }
    if (direction.size() == 0) return false;
    parts_.push_back({Moments::Zero(), direction, 0, false});
    return true;
  }

  const Wanted& wanted_;
  std::vector<Part> parts_;
  Eigen::VectorXd point_;
};

}  // namespace

Support support(const Wanted& wanted, const Eigen::VectorXd& normal, const RayIntegrals& rays, const Moments& constant) {
  const Moments q = wanted.rows.transpose() * normal;
  const Moments s = constant + rays.moments(q);
  return {normal.dot(wanted.values(s)), s};
}

Shortfall shortfall(const Wanted& wanted, const RayIntegrals& rays, const Moments& constant, double tolerance) {
  constexpr int most_evaluations = 400;
  constexpr double precision = 1e-8;
  const Moments half = constant + 0.5 * rays.full();
  Mixture mixture(wanted, half, wanted.values(half));
  Shortfall result;
  mixture.settle();
  for (int evaluation = 0; evaluation < most_evaluations; ++evaluation) {
    result.distance = mixture.point().norm();
    if (result.distance < tolerance) break;
    const Eigen::VectorXd normal = (mixture.point() / result.distance).eval();
    const Support nearest = support(wanted, normal, rays, constant);
    if (result.distance - nearest.value <= precision * result.distance) break;
    mixture.add(nearest.moments, wanted.values(nearest.moments));
    mixture.settle();
    if (!(mixture.point().norm() < result.distance)) break;  // rounding
  }
  result.distance = mixture.point().norm();
  result.normal = Eigen::VectorXd::Zero(wanted.rows.rows());
  if (result.distance > 0) result.normal = mixture.point() / result.distance;
  const Eigen::Index inequalities = wanted.inequalities();
  result.normal.segment(wanted.equations, inequalities) =
      result.normal.segment(wanted.equations, inequalities).cwiseMax(0.0).eval();
  result.moments = mixture.moments();
  return result;
}

}  // namespace rayrep::detail
