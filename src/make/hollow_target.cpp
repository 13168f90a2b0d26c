#include <Eigen/Geometry>
#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>
#include <optional>
#include <sstream>
#include <utility>

#include "base/text.h"
#include "make/hollow_detail.h"
#include "rayrep/base/error.h"
#include "rayrep/make/hollow.h"
#include "rayrep/rays/inner_domain.h"

namespace rayrep {
namespace {

using detail::Body;
using detail::require;

std::string shown(double value) {
  std::ostringstream text;
  text.precision(5);
  text << value;
  return text.str();
}

std::string shown(double value, MomentIndex number) {
  return shown(value) + (number == M1 ? " g" : number <= MZ ? " mm" : " g mm2");
}

std::optional<double> wanted(const InertialTargets& targets, MomentIndex number) {
  return targets[static_cast<std::size_t>(number)];
}

/// The coordinates of the centre of mass without which an entry of the inertia tensor is not linear: for Ixx y and z, for Ixy x or
/// y. Empty when those that are wanted will do.
std::string missing_for(MomentIndex number, const InertialTargets& targets) {
  const auto has = [&](int axis) { return wanted(targets, static_cast<MomentIndex>(MX + axis)).has_value(); };
  const auto name = [](int axis) { return std::string(1, "xyz"[axis]); };
  if (number < MXX) return "";
  if (number <= MZZ) {
    const int a = (number - MXX + 1) % 3;
    const int b = (number - MXX + 2) % 3;
    if (has(a) && has(b)) return "";
    return name(std::min(a, b)) + " and " + name(std::max(a, b));
  }
  const int a = number == MYZ ? 1 : 0;
  const int b = number == MXY ? 1 : 2;
  if (has(a) || has(b)) return "";
  return name(a) + " or " + name(b);
}

void require_centre_for(MomentIndex number, const InertialTargets& targets) {
  const std::string missing = missing_for(number, targets);
  require(missing.empty(), std::string("Inertia targets need the centre of mass: ") + inertial_name(number) +
                               " is about the centre of mass and can be met only with its coordinates " + missing +
                               " given (--com).");
}

void check(const TargetOptions& options) {
  detail::check_options(options.hollow);
  require(options.hollow.solver == Solver::quadric, "Targets are met by the quadric solver only.");
  const InertialTargets& targets = options.wanted;
  require(std::any_of(targets.begin(), targets.end(), [](const auto& w) { return w.has_value(); }),
          "Give at least one number to be met: --mass, --com or --inertia.");
  for (int k = M1; k <= MXZ; ++k) {
    const auto number = static_cast<MomentIndex>(k);
    if (!wanted(targets, number)) continue;
    require(std::isfinite(*wanted(targets, number)), std::string("The wanted ") + inertial_name(number) + " must be finite.");
    if (number == M1 || (number >= MXX && number <= MZZ))
      require(*wanted(targets, number) > 0, std::string("The wanted ") + inertial_name(number) + " must be positive; it is " +
                                                shown(*wanted(targets, number)) + ".");
    require_centre_for(number, targets);
  }
  Eigen::Matrix3d inertia = Eigen::Matrix3d::Zero();
  if (wanted(targets, MXX) && wanted(targets, MYY) && wanted(targets, MZZ)) {
    inertia.diagonal() << *wanted(targets, MXX), *wanted(targets, MYY), *wanted(targets, MZZ);
    // The diagonal alone must keep the rule, and so must all six together.
    bool physical = is_physical(inertia);
    if (wanted(targets, MXY) && wanted(targets, MYZ) && wanted(targets, MXZ)) {
      inertia(0, 1) = inertia(1, 0) = *wanted(targets, MXY);
      inertia(1, 2) = inertia(2, 1) = *wanted(targets, MYZ);
      inertia(0, 2) = inertia(2, 0) = *wanted(targets, MXZ);
      physical = physical && is_physical(inertia);
    }
    require(physical,
            "No body has this inertia: the tensor must be positive definite and no moment larger than the sum of the other two.");
  }
  for (const TargetGoal::Wish& wish : options.order) {
    require(wish.number == M1 || wish.number >= MXX || wanted(targets, M1).has_value(),
            std::string("To minimise ") + inertial_name(wish.number) + " the mass must be given (--mass): a ratio of two free " +
                "numbers is not linear.");
    require_centre_for(wish.number, targets);
  }
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

bool can_be_met(const TargetGoal::Setup& setup, const RayIntegrals& rays, const Moments& shell) {
  const TargetGoal goal(setup);
  if (goal.determined()) return nearest_attainable(goal, rays, shell, 1e-7).attainable;
  return solve_target(setup, rays, shell).solution.converged;
}

/// An inner domain for another wall, at a resolution that is enough for advice.
RayRep coarse_domain(const Body& body, double wall_mm, double spacing_mm, const Progress& progress) {
  InnerDomainOptions options;
  options.wall_mm = wall_mm;
  options.ray_spacing_mm = options.field_spacing_mm = spacing_mm;
  Progress quiet;
  quiet.cancelled = progress.cancelled;
  return inner_domain(body.surface, options, quiet).rays;
}

/// A little less than the thickest wall with which the numbers can be met; none if not even a wall of 0.2 mm will do.
std::optional<double> wall_that_helps(const Body& body, const TargetGoal::Setup& setup, double wall_mm, const Progress& progress) {
  const double spacing = std::max(body.inner.rays.grid.spacing_mm, body.size_mm / 120);
  const auto will_do = [&](double wall) {
    const RayIntegrals rays(coarse_domain(body, wall, spacing, progress));
    return rays.intervals() > 0 && can_be_met(setup, rays, body.solid - rays.full());
  };
  double thick = wall_mm;
  double thin = std::max(0.2, 0.5 * wall_mm);
  while (thin < thick && !will_do(thin)) thick = std::exchange(thin, std::max(0.2, 0.5 * thin));
  if (!(thin < thick)) return std::nullopt;
  while (thick > 1.05 * thin) {
    const double middle = 0.5 * (thin + thick);
    (will_do(middle) ? thin : thick) = middle;
  }
  return std::max(0.2, 0.97 * thin);  // at the very edge there is no room to correct the mesh
}

/// Says why the numbers cannot be met, how near they can be met, and what would help.
[[noreturn]] void throw_unattainable(const Body& body, const TargetGoal::Setup& setup, double wall_mm, const Progress& progress) {
  const double rho = setup.density_g_cm3 * 1e-3;
  std::string text;
  std::string others;
  const double shell_g = rho * body.shell[M1];
  const double solid_g = rho * body.solid[M1];
  const std::optional<double> mass = wanted(setup.wanted, M1);
  if (mass && *mass < shell_g) {
    text = "The shell alone weighs " + shown(shell_g) + " g, more than the wanted " + shown(*mass) + " g.";
    others = " A material lighter than " + number(setup.density_g_cm3 * *mass / shell_g, 3) +
             " g/cm3 (--density) would give that mass some room.";
  } else if (mass && *mass > solid_g) {
    text = "Even completely solid it weighs only " + shown(solid_g) + " g, less than the wanted " + shown(*mass) + " g.";
    others = " It takes a material heavier than " + number(setup.density_g_cm3 * *mass / solid_g, 3) + " g/cm3 (--density).";
  } else {
    text = "These numbers cannot be met together with a wall of " + number(wall_mm, 2) + " mm.";
  }

  const NearestSolution nearest = nearest_attainable(TargetGoal(setup), *body.integrals, body.shell, 1e-9);
  text += " The nearest any interior comes (least squares of mass, static moments and inertia) is:";
  const char* separator = " ";
  for (const InertialDeviation& d :
       inertial_deviations(setup.wanted, in_mesh_frame(nearest.moments, body.to_working, setup.density_g_cm3), setup.length_mm)) {
    text += separator + std::string(inertial_name(d.number)) + " " + shown(d.found, d.number);
    if (d.relative > 1e-4) text += " instead of " + shown(d.wanted, d.number);
    separator = ", ";
  }
  text += "." + others;

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
  if (count > 0) text += " All the others can be met without " + without + ".";

  std::vector<std::string> remedies;
  if (!mass || *mass <= solid_g) {
    if (const auto wall = wall_that_helps(body, setup, wall_mm, progress)) {
      const std::string rounded = number(std::floor(*wall * 100) / 100, 2);
      text += " They can be met with a wall of about " + rounded + " mm or thinner (--wall).";
      remedies.push_back("--wall " + rounded);
    } else {
      text += " No wall down to 0.2 mm makes them possible.";
    }
  }
  throw Error(ErrorCode::goal, text, std::move(remedies));
}

/// @param up  in the working frame
TargetGoal::Setup setup_for(const TargetOptions& options, const Body& body, const Eigen::Vector3d& up) {
  TargetGoal::Setup setup;
  setup.wanted = options.wanted;
  setup.density_g_cm3 = options.hollow.density_g_cm3;
  setup.order = options.order;
  setup.axes = body.to_working.linear();
  setup.up = up;
  setup.volume_mm3 = body.solid[M1];
  setup.length_mm = body.diagonal_mm;
  return setup;
}

/// Solves and meshes one body, and notes what the dual proves of it.
/// @param correction  see solve_as_built: to begin with, and what it has become
void build(Body& body, const TargetSolution& exact, const TargetGoal::Setup& setup, const HollowOptions& common,
           TargetResult& result, Moments& delivered, Moments& correction, const Progress& progress) {
  double least = std::numeric_limits<double>::infinity();
  const auto error = [&](const Moments& s) {
    const double e = largest_deviation(setup.wanted, in_mesh_frame(s, body.to_working, setup.density_g_cm3), setup.length_mm);
    if (e < least) {
      least = e;
      delivered = s;
    }
    return e;
  };
  const TargetGoal& goal = exact.goal;
  InteriorSolver::Setup solver;
  solver.scale = {setup.volume_mm3, setup.length_mm};
  solver.warm.multipliers = exact.solution.multipliers;
  solver.options = common.solve;
  correction = detail::solve_as_built(body, InteriorSolver(goal, body.inner.rays, *body.integrals, solver), common, error,
                                      result.hollow, progress, correction);

  // The Lagrangian with the first objective alone bounds it from below, whatever the multipliers.
  const Moments constant = body.shell + correction;
  QuadricOptions warm;
  warm.multipliers = result.hollow.solve.multipliers;
  const QuadricSolution last = solve_quadric(goal, *body.integrals, constant, warm);
  const Moments& f = goal.first_gradient();
  const Moments q = f + goal.constraint_jacobian(constant).transpose() * last.multipliers;
  const double bound = last.multipliers.dot(goal.constraint_values(Moments::Zero())) + q.dot(constant + body.integrals->moments(q));
  result.hollow.duality_gap = (last.objective - last.lower_bound) / std::abs(last.lower_bound);
  result.wall_mm = common.wall_mm;
  result.first = goal.first();
  if (!result.first) return;
  const MomentIndex number = result.first->number;
  const double rho = setup.density_g_cm3 * 1e-3;
  // From f_0 back to g, mm and g mm2.
  double unit = rho * setup.volume_mm3;
  if (number >= MX) unit *= setup.length_mm;
  if (number >= MX && number <= MZ) unit /= *wanted(setup.wanted, M1);
  if (number >= MXX) unit *= setup.length_mm;
  if (result.first->largest) unit = -unit;
  const double from = number >= MX && number <= MZ ? result.origin_mm[number - MX] : 0;
  result.first_found = from + unit * f.dot(last.moments);
  result.first_bound = from + unit * bound;
}

[[noreturn]] void throw_stalled() {
  throw Error(ErrorCode::solver,
              "The solver stopped before it converged, and did not prove that the numbers cannot be met: they are probably at the "
              "very edge of what is possible. Try a thinner wall (--wall), another resolution (--resolution) or another order "
              "(--minimise).");
}

/// Along which axis of the working frame a switching function changes most over the inner domain: the largest diagonal entry of the
/// integral of grad(q.phi) grad(q.phi)^T. Rays along that axis meet the cavity's surface most squarely. z unless another is clearly
/// better.
int best_ray_axis(const Moments& q, const Moments& domain) {
  Eigen::Matrix3d Q;  // grad = g + Q p
  Q << 2 * q[MXX], q[MXY], q[MXZ], q[MXY], 2 * q[MYY], q[MYZ], q[MXZ], q[MYZ], 2 * q[MZZ];
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

/// All ten numbers given: one is released, the mass, and taken as far down or up as the nine others allow; the wall is made thicker
/// until that is the wanted mass.
TargetResult thickest_wall(const Body& first, TargetGoal::Setup setup, const TargetOptions& options,
                           const Eigen::Vector3d& origin_mm, const Progress& progress) {
  const double rho = options.hollow.density_g_cm3 * 1e-3;
  const double mass = *wanted(options.wanted, M1);
  setup.wanted[M1].reset();

  struct Excess {
    double relative =
        std::numeric_limits<double>::infinity();  ///< by which the wanted mass is beyond the extreme one; negative within
    bool largest = false;
  };
  const auto excess = [&](double wall) {
    const RayIntegrals rays(coarse_domain(first, wall, first.inner.rays.grid.spacing_mm, progress));
    Excess found;
    if (rays.intervals() == 0) return found;
    double beyond[2];
    for (const bool largest : {false, true}) {
      setup.order = {{M1, largest}};
      const QuadricSolution solution = solve_target(setup, rays, first.solid - rays.full()).solution;
      if (!solution.converged) return found;
      beyond[largest] = (largest ? -1 : 1) * (rho * solution.moments[M1] / mass - 1);
    }
    found.largest = beyond[1] > beyond[0];
    found.relative = std::max(beyond[0], beyond[1]);
    return found;
  };
  double thin = options.hollow.wall_mm;
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

  // The mesh's mass differs a little from the rays': the secant method on the mesh.
  setup.order = {{M1, at_thin.largest}};
  const double sign = at_thin.largest ? -1 : 1;
  HollowOptions common = options.hollow;
  common.wall_mm = thin;
  constexpr int max_runs = 6;
  double slope = std::isfinite(at_thick.relative) && thick > thin ? (at_thick.relative - at_thin.relative) / (thick - thin)
                                                                  : -at_thin.relative / thin;
  double previous_wall = 0;
  double previous = 0;
  Moments correction = Moments::Zero();
  TargetResult best;
  best.hollow.as_built_error = std::numeric_limits<double>::infinity();
  for (int run = 0; run < max_runs; ++run) {
    progress.begin("domain");
    Body body(first.outer, first.to_working, common, progress);
    const TargetSolution exact = solve_target(setup, *body.integrals, body.shell);
    if (!exact.solution.converged) {
      if (run == 0) break;
      common.wall_mm = 0.5 * (common.wall_mm + previous_wall);  // too thick for these numbers
      continue;
    }
    TargetResult result;
    result.origin_mm = origin_mm;
    Moments delivered;
    build(body, exact, setup, common, result, delivered, correction, progress);
    const double found = sign * (rho * delivered[M1] / mass - 1);
    result.hollow.as_built_error = std::max(result.hollow.as_built_error, std::abs(found));
    result.first.reset();
    if (result.hollow.as_built_error < best.hollow.as_built_error) best = std::move(result);
    if (best.hollow.as_built_error <= common.as_built_tolerance) break;
    if (run > 0 && (found - previous) / (common.wall_mm - previous_wall) > 0)
      slope = (found - previous) / (common.wall_mm - previous_wall);
    previous = found;
    previous_wall = common.wall_mm;
    common.wall_mm = std::max(options.hollow.wall_mm, common.wall_mm - found / slope);
    if (common.wall_mm == previous_wall) break;
  }
  if (!std::isfinite(best.hollow.as_built_error)) throw_stalled();
  return best;
}

}  // namespace

TargetSolution solve_target(const TargetGoal::Setup& setup, const RayIntegrals& rays, const Moments& constant) {
  assert(!TargetGoal(setup).determined());
  std::vector<TargetGoal::Wish> inertia = setup.order;
  inertia.insert(inertia.end(), {{M1}, {MXX}, {MYY}});
  std::optional<TargetSolution> tried;
  for (const double weight : {1e-2, 3e-2, 1e-1, 3e-1, 1.0})
    for (const auto& order : {setup.order, inertia}) {
      TargetGoal::Setup attempt = setup;
      attempt.order = order;
      attempt.weight = weight;
      TargetGoal goal(attempt);
      const QuadricSolution solution = solve_quadric(goal, rays, constant);
      tried.emplace(TargetSolution{std::move(goal), solution});
      if (solution.converged || solution.infeasible) return *tried;
    }
  return *tried;
}

TargetResult hollow_target(const Mesh& solid, const TargetOptions& options, const Progress& progress) {
  const HollowOptions& common = options.hollow;
  check(options);
  progress.begin("domain");
  Mesh outer = common.as_stored ? common.as_stored(solid) : solid;
  TargetResult result;
  const Moments whole = mesh_moments(outer);
  for (int axis = 0; axis < 3; ++axis)
    result.origin_mm[axis] = wanted(options.wanted, static_cast<MomentIndex>(MX + axis)).value_or(whole[MX + axis] / whole[M1]);
  Eigen::Affine3d frame = working_frame(outer, common.up);
  frame.translation() = -(frame.linear() * result.origin_mm);
  std::optional<Body> body(std::in_place, std::move(outer), frame, common, progress);

  progress.begin("target");
  Eigen::Vector3d up = Eigen::Vector3d::UnitZ();
  TargetGoal::Setup setup = setup_for(options, *body, up);
  if (TargetGoal(setup).determined()) {
    if (!can_be_met(setup, *body->integrals, body->shell)) throw_unattainable(*body, setup, common.wall_mm, progress);
    return thickest_wall(*body, setup, options, result.origin_mm, progress);
  }
  TargetSolution exact = solve_target(setup, *body->integrals, body->shell);
  if (exact.solution.infeasible) throw_unattainable(*body, setup, common.wall_mm, progress);
  if (const int axis = best_ray_axis(exact.solution.q, body->integrals->full()); axis != 2) {
    // Where rays run along the cavity's surface, whole rays switch at once, and the mesh follows the rays badly.
    const Eigen::Matrix3d turn = turn_to_z(axis);
    frame = turn * frame;
    up = turn * up;
    outer = std::move(body->outer);
    body.emplace(std::move(outer), frame, common, progress);
    setup = setup_for(options, *body, up);
    exact = solve_target(setup, *body->integrals, body->shell);
    if (exact.solution.infeasible) throw_unattainable(*body, setup, common.wall_mm, progress);
  }
  if (!exact.solution.converged) throw_stalled();
  Moments delivered;
  Moments correction = Moments::Zero();
  build(*body, exact, setup, common, result, delivered, correction, progress);
  return result;
}

}  // namespace rayrep
