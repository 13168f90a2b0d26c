#include <Eigen/Geometry>
#include <cmath>
#include <sstream>

#include "judge/verify_detail.h"
#include "physics/spin_simulation.h"
#include "rayrep/base/error.h"
#include "rayrep/judge/verify.h"

namespace rayrep {
namespace {

using namespace verify_detail;

void check_goal(const SpinGoalSpec& goal) {
  if (!goal.axis.allFinite() || !(goal.axis.norm() > 0) || !goal.contact_mm.allFinite() || goal.prefer == AxisClass::middle ||
      !(goal.density_g_cm3 > 0) || !(goal.wall_mm >= 0))
    throw Error(
        ErrorCode::usage,
        "The goal makes no sense: the axis must be a direction, the contact point finite, the preferred axis the largest or "
        "smallest one, the density positive and the wall not negative.");
}

SpinState state_of(const Mesh& mesh, bool closed, const SpinGoalSpec& goal, const Progress& progress) {
  const MassProperties body = mass_properties_of(material_of(mesh, closed, progress), goal.density_g_cm3);
  return spin_state(body, goal.contact_mm, goal.axis.normalized(), goal.yoyo);
}

void add_notes(const SpinVerdict& verdict, const Surface& surface, const SpinGoalSpec& goal, std::vector<std::string>& notes) {
  const AxisClass found = verdict.state.axis_class;
  if (found == AxisClass::middle)
    notes.push_back(
        "The spin axis is the middle one of the three principal axes: at speed the body tumbles however well it is centred.");
  else if (found != goal.prefer)
    notes.push_back(
        found == AxisClass::smallest
            ? "The spin axis is that of the smallest moment of inertia: it can be stable, but not as the largest would be."
            : "The spin axis is that of the largest moment of inertia, where the smallest was asked for.");
  if (goal.yoyo) return;
  const Eigen::Vector3d up = goal.axis.normalized();
  if (const double below = up.dot(goal.contact_mm) - lowest_along(surface.mesh, up); below > 1e-3 * surface.diagonal_mm) {
    std::ostringstream text;
    text.precision(3);
    text << "The body reaches " << below << " mm below its contact point: it needs a tip at least that long to spin there.";
    notes.push_back(text.str());
  }
}

/// The largest tilt of the body as it is, off-centre and all, spun in the last of its ranges of stable speed and kicked a little.
double simulated_tilt(const SpinState& state, const SpinGoalSpec& goal) {
  constexpr double kick_rad = 1e-3;
  constexpr double beyond_the_end = 1.2;
  const SpeedRange& range = state.sliding.back();
  physics::Spin spin;
  spin.axis = goal.axis.normalized();
  spin.speed_rad_s = std::isfinite(range.hi_rad_s) ? 0.5 * (range.lo_rad_s + range.hi_rad_s)
                     : range.lo_rad_s > 0          ? beyond_the_end * range.lo_rad_s
                                                   : 10;  // a free body: the speed only sets the unit of time
  spin.kick = kick_rad;
  const physics::Body body{state.body.mass_g, state.body.inertia_g_mm2, goal.contact_mm - state.body.centre_of_mass_mm};
  return simulate(body, goal.yoyo ? physics::Support::none : physics::Support::sliding, spin).largest_tilt_rad;
}

}  // namespace

SpinState spin_state_of(const Mesh& mesh, const SpinGoalSpec& goal, const Progress& progress) {
  check_goal(goal);
  const Mesh merged = merged_mesh(mesh);
  return state_of(merged, unbalanced_edges(merged) == 0, goal, progress);
}

SpinVerdict verify_spin(const Mesh& delivered, const Mesh* original, const SpinGoalSpec& goal, const SpinLimits& limits,
                        const Progress& progress) {
  check_goal(goal);
  SpinVerdict verdict;
  const Surface surface = judge_surface(delivered, original, progress, verdict);
  verdict.state = state_of(surface.mesh, Surface::closed(verdict), goal, progress);
  add_surface_criteria(surface, original != nullptr, goal.wall_mm, limits.wall_ratio, verdict);

  const SpinState& state = verdict.state;
  auto& criteria = verdict.criteria;
  criteria.push_back(at_most("offset", "distance of the centre of mass from the axis, over the diagonal",
                             state.offset_mm / surface.diagonal_mm, limits.offset_over_diagonal));
  if (goal.yoyo)
    criteria.push_back(at_most("centre", "distance of the centre of mass from the centre, over the diagonal",
                               (state.body.centre_of_mass_mm - goal.contact_mm).norm() / surface.diagonal_mm,
                               limits.offset_over_diagonal));
  criteria.push_back(at_most("axis_angle", "angle between the spin axis and the nearest principal axis, rad", state.axis_angle_rad,
                             limits.axis_angle_rad));
  if (goal.prefer == AxisClass::largest)
    criteria.push_back(
        at_least("axis_class", "moment about the axis, over the larger lateral one", state.ratio_larger, 1 + limits.class_margin));
  else
    criteria.push_back(
        at_most("axis_class", "moment about the axis, over the smaller lateral one", state.ratio_smaller, 1 - limits.class_margin));
  criteria.push_back(at_least("stable_speeds",
                              goal.yoyo ? "ranges of speed in which the free body spins stably"
                                        : "ranges of speed in which it spins stably on a sliding tip",
                              static_cast<double>(state.sliding.size()), 1));
  if (!state.sliding.empty()) {
    progress.check();
    criteria.push_back(at_most("simulated_tilt", "largest tilt in 100 turns after a kick of 0.001, simulated, rad",
                               simulated_tilt(state, goal), limits.simulated_tilt_rad));
  }
  add_notes(verdict, surface, goal, verdict.notes);
  return verdict;
}

}  // namespace rayrep
