#pragma once

#include "rayrep/interior.h"
#include "rayrep/ray_rep.h"

namespace rayrep {

/// Interior of the float and stand problems on rays (ray-reps paper, Sec. 3.2 and Eq. 11): one variable z1 per interval [zmin,
/// zmax] of the inner domain, material from z0 = zmin to z1, void above. Per interval with cell area A at (x, y):
///
///     s_1 = A (z1 - zmin),  s_z = A (z1^2 - zmin^2)/2,  s_zz = A (z1^3 - zmin^3)/3,  times powers of x and y. theory.md (13)
class BottomFilledRays final : public Interior {
public:
  explicit BottomFilledRays(RayRep domain);

  const RayRep& domain() const { return domain_; }
  Eigen::Index variables() const override;
  Eigen::VectorXd lower_bounds() const override;
  Eigen::VectorXd upper_bounds() const override;
  Eigen::VectorXd start(double fill) const override;
  Eigen::Matrix<double, 10, Eigen::Dynamic> contributions(const Eigen::VectorXd& z1) const override;
  Eigen::Matrix<double, 10, Eigen::Dynamic> jacobian(const Eigen::VectorXd& z1) const override;
  Eigen::VectorXd hessian_diagonal(const Eigen::VectorXd& z1, const Moments& w, Eigen::Index first,
                                   Eigen::Index count) const override;

private:
  RayRep domain_;
  std::vector<Eigen::Vector2d> xy_;  ///< of each interval
};

/// Which segments the spin and yo-yo problems may choose on a ray's interval [zmin, zmax].
enum class SegmentBounds {
  /// Ray-reps paper, Eq. 13-14: zmin <= z0 <= mid <= z1 <= zmax with mid the interval's middle. Excludes segments off the middle.
  paper,
  /// zmin <= z0 <= z1 <= zmax: every single segment, and none.
  complete
};

/// What lies between z0 and z1.
enum class Between {
  material,  ///< as in the papers; the best for a largest axis, whose q_zz is positive
  cavity     ///< material below z0 and above z1; the best for a smallest axis, whose q_zz is negative
};

/// Interior of the spin and yo-yo problems on rays (ray-reps paper, Eq. 2): two variables per interval of the inner domain, in the
/// order z0, z1 of each. Moments of the material between them, or below and above, as in (13).
class SegmentRays final : public Interior {
public:
  SegmentRays(RayRep domain, SegmentBounds bounds, Between between = Between::material);

  const RayRep& domain() const { return domain_; }
  Eigen::Index variables() const override;
  Eigen::VectorXd lower_bounds() const override;
  Eigen::VectorXd upper_bounds() const override;
  std::vector<std::pair<int, int>> ordered_pairs() const override;
  Eigen::VectorXd start(double fill) const override;
  Eigen::Matrix<double, 10, Eigen::Dynamic> contributions(const Eigen::VectorXd& z) const override;
  Eigen::Matrix<double, 10, Eigen::Dynamic> jacobian(const Eigen::VectorXd& z) const override;
  Eigen::VectorXd hessian_diagonal(const Eigen::VectorXd& z, const Moments& w, Eigen::Index first,
                                   Eigen::Index count) const override;

private:
  /// +1 where material grows with z, -1 where it shrinks.
  double end_sign(Eigen::Index v) const { return (v % 2 == 0) == (between_ == Between::material) ? -1 : 1; }

  RayRep domain_;
  SegmentBounds bounds_;
  Between between_;
  std::vector<Eigen::Vector2d> xy_;  ///< of each interval
};

/// Moments of a ray's segment from lo to hi at (x, y), per unit of cell area: mm, mm^2, mm^3. Negative when hi < lo. theory.md (13)
Moments segment_moments(const Eigen::Vector2d& xy, double lo, double hi);

/// Moments of all of a ray-rep's intervals, unit density.
Moments ray_moments(const RayRep& rays);

}  // namespace rayrep
