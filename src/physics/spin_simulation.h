#pragma once

#include <Eigen/Cholesky>
#include <Eigen/Core>
#include <Eigen/Geometry>
#include <algorithm>
#include <boost/numeric/odeint.hpp>
#include <cmath>
#include <numbers>
#include <vector>

#include "base/rotation.h"

/// Nonlinear simulation of spinning rigid bodies, for verify and for tests. It shares nothing with the linear analysis in
/// rayrep/physics/spin.h: the full equations of motion with the full inertia tensor are integrated in time. Units: g, mm, s.
namespace rayrep::physics {

enum class Support { none, sliding, fixed };

/// A rigid body; vectors in axes fixed to it.
struct Body {
  double mass_g = 1;
  Eigen::Matrix3d inertia_g_mm2 = Eigen::Matrix3d::Identity();  ///< about the centre of mass
  Eigen::Vector3d tip_mm = Eigen::Vector3d::Zero();             ///< contact point as seen from the centre of mass
};

struct Motion {
  double largest_tilt_rad =
      0;                      ///< largest angle of the spin axis against the vertical; the run ends when it passes `stop_tilt_rad`
  double energy_drift = 0;    ///< largest change of the energy, relative to the kinetic energy of the spin
  double momentum_drift = 0;  ///< largest change of the angular momentum about the vertical, relative to its start
  double revolutions = 0;     ///< until the end of the run
};

struct Spin {
  Eigen::Vector3d axis = Eigen::Vector3d::UnitZ();  ///< spin axis in body axes, unit; it starts vertical up to the kick
  double speed_rad_s = 0;
  double kick = 1e-4;         ///< initial angle of the axis to the vertical and of the angular momentum to the axis, rad
  double kick_angle_rad = 1;  ///< direction of the tilt about the axis
  double revolutions = 100;
  double stop_tilt_rad = 0.5;
  double gravity_mm_s2 = 9806.65;
};

/// The state is the vertical k, a unit vector, and the angular velocity W, both in body axes: k' = k x W, and with the tip at r
/// from the centre of mass, t = r x k, I about the centre of mass,
///  none:     I W' = -W x I W
///  fixed:    J W' = -W x J W + M g t,  J = I + M (r.r 1 - r r^T)
///  sliding:  I W' = -W x I W + N t. Without friction nothing pushes the centre of mass sideways; its height is -r.k, so
///            N = M (g - t.W' - W.(r x (k x W))), which makes (I + M t t^T) W' = -W x I W + M (g - W.(r x (k x W))) t.
class EquationsOfMotion {
public:
  using State = std::vector<double>;  // k, W: six numbers

  EquationsOfMotion(const Body& body, Support support, double gravity) : body_(body), support_(support), gravity_(gravity) {
    const Eigen::Vector3d& r = body.tip_mm;
    inertia_ = body.inertia_g_mm2;
    if (support == Support::fixed) inertia_ += body.mass_g * (r.squaredNorm() * Eigen::Matrix3d::Identity() - r * r.transpose());
  }

  void operator()(const State& x, State& dxdt, double /*t*/) const {
    const Eigen::Map<const Eigen::Vector3d> k(x.data()), w(x.data() + 3);
    Eigen::Map<Eigen::Vector3d> dk(dxdt.data()), dw(dxdt.data() + 3);
    dk = k.cross(w);
    Eigen::Vector3d torque = -w.cross(inertia_ * w);
    Eigen::Matrix3d inertia = inertia_;
    const Eigen::Vector3d t = body_.tip_mm.cross(k);
    if (support_ == Support::fixed) torque += body_.mass_g * gravity_ * t;
    if (support_ == Support::sliding) {
      torque += body_.mass_g * (gravity_ - w.dot(body_.tip_mm.cross(dk))) * t;
      inertia += body_.mass_g * t * t.transpose();
    }
    dw = inertia.llt().solve(torque);
  }

  double energy(const State& x) const {
    const Eigen::Map<const Eigen::Vector3d> k(x.data()), w(x.data() + 3);
    double e = 0.5 * w.dot(inertia_ * w);
    if (support_ == Support::none) return e;
    if (support_ == Support::sliding) {
      const double rise = -body_.tip_mm.dot(k.cross(w));
      e += 0.5 * body_.mass_g * rise * rise;
    }
    return e - body_.mass_g * gravity_ * body_.tip_mm.dot(k);
  }

  /// About the centre of mass, for a fixed tip about the tip.
  const Eigen::Matrix3d& inertia() const { return inertia_; }

  double vertical_momentum(const State& x) const {
    const Eigen::Map<const Eigen::Vector3d> k(x.data()), w(x.data() + 3);
    return k.dot(inertia_ * w);
  }

private:
  Body body_;
  Support support_;
  double gravity_;
  Eigen::Matrix3d inertia_;
};

/// Spins a body about `spin.axis`, tilted a little against the vertical, and watches the tilt.
inline Motion simulate(const Body& body, Support support, const Spin& spin) {
  namespace ode = boost::numeric::odeint;
  using State = EquationsOfMotion::State;
  const EquationsOfMotion equations(body, support, spin.gravity_mm_s2);
  const Eigen::Vector3d e1 = spin.axis.unitOrthogonal(), e2 = spin.axis.cross(e1);
  const Eigen::Vector3d side = std::cos(spin.kick_angle_rad) * e1 + std::sin(spin.kick_angle_rad) * e2;
  State x(6);
  Eigen::Map<Eigen::Vector3d>(x.data()) = std::cos(spin.kick) * spin.axis + std::sin(spin.kick) * side;
  // A pure tilt would leave a free body turning steadily about its tilted axis.
  const double axial = spin.axis.dot(equations.inertia() * spin.axis), lateral = (equations.inertia().trace() - axial) / 2;
  const Eigen::Vector3d push = spin.kick * axial / lateral * (0.8 * side + 0.6 * spin.axis.cross(side));
  Eigen::Map<Eigen::Vector3d>(x.data() + 3) = spin.speed_rad_s * (spin.axis + push);

  const double energy0 = equations.energy(x), momentum0 = equations.vertical_momentum(x);
  const double kinetic = 0.5 * spin.speed_rad_s * spin.speed_rad_s * axial;
  const double turn = 2 * std::numbers::pi / spin.speed_rad_s, end = spin.revolutions * turn;
  // Absolute errors matter for k, of size 1, relative ones for W.
  auto stepper = ode::make_controlled(1e-12, 1e-11, ode::runge_kutta_fehlberg78<State>());
  double t = 0, dt = turn / 20;
  Motion motion;
  while (t < end && motion.largest_tilt_rad < spin.stop_tilt_rad) {
    dt = std::min({dt, end - t, turn / 8});
    if (stepper.try_step(equations, x, t, dt) == ode::fail) continue;
    const Eigen::Map<const Eigen::Vector3d> k(x.data());
    motion.largest_tilt_rad = std::max(motion.largest_tilt_rad, angle_between(k, spin.axis));
    motion.energy_drift = std::max(motion.energy_drift, std::abs(equations.energy(x) - energy0) / kinetic);
    motion.momentum_drift = std::max(motion.momentum_drift, std::abs(equations.vertical_momentum(x) / momentum0 - 1));
  }
  motion.revolutions = t / turn;
  return motion;
}

}  // namespace rayrep::physics
