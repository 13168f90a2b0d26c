#pragma once

#include <Eigen/Core>
#include <vector>

#include "rayrep/physics/moments.h"

namespace rayrep {

/// Where the moment of inertia about the spin axis, Izz, stands against the lateral principal moments, all about the centre of
/// mass. `largest`: Izz exceeds both. `smallest`: it exceeds neither. Ties (relative 1e-9) are sorted by what a sliding top does at
/// high speed: Izz equal to the larger lateral moment is `middle`, equal to the smaller one (or to both) is `smallest`.
enum class AxisClass { largest, middle, smallest };

/// "largest", "middle", "smallest".
const char* name_of(AxisClass axis);

/// How a top touches the ground: sliding without friction, or held in place by it.
enum class Tip { sliding, fixed };

/// Speeds of rotation at which an upright spin is stable, rad/s; `hi` may be infinite.
struct SpeedRange {
  double lo_rad_s = 0;
  double hi_rad_s = 0;
};

/// What the stability of an upright spin depends on.
struct Top {
  double mass_g = 0;
  double height_mm = 0;        ///< l, of the centre of mass above the contact point; 0 for a yo-yo (no gravity torque)
  double lateral_1_g_mm2 = 0;  ///< principal moments about the centre of mass across the axis, I1 <= I2
  double lateral_2_g_mm2 = 0;
  double axial_g_mm2 = 0;  ///< I3 = Izz
};

/// All speeds w > 0 at which the upright spin is linearly stable (theory.md (19)-(21)): with A = (I3 - I2) w^2 - M g l,
/// B = (I3 - I1) w^2 - M g l, G = (I1 + I2 - I3) w, stable iff A B > 0, b = I1 B + I2 A + G^2 > 0 and b^2 - 4 I1 I2 A B >= 0. For a
/// fixed tip I1 and I2 stand for I1 + M l^2 and I2 + M l^2 in these formulas; which axis is the largest may change with it.
/// The ends are exact (closed-form roots in w^2), ascending, disjoint; empty when no speed is stable. Largest axis, sliding: the
/// last range starts at Spin-It's Eq. 1 (there may be one more below it). Smallest: one range, to infinity. Middle: none, or
/// bounded. Moments, ends and ranges of w^2 that agree to 1e-9 count as equal: a symmetric top has one range, Lagrange's w^2 >= 4
/// I1 M g l / I3^2. l = 0, a free body: all speeds if I3 is distinctly the largest or smallest, none otherwise; a tie is neutral
/// (the axis wanders) and counts as not stable. l < 0, hanging from the contact point, is allowed.
/// @throws Error{input} if the mass or a moment is not positive and finite, or the height or gravity is not finite.
/// Not checked: that the three moments are those of a body (each at most the sum of the others).
std::vector<SpeedRange> stable_speeds(const Top& top, Tip tip, double gravity_mm_s2 = 9806.65);

/// The angle by which a top that spins steadily on a sliding tip leans when its centre of mass lies `offset_mm` beside the axis, to
/// first order: M g e / min(|A|, |B|), with A and B as in stable_speeds; theory.md (21a). Infinite where one of them vanishes.
double off_balance_tilt_rad(const Top& top, double offset_mm, double speed_rad_s, double gravity_mm_s2 = 9806.65);

/// A body on its spin axis.
struct SpinState {
  MassProperties body;
  double offset_mm = 0;       ///< distance of the centre of mass from the axis
  double height_mm = 0;       ///< of the centre of mass above the contact point, along the axis
  double axis_angle_rad = 0;  ///< between the spin axis and the nearest principal axis through the centre of mass
  AxisClass axis_class = AxisClass::middle;
  double ratio_larger = 0;          ///< Izz / the larger lateral principal moment
  double ratio_smaller = 0;         ///< Izz / the smaller lateral principal moment
  std::vector<SpeedRange> sliding;  ///< stable speeds, rad/s; meaningful when offset and axis_angle are small
  std::vector<SpeedRange> fixed;
};

/// State of a body that spins about the line through `contact_mm` along `axis`.
/// @param body  mass properties in the same frame
/// @param axis  unit vector, pointing up
/// @param yoyo  true: no ground and no gravity torque; height_mm is then the distance of the centre of mass from `contact_mm`
///              along the axis and the ranges are those of a free body
/// The class, the ratios and the ranges come from the inertia along the spin axis and its 2 x 2 block across it, which hold the
/// principal moments when axis_angle_rad is 0.
/// @throws Error{usage} if the axis is not a unit vector (1e-6).
SpinState spin_state(const MassProperties& body, const Eigen::Vector3d& contact_mm, const Eigen::Vector3d& axis, bool yoyo = false);

/// rad/s to revolutions per minute.
double rpm(double rad_s);

}  // namespace rayrep
