#include <Eigen/Geometry>
#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>
#include <optional>
#include <utility>

#include "base/text.h"
#include "make/plan.h"
#include "rayrep/base/error.h"
#include "rayrep/make/hollow.h"
#include "rayrep/rays/inner_domain.h"
#include "rayrep/solve/solve_target.h"

namespace rayrep::detail {
namespace {

std::string with_unit(double value, MomentIndex number) {
  return shown(value, 5) + (number == M1 ? " g" : number <= MZ ? " mm" : " g mm2");
}

std::optional<double> wanted(const InertialTargets& targets, MomentIndex number) {
  return targets[static_cast<std::size_t>(number)];
}

/// Mass properties in the axes of the mesh.
MassProperties in_mesh_frame(const Moments& working, const Eigen::Affine3d& to_working, double density_g_cm3) {
  MassProperties body = mass_properties(working, density_g_cm3);
  const Eigen::Matrix3d back = to_working.linear().transpose();
  body.centre_of_mass_mm = to_working.inverse() * body.centre_of_mass_mm;
  body.inertia_g_mm2 = back * body.inertia_g_mm2 * back.transpose();
  body.principal_axes = back * body.principal_axes;
  return body;
}

double largest_deviation(const InertialTargets& targets, const MassProperties& body, double length_mm) {
  double largest = 0;
  for (const InertialDeviation& d : inertial_deviations(targets, body, length_mm)) largest = std::max(largest, d.relative);
  return largest;
}

/// Of a body in the axes of the mesh: what TargetSpec::least_spin_ratio is about.
double spin_ratio(const TargetSpec& spec, const MassProperties& body) {
  return spin_state(body, body.centre_of_mass_mm, spec.up.normalized(), true).ratio_larger;
}

/// How far beyond its bounds a body is, as deviations are told.
double largest_excess(const TargetSpec& spec, const MassProperties& body, double length_mm) {
  double largest = 0;
  for (const InertialDeviation& d : inertial_deviations(spec.at_most, body, length_mm))
    if (d.found > d.wanted) largest = std::max(largest, d.relative);
  for (const InertialDeviation& d : inertial_deviations(spec.at_least, body, length_mm))
    if (d.found < d.wanted) largest = std::max(largest, d.relative);
  if (spec.least_spin_ratio) largest = std::max(largest, 1 - spin_ratio(spec, body) / *spec.least_spin_ratio);
  return largest;
}

bool can_be_met(const TargetGoal::Setup& setup, const RayIntegrals& rays, const Moments& shell) {
  const TargetGoal goal(setup);
  if (goal.determined()) return nearest_attainable(goal, rays, shell, 1e-7).attainable;
  return solve_target(setup, rays, shell).solution.converged;
}

/// The nearest any interior comes to the numbers wanted, whatever the bounds; empty where they can be met without these.
std::string nearest_words(const Body& body, TargetGoal::Setup setup) {
  setup.at_least = setup.at_most = {};
  setup.least_spin_ratio.reset();
  const TargetGoal goal(setup);
  if (goal.constraints() == 0) return {};
  const NearestSolution nearest = nearest_attainable(goal, *body.integrals, body.shell, 1e-9);
  if (nearest.attainable) return {};
  std::string text = " The nearest any interior comes (least squares of mass, static moments and inertia) is:";
  const char* separator = " ";
  for (const InertialDeviation& d :
       inertial_deviations(setup.wanted, in_mesh_frame(nearest.moments, body.to_working, setup.density_g_cm3), setup.length_mm)) {
    text += separator + std::string(inertial_name(d.number)) + " " + with_unit(d.found, d.number);
    if (d.relative > 1e-4) text += " instead of " + with_unit(d.wanted, d.number);
    separator = ", ";
  }
  return text + ".";
}

/// The largest spin-ratio with which the rest can be met, to 1e-4.
std::string largest_ratio_words(const Body& body, TargetGoal::Setup setup, double asked, const Progress& progress) {
  double met = 0;
  double missed = asked;
  while (missed - met > 1e-4 * asked) {
    progress.check();
    const double ratio = 0.5 * (met + missed);
    setup.least_spin_ratio = ratio;
    (can_be_met(setup, *body.integrals, body.shell) ? met : missed) = ratio;
  }
  return " The largest spin-ratio with these numbers is " + number(met, 4) + ".";
}

/// Says why the numbers cannot be met, how near they can be met, and which others could.
[[noreturn]] void throw_unattainable(const Body& body, const TargetGoal::Setup& setup, double wall_mm, const Progress& progress) {
  const double rho = setup.density_g_cm3 * 1e-3;
  std::string text;
  std::string others;
  const double shell_g = rho * body.shell[M1];
  const double heaviest_g = rho * (body.shell + body.integrals->full())[M1];
  const std::optional<double> mass = wanted(setup.wanted, M1);
  if (mass && *mass < shell_g) {
    text = (body.inner.rays.grid.weight < 1 ? "Sparse all through it weighs " : "The shell alone weighs ") + shown(shell_g, 5) +
           " g, more than the wanted " + shown(*mass, 5) + " g.";
    others = " A material lighter than " + number(setup.density_g_cm3 * *mass / shell_g, 3) +
             " g/cm3 (--density) would give that mass some room.";
  } else if (mass && *mass > heaviest_g) {
    text = (body.inner.rays.grid.weight > 1 ? "Even with a core that takes all the room it weighs only "
                                            : "Even completely solid it weighs only ") +
           shown(heaviest_g, 5) + " g, less than the wanted " + shown(*mass, 5) + " g.";
    others = " It takes a material heavier than " + number(setup.density_g_cm3 * *mass / heaviest_g, 3) + " g/cm3 (--density).";
  } else {
    text = "These numbers cannot be met together with a wall of " + number(wall_mm, 2) + " mm.";
  }

  text += nearest_words(body, setup) + others;

  std::string without;
  int count = 0;
  for (int k = M1; k <= MXZ; ++k) {
    const auto left_out = static_cast<MomentIndex>(k);
    TargetGoal::Setup fewer = setup;
    fewer.wanted[static_cast<std::size_t>(k)].reset();
    const auto needed = [&](int other) {
      const auto number = static_cast<MomentIndex>(other);
      return wanted(fewer.wanted, number) && !missing_for(number, fewer.wanted).empty();
    };
    bool valid = wanted(setup.wanted, left_out).has_value();
    for (int other = MXX; other <= MXZ; ++other) valid = valid && !needed(other);
    if (!valid || TargetGoal(fewer).constraints() == 0) continue;
    progress.check();
    if (!can_be_met(fewer, *body.integrals, body.shell)) continue;
    without += (count++ ? ", or without " : "") + std::string(inertial_name(left_out));
  }
  for (const auto& [bounds, words] :
       {std::pair(&TargetGoal::Setup::at_least, "at least"), {&TargetGoal::Setup::at_most, "at most"}})
    for (int k = M1; k <= MXZ; ++k) {
      TargetGoal::Setup fewer = setup;
      std::optional<double>& bound = (fewer.*bounds)[static_cast<std::size_t>(k)];
      if (!bound) continue;
      bound.reset();
      progress.check();
      if (!can_be_met(fewer, *body.integrals, body.shell)) continue;
      without += (count++ ? ", or without " : "") + std::string(inertial_name(static_cast<MomentIndex>(k))) + " " + words;
    }
  if (setup.least_spin_ratio) {
    TargetGoal::Setup fewer = setup;
    fewer.least_spin_ratio.reset();
    progress.check();
    if (can_be_met(fewer, *body.integrals, body.shell)) {
      without += (count++ ? ", or without " : "") + std::string("spin-ratio at least");
      text += largest_ratio_words(body, fewer, *setup.least_spin_ratio, progress);
    }
  }
  if (count > 0) text += " All the others can be met without " + without + ".";

  throw Error(ErrorCode::goal, text);
}

/// A target on one body.
struct TargetProblem {
  TargetGoal::Setup setup;
  Eigen::Vector3d origin_mm;  ///< of the working frame, in the frame given
};

/// @param up         in the working frame
/// @param origin_mm  of the working frame, in the frame given
TargetGoal::Setup setup_for(const TargetSpec& spec, const Body& body, const Eigen::Vector3d& up, const Eigen::Vector3d& origin_mm) {
  TargetGoal::Setup setup;
  setup.wanted = spec.wanted;
  setup.at_least = spec.at_least;
  setup.at_most = spec.at_most;
  for (int axis = 0; axis < 3; ++axis)
    for (InertialTargets* bounds : {&setup.at_least, &setup.at_most})
      if (std::optional<double>& bound = (*bounds)[static_cast<std::size_t>(MX + axis)]) *bound -= origin_mm[axis];
  setup.density_g_cm3 = spec.print.density_g_cm3;
  setup.order = spec.order;
  setup.least_spin_ratio = spec.least_spin_ratio;
  setup.axes = body.to_working.linear();
  setup.up = up;
  setup.volume_mm3 = body.solid[M1];
  setup.length_mm = body.diagonal_mm;
  return setup;
}

/// What the dual proves of a target once it is built.
void prove(const TargetProblem& problem, const TargetGoal& goal, const Plan& plan, const Moments& constant, HollowResult& result) {
  const TargetGoal::Setup& setup = problem.setup;
  const RayIntegrals& integrals = *plan.body->integrals;
  // The Lagrangian with the first objective alone bounds it from below, whatever the multipliers. theory.md (35c)
  QuadricOptions warm;
  if (!goal.cone) warm.multipliers = result.solve.multipliers;
  const QuadricSolution last = solve_quadric(goal, integrals, constant, warm);
  const Moments& f = goal.first_gradient();
  const Goal rows = with_cuts(goal, last.cuts);
  const Moments q = f + rows.J.transpose() * last.multipliers;
  const double bound = last.multipliers.dot(rows.c_0) + q.dot(constant) + integrals.least(q, last.price);
  result.duality_gap = (last.objective - last.lower_bound) / std::abs(last.lower_bound);
  result.proof_figures = {{.name = "duality_gap", .words = "", .value = *result.duality_gap},
                          {.name = "wall_mm", .words = "", .unit = Unit::mm, .value = result.wall_mm}};
  if (!goal.first()) return;
  HollowResult::Extreme extreme{*goal.first()};
  const MomentIndex number = extreme.wish.number;
  const double rho = setup.density_g_cm3 * 1e-3;
  // From f_0 back to g, mm and g mm2.
  double unit = rho * setup.volume_mm3;
  if (number >= MX) unit *= setup.length_mm;
  if (number >= MX && number <= MZ) unit /= *wanted(setup.wanted, M1);
  if (number >= MXX) unit *= setup.length_mm;
  if (extreme.wish.largest) unit = -unit;
  const double from = number >= MX && number <= MZ ? problem.origin_mm[number - MX] : 0;
  extreme.found = from + unit * f.dot(last.moments);
  extreme.bound = from + unit * bound;
  // A bound that was asked for is one, too.
  const InertialTargets& asked =
      extreme.wish.largest ? std::get<TargetSpec>(plan.spec).at_most : std::get<TargetSpec>(plan.spec).at_least;
  if (const std::optional<double> limit = wanted(asked, number))
    extreme.bound = extreme.wish.largest ? std::min(extreme.bound, *limit) : std::max(extreme.bound, *limit);
  result.extreme = extreme;
  const char* sense = extreme.wish.largest ? "largest" : "smallest";
  result.proof = {"the " + std::string(sense) + " " + inertial_name(number) + " that these rays allow with these numbers is " +
                  shown(extreme.bound, 8) + " (proven by duality); here it is " + shown(extreme.found, 8)};
  result.proof_figures.push_back({.name = "first",
                                  .words = "",
                                  .value = Record{{"number", std::string(inertial_name(number))},
                                                  {"sense", std::string(sense)},
                                                  {"value", extreme.found},
                                                  {"bound", extreme.bound}}});
}

/// The plan of one target on one body, given its solution.
Plan plan_of(std::shared_ptr<Body> body, const TargetSolution& exact, const TargetProblem& problem, const TargetSpec& spec,
             const HollowOptions& options) {
  const TargetGoal::Setup& setup = problem.setup;
  Plan plan;
  plan.body = std::move(body);
  plan.goal = exact.goal;
  plan.spec = spec;
  plan.error = [setup, spec, to_working = plan.body->to_working](const Moments& s) {
    const MassProperties found = in_mesh_frame(s, to_working, setup.density_g_cm3);
    return std::max(largest_deviation(setup.wanted, found, setup.length_mm), largest_excess(spec, found, setup.length_mm));
  };
  plan.setup.scale = {setup.volume_mm3, setup.length_mm};
  plan.setup.warm.multipliers = exact.solution.multipliers;
  if (!exact.solution.cuts.empty()) plan.setup.warm.cut_angle_rad = exact.solution.cut_angle_rad;
  plan.setup.options = options.solve;
  plan.prove = [problem, goal = exact.goal](const Plan& p, const Moments& constant, HollowResult& result) {
    prove(problem, goal, p, constant, result);
  };
  return plan;
}

[[noreturn]] void throw_stalled() {
  throw Error(ErrorCode::solver,
              "The solver stopped before it converged, and did not prove that the numbers cannot be met: they are probably at the "
              "very edge of what is possible. Try a thinner wall (--wall), another resolution (--resolution) or another order "
              "(--minimise).");
}

/// Along which axis of the working frame a switching function changes most over the inner domain: the largest diagonal entry of the
/// integral of grad(q.phi) grad(q.phi)^T. Rays along that axis meet the cavity's surface most squarely. z unless another is clearly
/// better. theory.md (36)
int best_ray_axis(const Moments& q, const Moments& domain) {
  const Eigen::Matrix3d Q = quadric_hessian(q);  // grad = g + Q p
  Eigen::Matrix3d second;
  second << domain[MXX], domain[MXY], domain[MXZ], domain[MXY], domain[MYY], domain[MYZ], domain[MXZ], domain[MYZ], domain[MZZ];
  const Eigen::Vector3d g = q.segment<3>(MX);
  const Eigen::Vector3d mixed = Q * domain.segment<3>(MX);
  const Eigen::Vector3d change = domain[M1] * g.cwiseAbs2() + 2 * g.cwiseProduct(mixed) + (Q * second * Q).diagonal();
  int axis = 2;
  return change.maxCoeff(&axis) > 2 * change.z() ? axis : 2;
}

/// A turn that takes an axis to z and keeps the order of the axes.
Eigen::Matrix3d turn_to_z(int axis) {
  Eigen::Matrix3d turn = Eigen::Matrix3d::Zero();
  for (int row = 0; row < 3; ++row) turn(row, (axis + 1 + row) % 3) = 1;
  return turn;
}

/// By how much the wanted mass is beyond the extreme one that the other nine numbers allow, relative; negative within.
struct Excess {
  double relative = std::numeric_limits<double>::infinity();
  bool largest = false;
};

/// Walls on either side of the one at which the wanted mass is the extreme one.
struct WallBracket {
  double thin = 0;
  double thick = 0;
  Excess at_thin;
  Excess at_thick;
};

/// On the rays.
WallBracket bracket_wall(const Body& first, TargetGoal::Setup setup, double mass, double wall_mm, const Progress& progress) {
  const double rho = setup.density_g_cm3 * 1e-3;
  const auto excess = [&](double wall) {
    const RayIntegrals rays(first.inner_with(wall, first.inner.rays.grid.spacing_mm, progress));
    Excess found;
    if (rays.intervals() == 0) return found;
    double beyond[2];
    for (const bool largest : {false, true}) {
      setup.order = {{M1, largest}};
      const QuadricSolution solution = solve_target(setup, rays, first.lightest(rays)).solution;
      if (!solution.converged) return found;
      beyond[largest] = (largest ? -1 : 1) * (rho * solution.moments[M1] / mass - 1);
    }
    found.largest = beyond[1] > beyond[0];
    found.relative = std::max(beyond[0], beyond[1]);
    return found;
  };
  double thin = wall_mm;
  double thick = deepest_point(first.surface, progress).distance_mm;
  Excess at_thin = excess(thin);
  Excess at_thick;
  if (at_thin.relative > 0) throw_stalled();
  while (thick - thin > 1e-3 * thin && at_thin.relative < -1e-4) {
    progress.check();
    const double falsi = thin + (thick - thin) * at_thin.relative / (at_thin.relative - at_thick.relative);
    const double margin = 0.1 * (thick - thin);
    const double wall = std::isfinite(at_thick.relative) ? std::clamp(falsi, thin + margin, thick - margin) : 0.5 * (thin + thick);
    const Excess at = excess(wall);
    (at.relative > 0 ? thick : thin) = wall;
    (at.relative > 0 ? at_thick : at_thin) = at;
  }
  return {thin, thick, at_thin, at_thick};
}

/// All ten numbers given: one is released, the mass, and taken as far down or up as the nine others allow; the wall is made thicker
/// until that is the wanted mass. theory.md (37)
HollowResult thickest_wall(const Body& first, TargetProblem problem, const TargetSpec& wanted_spec, const HollowOptions& options,
                           const Progress& progress) {
  TargetGoal::Setup& setup = problem.setup;
  TargetSpec spec = wanted_spec;
  const double rho = setup.density_g_cm3 * 1e-3;
  const double mass = *wanted(spec.wanted, M1);
  setup.wanted[M1].reset();
  const WallBracket bracket = bracket_wall(first, setup, mass, spec.print.wall_mm, progress);

  // The mesh's mass differs a little from the rays': the secant method on the mesh.
  setup.order = {{M1, bracket.at_thin.largest}};
  const double sign = bracket.at_thin.largest ? -1 : 1;
  double& wall = spec.print.wall_mm;
  wall = bracket.thin;
  constexpr int max_runs = 6;
  double slope = std::isfinite(bracket.at_thick.relative) && bracket.thick > wall
                     ? (bracket.at_thick.relative - bracket.at_thin.relative) / (bracket.thick - wall)
                     : -bracket.at_thin.relative / wall;
  double previous_wall = 0;
  double previous = 0;
  Moments correction = Moments::Zero();
  HollowResult best;
  best.as_built_error = std::numeric_limits<double>::infinity();
  for (int run = 0; run < max_runs; ++run) {
    progress.begin("domain");
    auto body = std::make_shared<Body>(first.outer, first.to_working, discretisation(spec.print, options), progress);
    const TargetSolution exact = solve_target(setup, *body->integrals, body->shell);
    if (!exact.solution.converged) {
      if (run == 0) break;
      wall = 0.5 * (wall + previous_wall);  // too thick for these numbers
      continue;
    }
    Plan plan = plan_of(std::move(body), exact, problem, spec, options);
    plan.start = correction;
    Moments delivered;
    double least = std::numeric_limits<double>::infinity();
    plan.error = [&, of_the_others = plan.error](const Moments& s) {
      const double e = of_the_others(s);
      if (e < least) {
        least = e;
        delivered = s;
      }
      return e;
    };
    HollowResult result = carry_out(plan, options, progress, &correction);
    const double found = sign * (rho * delivered[M1] / mass - 1);
    result.as_built_error = std::max(result.as_built_error, std::abs(found));
    if (result.as_built_error < best.as_built_error) best = std::move(result);
    if (best.as_built_error <= options.as_built_tolerance) break;
    if (run > 0 && (found - previous) / (wall - previous_wall) > 0) slope = (found - previous) / (wall - previous_wall);
    previous = found;
    previous_wall = wall;
    wall = std::max(wanted_spec.print.wall_mm, wall - found / slope);
    if (wall == previous_wall) break;
  }
  if (!std::isfinite(best.as_built_error)) throw_stalled();
  best.extreme.reset();
  best.spec = wanted_spec;
  best.proof.clear();
  if (best.wall_mm > wanted_spec.print.wall_mm)
    best.proof = {"all ten numbers were given: they allow a wall of " + number(best.wall_mm, 4) +
                  " mm, and that is what the cavity has"};
  return best;
}

/// The body with the wanted centre of mass, as far as given, at the origin.
struct TargetBody {
  std::shared_ptr<Body> body;
  TargetProblem problem;
};

TargetBody body_for(const Mesh& solid, const TargetSpec& spec, const HollowOptions& options, const Progress& progress) {
  progress.begin("domain");
  Mesh outer = stored(solid, options);
  TargetBody result;
  const Moments whole = mesh_moments(outer);
  Eigen::Vector3d& origin_mm = result.problem.origin_mm;
  for (int axis = 0; axis < 3; ++axis)
    origin_mm[axis] = wanted(spec.wanted, static_cast<MomentIndex>(MX + axis)).value_or(whole[MX + axis] / whole[M1]);
  Eigen::Affine3d frame = working_frame(outer, spec.up);
  frame.translation() = -(frame.linear() * origin_mm);
  result.body = resolved_body(std::move(outer), frame, discretisation(spec.print, options), progress);
  progress.begin("target");
  result.problem.setup = setup_for(spec, *result.body, Eigen::Vector3d::UnitZ(), origin_mm);
  return result;
}

void require_quadric(const HollowOptions& options) {
  if (options.solver != Solver::quadric) throw Error(ErrorCode::usage, "Targets are met by the quadric solver only.");
}

bool all_ten(const TargetSpec& spec) {
  return std::all_of(spec.wanted.begin(), spec.wanted.end(), [](const auto& w) { return w.has_value(); });
}

}  // namespace

std::optional<HollowResult> hollow_determined(const Mesh& solid, const TargetSpec& spec, const HollowOptions& options,
                                              const Progress& progress) {
  if (!all_ten(spec)) return std::nullopt;
  require_quadric(options);
  const TargetBody target = body_for(solid, spec, options, progress);
  const Body& body = *target.body;
  if (!can_be_met(target.problem.setup, *body.integrals, body.shell))
    throw_unattainable(body, target.problem.setup, spec.print.wall_mm, progress);
  return thickest_wall(body, target.problem, spec, options, progress);
}

Plan plan(const Mesh& solid, const TargetSpec& spec, const HollowOptions& options, const Progress& progress) {
  require_quadric(options);
  TargetBody target = body_for(solid, spec, options, progress);
  std::shared_ptr<Body>& body = target.body;
  TargetGoal::Setup& setup = target.problem.setup;
  if (TargetGoal(setup).determined())
    throw Error(ErrorCode::usage, "With all ten numbers given nothing is left to minimise: there is no one plan for that.");
  TargetSolution exact = solve_target(setup, *body->integrals, body->shell);
  if (exact.solution.infeasible) throw_unattainable(*body, setup, spec.print.wall_mm, progress);
  if (const int axis = best_ray_axis(exact.solution.q, body->integrals->full()); axis != 2) {
    // Where rays run along the cavity's surface, whole rays switch at once, and the mesh follows the rays badly.
    const Eigen::Matrix3d turn = turn_to_z(axis);
    const Eigen::Affine3d frame = turn * body->to_working;
    body = resolved_body(body->outer, frame, discretisation(spec.print, options), progress);
    setup = setup_for(spec, *body, turn * Eigen::Vector3d::UnitZ(), target.problem.origin_mm);
    exact = solve_target(setup, *body->integrals, body->shell);
    if (exact.solution.infeasible) throw_unattainable(*body, setup, spec.print.wall_mm, progress);
  }
  if (!exact.solution.converged) throw_stalled();
  return plan_of(std::move(body), exact, target.problem, spec, options);
}

}  // namespace rayrep::detail
