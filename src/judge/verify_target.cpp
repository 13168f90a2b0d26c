#include <cmath>

#include "judge/verify_detail.h"
#include "rayrep/base/error.h"
#include "rayrep/judge/verify.h"

namespace rayrep {
namespace {

using namespace verify_detail;

void check_goal(const TargetGoalSpec& goal) {
  bool sound = goal.density_g_cm3 > 0 && goal.wall_mm >= 0;
  bool any = false;
  for (int k = M1; k <= MXZ; ++k) {
    const std::optional<double>& wanted = goal.wanted[static_cast<std::size_t>(k)];
    if (!wanted) continue;
    any = true;
    const bool must_be_positive = k == M1 || (k >= MXX && k <= MZZ);
    sound = sound && std::isfinite(*wanted) && (*wanted > 0 || !must_be_positive);
  }
  if (!sound || !any)
    throw Error(ErrorCode::usage,
                "The goal makes no sense: at least one number must be wanted, all of them finite, mass, moments of inertia and "
                "density positive and the wall not negative.");
}

TargetState state_of(const Mesh& mesh, bool closed, double diagonal_mm, const TargetGoalSpec& goal, const Progress& progress) {
  TargetState state;
  state.body = mass_properties_of(material_of(mesh, closed, progress), goal.density_g_cm3);
  state.deviations = inertial_deviations(goal.wanted, state.body, diagonal_mm);
  return state;
}

std::string description(MomentIndex number) {
  if (number == M1) return "mass against the wanted mass, relative";
  const std::string name = inertial_name(number);
  if (number <= MZ) return "centre of mass, " + name.substr(4) + ", off the wanted one, over the diagonal";
  std::string entry = "I" + name.substr(1);
  if (number <= MZZ) return entry + " about the centre of mass against the wanted one, relative";
  return entry + " off the wanted one, over the mean of the two moments";
}

}  // namespace

TargetState target_state_of(const Mesh& mesh, const TargetGoalSpec& goal, const Progress& progress) {
  check_goal(goal);
  const Mesh merged = merged_mesh(mesh);
  return state_of(merged, unbalanced_edges(merged) == 0, bounding_box(merged).diagonal().norm(), goal, progress);
}

TargetVerdict verify_target(const Mesh& delivered, const Mesh* original, const TargetGoalSpec& goal, const TargetLimits& limits,
                            const Progress& progress) {
  check_goal(goal);
  TargetVerdict verdict;
  const Surface surface = judge_surface(delivered, original, progress, verdict);
  verdict.state = state_of(surface.mesh, Surface::closed(verdict), surface.diagonal_mm, goal, progress);
  add_surface_criteria(surface, original != nullptr, goal.wall_mm, limits.wall_ratio, verdict);
  for (const InertialDeviation& d : verdict.state.deviations)
    verdict.criteria.push_back(at_most(inertial_name(d.number), description(d.number), d.relative, limits.relative));
  return verdict;
}

}  // namespace rayrep
