#pragma once

#include "rayrep/rays/interior.h"
#include "rayrep/rays/ray_rep.h"

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

inline constexpr const char* kSegmentBoundsNames[] = {"paper", "complete"};

/// What lies between z0 and z1.
enum class Between {
  material,  ///< as in the papers; the best for a largest axis, whose q_zz is positive
  cavity     ///< material below z0 and above z1; the best for a smallest axis, whose q_zz is negative
};

/// Interior of the spin and yo-yo problems on rays with SegmentBounds::paper (ray-reps paper, Eq. 2): two variables per interval of
/// the inner domain, in the order z0, z1 of each. Moments of the material between them, or below and above, as in (13).
class CentredSegmentRays final : public Interior {
public:
  explicit CentredSegmentRays(RayRep domain, Between between = Between::material);

  const RayRep& domain() const { return domain_; }
  Eigen::Index variables() const override;
  Eigen::VectorXd lower_bounds() const override;
  Eigen::VectorXd upper_bounds() const override;
  Eigen::VectorXd start(double fill) const override;
  Eigen::Matrix<double, 10, Eigen::Dynamic> contributions(const Eigen::VectorXd& z) const override;
  Eigen::Matrix<double, 10, Eigen::Dynamic> jacobian(const Eigen::VectorXd& z) const override;
  Eigen::VectorXd hessian_diagonal(const Eigen::VectorXd& z, const Moments& w, Eigen::Index first,
                                   Eigen::Index count) const override;

private:
  /// +1 where material grows with z, -1 where it shrinks.
  double end_sign(Eigen::Index v) const { return (v % 2 == 0) == (between_ == Between::material) ? -1 : 1; }

  RayRep domain_;
  Between between_;
  std::vector<Eigen::Vector2d> xy_;  ///< of each interval
};

/// Interior of the spin and yo-yo problems on rays with SegmentBounds::complete. An interval of length L and middle m holds the
/// segment [z0, z1], with ends at zeta = z - m from the middle. Two variables per interval, in mm:
///
///     a = (z1 - z0) (L + zeta0 + zeta1) / (2 L),   b = (z1 - z0) (L - zeta0 - zeta1) / (2 L).
///
/// z1 - z0 = a + b, the segment's middle is m + L (a - b) / (2 (a + b)). The segments within the interval are the convex set
///
///     2 L a >= (a + b)^2,   2 L b >= (a + b)^2
///
/// (equal where z0 = zmin, and z1 = zmax), a = b = L/2 is the full interval and a = b = 0 is none, wherever z0 = z1 may be. Per
/// unit of cell area length and first moment are linear and the second one is convex:
///
///     s_1  = a + b
///     s_z  = m (a + b) + L (a - b)/2
///     s_zz = m^2 (a + b) + m L (a - b) + L^2 (a - b)^2 / (4 (a + b)) + (a + b)^3/12
///
/// So a stationary point of q.s is its minimum over all segments where q_zz >= 0, and around cavities where q_zz <= 0: theory.md
/// (26d-f). Second derivatives need a + b > 0; the first ones at a + b = 0 are those along a = b.
class SegmentRays final : public Interior {
public:
  /// @param domain  intervals longer than 0 (not checked)
  explicit SegmentRays(RayRep domain, Between between = Between::material);

  const RayRep& domain() const { return domain_; }
  Eigen::Index variables() const override;
  Eigen::VectorXd lower_bounds() const override;
  Eigen::VectorXd upper_bounds() const override;  ///< infinite: the pairs see to it
  Eigen::VectorXd pair_lengths() const override;
  Eigen::VectorXd start(double fill) const override;
  Eigen::Matrix<double, 10, Eigen::Dynamic> contributions(const Eigen::VectorXd& ab) const override;
  Eigen::Matrix<double, 10, Eigen::Dynamic> jacobian(const Eigen::VectorXd& ab) const override;
  Eigen::VectorXd hessian_diagonal(const Eigen::VectorXd& ab, const Moments& w, Eigen::Index first,
                                   Eigen::Index count) const override;
  Eigen::VectorXd hessian_of_pairs(const Eigen::VectorXd& ab, const Moments& w, Eigen::Index first,
                                   Eigen::Index count) const override;

  /// z0, z1 of each interval; within it, also where a and b are not quite. The middle, twice, where a + b = 0.
  Eigen::VectorXd ends(const Eigen::VectorXd& ab) const;
  /// a, b of each interval from its z0 <= z1.
  Eigen::VectorXd from_ends(const Eigen::VectorXd& z) const;

private:
  struct Segment;
  Segment segment(const Eigen::VectorXd& ab, Eigen::Index k) const;

  RayRep domain_;
  double area_mm2_;  ///< of a cell; negative where what lies between the ends is a cavity
  Between between_;
  std::vector<Eigen::Vector2d> xy_;  ///< of each interval
};

/// Moments of a ray's segment from lo to hi at (x, y), per unit of cell area: mm, mm^2, mm^3. Negative when hi < lo. theory.md (13)
Moments segment_moments(const Eigen::Vector2d& xy, double lo, double hi);

/// Moments of all of a ray-rep's intervals, unit density.
Moments ray_moments(const RayRep& rays);

}  // namespace rayrep
