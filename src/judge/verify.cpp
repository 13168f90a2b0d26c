#include "rayrep/judge/verify.h"

#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <vector>

#include "judge/verify_detail.h"
#include "rayrep/base/error.h"
#include "rayrep/mesh/mesh_check.h"

namespace rayrep {
namespace {

using namespace verify_detail;

constexpr double kInfinity = std::numeric_limits<double>::infinity();

// The largest angle to `up` at which the body comes to rest after releases tilted in several directions; pi if it sinks or never
// rests.
double settled_tilt(const Mesh& hull, const MassProperties& body, const Eigen::Vector3d& up, double fluid_g_cm3,
                    const FloatLimits& limits, const Progress& progress) {
  const Eigen::Vector3d side = up.unitOrthogonal();
  FloatingRestOptions options;
  options.fluid_g_cm3 = fluid_g_cm3;
  std::vector<double> tilts(std::max(limits.release_directions, 0));
  const auto release = [&](std::size_t k) {
    const double azimuth = 2 * std::numbers::pi * static_cast<double>(k) / static_cast<double>(tilts.size());
    const Eigen::Vector3d towards = std::cos(azimuth) * side + std::sin(azimuth) * up.cross(side);
    const Eigen::Vector3d start = std::cos(limits.release_tilt_rad) * up + std::sin(limits.release_tilt_rad) * towards;
    const FloatingRest rest = floating_rest(hull, body.mass_g, body.centre_of_mass_mm, start, options);
    tilts[k] = rest.converged ? std::atan2(rest.up.cross(up).norm(), rest.up.dot(up)) : std::numbers::pi;
  };
  // One release per thread at a time, so that an interrupt is seen between them.
  const auto batch = static_cast<std::size_t>(std::max(1, tbb::this_task_arena::max_concurrency()));
  for (std::size_t first = 0; first < tilts.size(); first += batch) {
    progress.check();
    tbb::parallel_for(first, std::min(first + batch, tilts.size()), release);
  }
  return tilts.empty() ? 0 : *std::max_element(tilts.begin(), tilts.end());
}

void check_goal(const FloatGoalSpec& goal) {
  if (!goal.up.allFinite() || !(goal.up.norm() > 0) || !std::isfinite(goal.waterline_mm) || !(goal.fluid_g_cm3 > 0) ||
      !(goal.density_g_cm3 > 0) || !(goal.wall_mm >= 0))
    throw Error(
        ErrorCode::usage,
        "The goal makes no sense: up must be a direction, the waterline a number of mm, both densities positive and the wall not "
        "negative.");
}

// @param body   the whole mesh, vertices merged
// @param outer  of these, what can bound the fluid; sealed cavities are left out here
// @param closed whether the winding number of `body` means anything
FloatState state_of(const Mesh& body, const Mesh& outer, bool closed, const FloatGoalSpec& goal, const FloatLimits& limits,
                    bool settle, const Progress& progress) {
  const Eigen::Vector3d up = goal.up.normalized();
  const Mesh material = material_of(body, closed, progress);
  FloatState state;
  state.body = mass_properties_of(material, goal.density_g_cm3);

  // Cavities go before the union is taken: shells are whole only as long as nothing has been cut.
  Mesh hull = outer_hull(outer);
  if (closed && material.triangles != body.triangles) hull = outer_hull(boundary_of_union(hull, progress));
  const Waterplane plane{up, lowest_along(body, up) + goal.waterline_mm};
  state.water = hydrostatics(hull, plane);
  state.displaced_mass_g = goal.fluid_g_cm3 * 1e-3 * state.water.displaced_volume_mm3;
  state.mass_error =
      state.displaced_mass_g > 0 ? std::abs(state.body.mass_g - state.displaced_mass_g) / state.displaced_mass_g : kInfinity;
  const Eigen::Vector3d arm = state.body.centre_of_mass_mm - state.water.centre_of_buoyancy_mm;
  state.horizontal_offset_mm = (arm - up.dot(arm) * up).norm();
  state.metacentric_height_mm = state.water.metacentric_radius_mm() - up.dot(arm);
  if (settle) state.settled_tilt_rad = settled_tilt(hull, state.body, up, goal.fluid_g_cm3, limits, progress);
  return state;
}

}  // namespace

bool Verdict::pass() const {
  return std::all_of(criteria.begin(), criteria.end(), [](const Criterion& c) { return c.pass(); });
}

FloatState float_state(const Mesh& mesh, const FloatGoalSpec& goal, const FloatLimits& limits, bool settle,
                       const Progress& progress) {
  check_goal(goal);
  const Mesh merged = merged_mesh(mesh);
  return state_of(merged, merged, unbalanced_edges(merged) == 0, goal, limits, settle, progress);
}

FloatVerdict verify_float(const Mesh& delivered, const Mesh* original, const FloatGoalSpec& goal, const FloatLimits& limits,
                          const Progress& progress) {
  check_goal(goal);
  FloatVerdict verdict;
  const Surface surface = judge_surface(delivered, original, progress, verdict);
  verdict.state = state_of(surface.mesh, surface.outer, Surface::closed(verdict), goal, limits, true, progress);
  add_surface_criteria(surface, original != nullptr, goal.wall_mm, limits.wall_ratio, verdict);

  const FloatState& state = verdict.state;
  const double diagonal = surface.diagonal_mm;
  if (state.body.mass_g > 0 && state.displaced_mass_g == 0)
    verdict.notes.push_back("At this waterline the body displaces nothing.");
  auto& criteria = verdict.criteria;
  criteria.push_back(at_most("mass_error", "mass against displaced mass, relative", state.mass_error, limits.mass_error));
  criteria.push_back(at_most("offset", "horizontal offset of the centres, over the diagonal", state.horizontal_offset_mm / diagonal,
                             limits.offset_over_diagonal));
  // Below this a body is neutral: floating_rest leaves it as it is.
  criteria.push_back(
      at_least("metacentric_height", "metacentre above centre of mass, mm", state.metacentric_height_mm, 1e-4 * diagonal));
  criteria.push_back(
      at_most("settled_tilt", "largest tilt at rest after tilted releases, rad", state.settled_tilt_rad, limits.settled_tilt_rad));
  return verdict;
}

}  // namespace rayrep
