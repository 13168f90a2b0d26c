#include "rayrep/physics/spin.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "base/linear_algebra.h"
#include "base/text.h"
#include "rayrep/base/error.h"

namespace rayrep {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

// Moments closer than this, relative to the larger, are the same: far above the rounding of moments, far below what a print
// can hold. Ranges and gaps of that relative width in w^2 are no ranges and no gaps.
constexpr double kTie = 1e-9;

double difference(double x, double y) { return std::abs(x - y) <= kTie * std::max(std::abs(x), std::abs(y)) ? 0.0 : x - y; }

void require_positive(double value, const char* name, const char* unit) {
  if (value > 0 && std::isfinite(value)) return;
  throw Error(ErrorCode::input, concat("The ", name, " of a top must be positive and finite; it is ", value, " ", unit, "."));
}

// Stability of one top as a function of W = w^2: theory.md (19)-(21). Units: g mm^2 for moments, g mm^2/s^2 for the torque.
class StabilityCondition {
public:
  StabilityCondition(double i1, double i2, double i3, double torque)
      : torque_(torque),
        slope_a_(difference(i3, i2)),
        slope_b_(difference(i3, i1)),
        slope_sum_(i1 * i2 + slope_a_ * slope_b_),
        sum_(i1 + i2) {
    const double d = i1 + i2 - i3;
    const double r1 = i1 * (2 * i2 - i3);
    const double r2 = i2 * (2 * i1 - i3);
    // Otherwise the discriminant has no positive root and is nowhere negative.
    if (d > 0 && r1 > 0 && r2 > 0 && torque > 0) {
      const double scale = torque / (i3 * i3 * d);
      // The difference of the two square roots of I1 (2 I2 - I3) and I2 (2 I1 - I3), without cancellation.
      const double sum = std::sqrt(r1) + std::sqrt(r2);
      const double gap = i3 * difference(i2, i1) / sum;
      flutter_lo_ = scale * gap * gap;
      flutter_hi_ = scale * sum * sum;
    }
  }

  // All W > 0 where one of the three conditions may change its sign, ascending.
  std::vector<double> ends() const {
    std::vector<double> w = {torque_ / slope_a_, torque_ / slope_b_, torque_ * sum_ / slope_sum_, flutter_lo_, flutter_hi_};
    std::erase_if(w, [](double x) { return !(x > 0 && std::isfinite(x)); });
    std::sort(w.begin(), w.end());
    return w;
  }

  bool stable(double w) const {
    const double a = slope_a_ * w - torque_;
    const double b = slope_b_ * w - torque_;
    if (!((a > 0 && b > 0) || (a < 0 && b < 0))) return false;
    return slope_sum_ * w > torque_ * sum_ && !(w > flutter_lo_ && w < flutter_hi_);
  }

private:
  double torque_;     // M g l
  double slope_a_;    // A = slope_a W - torque
  double slope_b_;    // B = slope_b W - torque
  double slope_sum_;  // I1 B + I2 A + G^2 = slope_sum W - sum torque
  double sum_;
  double flutter_lo_ = 0;  // the discriminant is negative strictly between these
  double flutter_hi_ = 0;
};

}  // namespace

