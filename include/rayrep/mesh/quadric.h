#pragma once

#include <Eigen/Core>

namespace rayrep {

/// A quadric as a function of the point: f(p) = constant + slope . p + p^T hessian p / 2.
struct Quadric {
  Eigen::Matrix3d hessian = Eigen::Matrix3d::Zero();
  Eigen::Vector3d slope = Eigen::Vector3d::Zero();
  double constant = 0;

  /// Positive on the side to which a plane's normal points; the distance from it for a unit vector.
  static Quadric plane(const Eigen::Vector3d& normal, double offset_mm) { return {Eigen::Matrix3d::Zero(), normal, -offset_mm}; }
  /// Positive outside of a cylinder without ends: (r^2 - radius^2) / (2 radius), r the distance from its axis. Near the cylinder
  /// that is the distance from it. @param axis  a unit vector
  static Quadric cylinder(const Eigen::Vector3d& point_mm, const Eigen::Vector3d& axis, double radius_mm) {
    const Eigen::Matrix3d across = Eigen::Matrix3d::Identity() - axis * axis.transpose();
    const Eigen::Vector3d foot = across * point_mm;
    return {across / radius_mm, -foot / radius_mm, 0.5 * (foot.squaredNorm() / radius_mm - radius_mm)};
  }
  Quadric operator-() const { return {-hessian, -slope, -constant}; }

  double value(const Eigen::Vector3d& p) const { return constant + 0.5 * (slope + gradient(p)).dot(p); }
  Eigen::Vector3d gradient(const Eigen::Vector3d& p) const {
    // Written out: a product of matrices is not inlined.
    return slope + hessian.col(0) * p.x() + hessian.col(1) * p.y() + hessian.col(2) * p.z();
  }

  /// f / |grad f|: the distance to f = 0, of first order, positive where f is; infinite where f has no slope.
  double distance(const Eigen::Vector3d& p) const {
    const double v = value(p);
    return v == 0 ? 0 : v / gradient(p).norm();
  }
  /// The point of f = 0 that steps along the gradient lead to; p itself where it has no slope.
  Eigen::Vector3d nearest(Eigen::Vector3d p) const {
    for (int step = 0; step < 4; ++step) {
      const Eigen::Vector3d g = gradient(p);
      const double v = constant + 0.5 * (slope + g).dot(p);
      if (v == 0 || g.squaredNorm() == 0) break;
      p -= v / g.squaredNorm() * g;
    }
    return p;
  }
};

}  // namespace rayrep
