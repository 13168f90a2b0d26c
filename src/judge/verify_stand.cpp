#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <string>

#include "judge/verify_detail.h"
#include "rayrep/base/error.h"
#include "rayrep/judge/verify.h"

namespace rayrep {
namespace {

using namespace verify_detail;

void check_goal(const StandGoalSpec& goal) {
  if (!goal.up.allFinite() || !(goal.up.norm() > 0) || !(goal.density_g_cm3 > 0) || !(goal.wall_mm >= 0) ||
      (goal.contact_tolerance_mm && !(*goal.contact_tolerance_mm >= 0 && std::isfinite(*goal.contact_tolerance_mm))) ||
      (goal.target_mm && !goal.target_mm->allFinite()))
    throw Error(ErrorCode::usage,
                "The goal makes no sense: up must be a direction, the density positive, the wall and the contact tolerance not "
                "negative and the target finite.");
}

// Exact for directions along the axes.
Eigen::Matrix3d turning_up(const Eigen::Vector3d& up) {
  const Eigen::Matrix3d R = Eigen::Quaterniond::FromTwoVectors(up, Eigen::Vector3d::UnitZ()).toRotationMatrix();
  const Eigen::Matrix3d rounded = R.array().round();
  return (R - rounded).norm() < 1e-12 ? rounded : R;
}

StandState state_of(const Mesh& mesh, bool closed, const StandGoalSpec& goal, const Progress& progress) {
  StandState state;
  const Mesh material = material_of(mesh, closed, progress);
  state.body = mass_properties_of(material, goal.density_g_cm3);
  state.to_ground = turning_up(goal.up);
  const Mesh standing = transformed(material, Eigen::Affine3d(state.to_ground));
  const double height_mm = bounding_box(standing).sizes().z();
  state.polygon = support_polygon(standing, goal.contact_tolerance_mm.value_or(contact_tolerance_mm(height_mm)));

  const Eigen::Vector3d centre = state.to_ground * state.body.centre_of_mass_mm;
  state.centre_mm = centre.head<2>();
  state.height_mm = centre.z() - state.polygon.ground_mm;
  state.tipping_angles_rad = tipping_angles_rad(state.polygon, centre);
  state.smallest_tipping_angle_rad = *std::min_element(state.tipping_angles_rad.begin(), state.tipping_angles_rad.end());
  if (goal.target_mm) state.target_offset_mm = (state.centre_mm - (state.to_ground * *goal.target_mm).head<2>()).norm();
  return state;
}

}  // namespace

StandState stand_state_of(const Mesh& mesh, const StandGoalSpec& goal, const Progress& progress) {
  check_goal(goal);
  const Mesh merged = merged_mesh(mesh);
  return state_of(merged, unbalanced_edges(merged) == 0, goal, progress);
}

StandVerdict verify_stand(const Mesh& delivered, const Mesh* original, const StandGoalSpec& goal, const StandLimits& limits,
                          const Progress& progress) {
  check_goal(goal);
  StandVerdict verdict;
  const Surface surface = judge_surface(delivered, original, progress, verdict);
  verdict.state = state_of(surface.mesh, Surface::closed(verdict), goal, progress);
  add_surface_criteria(surface, original != nullptr, goal.wall_mm, limits.wall_ratio, verdict);

  const StandState& state = verdict.state;
  const std::size_t corners = state.polygon.corners_mm.size();
  auto& criteria = verdict.criteria;
  criteria.push_back(at_least("supported", "corners of the support polygon", static_cast<double>(corners), 3));
  criteria.push_back(at_least("inside", "smallest tipping angle, rad", state.smallest_tipping_angle_rad, limits.tipping_angle_rad));
  if (goal.target_mm)
    criteria.push_back(at_most("offset", "horizontal distance of the centre of mass from the target, over the diagonal",
                               state.target_offset_mm / surface.diagonal_mm, limits.offset_over_diagonal));
  if (corners < 3)
    verdict.notes.push_back(std::string("The body touches the ground only in ") + (corners == 1 ? "a point" : "an edge") +
                            ": it cannot stand there, wherever its centre of mass lies.");
  return verdict;
}

}  // namespace rayrep