std::vector<SpeedRange> stable_speeds(const Top& top, Tip tip, double gravity_mm_s2) {
  require_positive(top.mass_g, "mass", "g");
  require_positive(top.lateral_1_g_mm2, "smaller lateral moment of inertia", "g mm^2");
  require_positive(top.lateral_2_g_mm2, "larger lateral moment of inertia", "g mm^2");
  require_positive(top.axial_g_mm2, "axial moment of inertia", "g mm^2");
  const double torque = top.mass_g * gravity_mm_s2 * top.height_mm;
  if (!std::isfinite(torque)) throw Error(ErrorCode::input, "The height of a top's centre of mass and gravity must be finite.");

  const double shift = tip == Tip::fixed ? top.mass_g * top.height_mm * top.height_mm : 0.0;
  const StabilityCondition condition(top.lateral_1_g_mm2 + shift, top.lateral_2_g_mm2 + shift, top.axial_g_mm2, torque);

  // Between two neighbouring ends no condition changes its sign: one point decides.
  std::vector<double> ends = condition.ends();
  ends.insert(ends.begin(), 0.0);
  ends.push_back(kInfinity);
  std::vector<SpeedRange> ranges;  // of w^2 until the last step
  for (size_t i = 0; i + 1 < ends.size(); ++i) {
    const double lo = ends[i], hi = ends[i + 1];
    if (hi - lo <= kTie * lo) continue;
    const double inside = std::isfinite(hi) ? 0.5 * (lo + hi) : 2 * lo + 1;
    if (!condition.stable(inside)) continue;
    if (!ranges.empty() && lo - ranges.back().hi_rad_s <= kTie * lo) {
      ranges.back().hi_rad_s = hi;
    } else {
      ranges.push_back({lo, hi});
    }
  }
  for (SpeedRange& range : ranges) range = {std::sqrt(range.lo_rad_s), std::sqrt(range.hi_rad_s)};
  return ranges;
}

double off_balance_tilt_rad(const Top& top, double offset_mm, double speed_rad_s, double gravity_mm_s2) {
  const double weight = top.mass_g * gravity_mm_s2;
  const double w2 = speed_rad_s * speed_rad_s;
  const double a = std::abs((top.axial_g_mm2 - top.lateral_2_g_mm2) * w2 - weight * top.height_mm);
  const double b = std::abs((top.axial_g_mm2 - top.lateral_1_g_mm2) * w2 - weight * top.height_mm);
  return weight * offset_mm / std::min(a, b);
}

SpinState spin_state(const MassProperties& body, const Eigen::Vector3d& contact_mm, const Eigen::Vector3d& axis, bool yoyo) {
  if (!(std::abs(axis.norm() - 1) < 1e-6))
    throw Error(ErrorCode::usage, concat("The spin axis must be a unit vector; its length is ", axis.norm(), "."));
  SpinState state;
  state.body = body;
  const Eigen::Vector3d arm = body.centre_of_mass_mm - contact_mm;
  state.height_mm = arm.dot(axis);
  state.offset_mm = axis.cross(arm).norm();

  // Equal principal moments share a plane (or all of space) of principal axes: the angle is to the nearest of those.
  const Eigen::Vector3d& moments = body.principal_moments_g_mm2;
  const Eigen::Vector3d along = body.principal_axes.transpose() * axis;
  state.axis_angle_rad = kInfinity;
  for (int i = 0; i < 3; ++i) {
    double inside = 0, outside = 0;
    for (int j = 0; j < 3; ++j) (difference(moments[i], moments[j]) == 0 ? inside : outside) += along[j] * along[j];
    state.axis_angle_rad = std::min(state.axis_angle_rad, std::atan2(std::sqrt(outside), std::sqrt(inside)));
  }

  const Eigen::Vector3d u = axis.unitOrthogonal();
  Eigen::Matrix<double, 3, 2> across;
  across << u, axis.cross(u);
  const Eigen::Matrix2d block = across.transpose() * body.inertia_g_mm2 * across;
  const Eigen::Vector2d lateral = symmetric_eigenvalues(block);
  const double axial = axis.dot(body.inertia_g_mm2 * axis);
  state.ratio_smaller = axial / lateral[0];
  state.ratio_larger = axial / lateral[1];
  if (difference(axial, lateral[1]) > 0) {
    state.axis_class = AxisClass::largest;
  } else if (difference(axial, lateral[0]) <= 0) {
    state.axis_class = AxisClass::smallest;
  }

  const Top top{body.mass_g, yoyo ? 0.0 : state.height_mm, lateral[0], lateral[1], axial};
  state.sliding = stable_speeds(top, Tip::sliding);
  state.fixed = stable_speeds(top, Tip::fixed);
  return state;
}

double rpm(double rad_s) { return rad_s * (30 / std::numbers::pi); }

const char* name_of(AxisClass axis) {
  return axis == AxisClass::largest ? "largest" : axis == AxisClass::smallest ? "smallest" : "middle";
}

}  // namespace rayrep
