#include <algorithm>
#include <cmath>

#include "base/text.h"
#include "make/plan.h"
#include "rayrep/base/error.h"
#include "rayrep/make/waterline.h"

namespace rayrep::detail {
namespace {

/// best_waterline on as many rays as tell waterlines apart, and on all of them if that one cannot be met there.
std::optional<double> searched_waterline(const FloatProblem& problem, const Body& body, double reserve, const Progress& progress) {
  constexpr std::size_t enough = 15000;
  int step = 1;
  while (problem.inner.intervals.size() > 2 * enough * static_cast<std::size_t>(step * step)) ++step;
  if (step > 1) {
    const RayRep inner = problem.inner.thinned(step);
    const RayIntegrals integrals(inner);
    const FloatProblem coarse{problem.hull,        inner,
                              integrals,           body.lightest(integrals),
                              problem.fluid_g_cm3, problem.density_g_cm3,
                              problem.height_mm,   problem.diagonal_mm};
    const std::optional<double> best = best_waterline(coarse, reserve, progress);
    if (best && at_waterline(problem, *best).attainable) return best;
  }
  return best_waterline(problem, reserve, progress);
}

/// Fills in the waterline of `spec`, given or searched; a submerged body has none. @throws Error{usage}, Error{goal}
void find_waterline(const FloatProblem& problem, const Body& body, FloatSpec& spec, const Progress& progress) {
  if (is_submerged(spec)) {
    spec.submerged_fraction = 1;
    spec.submerged_volume_fraction.reset();
    return;
  }
  if (spec.submerged_fraction) spec.waterline_mm = *spec.submerged_fraction * body.height_mm;
  if (spec.submerged_volume_fraction)
    spec.waterline_mm =
        waterline_for_volume(body.hull, Eigen::Vector3d::UnitZ(), *spec.submerged_volume_fraction * mesh_moments(body.hull)[M1]);
  spec.submerged_fraction.reset();
  spec.submerged_volume_fraction.reset();
  if (!spec.waterline_mm) {
    spec.waterline_mm = searched_waterline(problem, body, spec.reserve, progress);
    if (!spec.waterline_mm)
      throw Error(ErrorCode::goal, why_no_waterline(problem, spec.reserve, progress) + scarce_words(problem.inner.grid));
    spec.waterline_searched = true;
  } else if (!(*spec.waterline_mm > 0 && *spec.waterline_mm < body.height_mm)) {
    throw Error(ErrorCode::usage, "The waterline must lie between the lowest and the highest point, 0 and " +
                                      number(body.height_mm, 2) + " mm; it is " + number(*spec.waterline_mm, 2) +
                                      " mm. A body that hovers wholly under water is --submerged 1.");
  }
}

void prove(const Plan& plan, const Moments& constant, HollowResult& result) {
  const double bound = solve_quadric(plan.goal, *plan.body->integrals, constant).lower_bound;
  result.duality_gap = (result.solve.objective - bound) / std::abs(bound);
  result.proof_figures = {{.name = "duality_gap", .words = "", .value = *result.duality_gap}};
  result.proof = {"centre of mass within " + scientific(std::max(std::abs(*result.duality_gap), 1e-9)) +
                  " of the lowest possible on these rays (proven by duality)"};
}

/// Sets goal and error to floating in this state of the water. @param volumes  displaced by one of material
void aim(Plan& plan, const Hydrostatics& water, double volumes) {
  const double material_mm3 = water.displaced_volume_mm3 / volumes;
  const Eigen::Vector2d centre = water.centre_of_buoyancy_mm.head<2>();
  const double diagonal_mm = plan.body->diagonal_mm;
  plan.goal = float_goal(material_mm3, centre, diagonal_mm);
  plan.error = [material_mm3, centre, diagonal_mm](const Moments& s) {
    const double offset = (s.segment<2>(MX) / s[M1] - centre).norm() / diagonal_mm;
    return std::max(std::abs(s[M1] / material_mm3 - 1), offset);
  };
}

/// What the interior has to do. @throws Error{goal} if none does
WaterlineState target_state(const FloatProblem& problem, const FloatSpec& spec) {
  const auto refuse = [&problem](const std::string& why) { throw Error(ErrorCode::goal, why + scarce_words(problem.inner.grid)); };
  if (is_submerged(spec)) {
    WaterlineState state = submerged(problem);
    if (const std::string why = why_not_submerged(problem, state); !why.empty()) refuse(why);
    return state;
  }
  WaterlineState state = at_waterline(problem, *spec.waterline_mm);
  if (!state.attainable || (!spec.waterline_searched && !comes_back(problem, state))) refuse(why_unattainable(problem, state));
  return state;
}

}  // namespace

Plan plan(const Mesh& solid, const FloatSpec& spec, const HollowOptions& options, const Progress& progress) {
  Plan plan;
  plan.body = upright_body(solid, spec.up, discretisation(spec.print, options), options, progress);
  const Body& body = *plan.body;
  const double density_g_cm3 = spec.print.density_g_cm3;
  const PreparedHull& hull = plan.body->prepared_hull();
  const FloatProblem problem{hull,          body.inner.rays, *body.integrals, body.shell, spec.fluid_g_cm3,
                             density_g_cm3, body.height_mm,  body.diagonal_mm};
  FloatSpec found = spec;
  progress.begin("waterline");
  find_waterline(problem, body, found, progress);
  plan.spec = found;
  const WaterlineState target = target_state(problem, found);

  const double volumes = density_g_cm3 / spec.fluid_g_cm3;
  aim(plan, target.water, volumes);
  plan.setup.solver = options.solver;
  plan.setup.scale = {target.water.displaced_volume_mm3 / volumes, body.diagonal_mm};
  plan.setup.options = options.solve;
  if (found.waterline_searched)
    plan.give_way = [hull, volumes](Plan& given, const Moments& printed) {
      const Eigen::Vector3d up = Eigen::Vector3d::UnitZ();
      const double waterline_mm = waterline_for_volume(hull, up, printed[M1] * volumes);
      std::get<FloatSpec>(given.spec).waterline_mm = waterline_mm;
      aim(given, hydrostatics(hull, {up, waterline_mm}), volumes);
    };
  plan.prove = prove;
  return plan;
}

}  // namespace rayrep::detail
