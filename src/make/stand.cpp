#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "base/text.h"
#include "make/plan.h"
#include "rayrep/base/error.h"
#include "rayrep/make/waterline.h"
#include "rayrep/mesh/clip.h"
#include "rayrep/physics/support_polygon.h"

namespace rayrep::detail {
namespace {

/// What a base is cut for: 3 degrees, the slope of a bad table.
constexpr double kSafeAngle = 3 * std::numbers::pi / 180;
/// What bounds the choice of a target.
struct Terms {
  InteriorNlp::Scale scale;
  std::optional<double> most_mm3;  ///< of material
};

/// Over a target, no heavier than allowed.
Goal goal_above(const Eigen::Vector2d& target, const Terms& terms) {
  Goal goal = stand_goal(target, terms.scale.volume_mm3, terms.scale.length_mm);
  return terms.most_mm3 ? with_at_most(std::move(goal), Moments::Unit(M1) / *terms.most_mm3, -1) : goal;
}

/// The lowest centre of mass above `target`; none if out of reach.
std::optional<Moments> lowest_above(const Body& body, const Eigen::Vector2d& target, const Terms& terms) {
  const QuadricSolution lowest = solve_quadric(goal_above(target, terms), *body.integrals, body.shell);
  if (!lowest.converged) return std::nullopt;
  return lowest.moments;
}

double smallest_tipping_angle(const SupportPolygon& polygon, const Moments& s) {
  const std::vector<double> angles = tipping_angles_rad(polygon, s.segment<3>(MX) / s[M1]);
  return *std::min_element(angles.begin(), angles.end());
}

/// The target where the smallest tipping angle is largest. The angle is a quasiconcave function of the target, since the attainable
/// centres of mass and those beyond a tipping angle are convex sets: a pattern search climbs to its top.
Eigen::Vector2d safest_target(const Body& body, const SupportPolygon& polygon, const Eigen::Vector2d& start, const Terms& terms,
                              const Progress& progress) {
  const auto angle_at = [&](const Eigen::Vector2d& target) {
    progress.check();
    const std::optional<Moments> s = lowest_above(body, target, terms);
    return s ? smallest_tipping_angle(polygon, *s) : -std::numeric_limits<double>::infinity();
  };
  Eigen::Vector2d best = start;
  double best_angle = angle_at(best);
  for (double step = 0.1 * std::sqrt(polygon.area_mm2); step > 1e-3 * std::sqrt(polygon.area_mm2);) {
    const double before = best_angle;
    const Eigen::Vector2d from = best;
    for (int n = 0; n < 8; ++n) {
      const double direction = n * std::numbers::pi / 4;
      const Eigen::Vector2d target = from + step * Eigen::Vector2d(std::cos(direction), std::sin(direction));
      if (const double angle = angle_at(target); angle > best_angle) {
        best_angle = angle;
        best = target;
      }
    }
    if (best_angle <= before) step *= 0.5;
  }
  return best;
}

/// The target in the working frame: the one of `spec`, or the safest point, moved to where it can be reached or is safest.
Eigen::Vector2d chosen_target(const Body& body, const SupportPolygon& polygon, const StandSpec& spec, const Terms& terms,
                              const Progress& progress) {
  Eigen::Vector2d target =
      spec.target_mm ? Eigen::Vector2d((body.to_working * *spec.target_mm).head<2>()) : polygon.safest_point_mm();
  progress.begin("target");
  // Half filled everywhere, no end is at its bound: a centre of mass with room on all sides.
  const Moments half = body.shell + 0.5 * ray_moments(body.inner.rays);
  const Eigen::Vector2d middle = half.segment<2>(MX) / half[M1];
  // A target at the edge of what these rays reach leaves no room to correct the mesh, which differs a little.
  constexpr double room = 0.05;
  const bool in_reach = lowest_above(body, target + room * (target - middle), terms).has_value();
  if (spec.objective == StandSpec::Objective::tip_angle || (!in_reach && !spec.target_mm)) {
    target = safest_target(body, polygon, in_reach ? target : middle, terms, progress);
    target += room * (middle - target);
  }
  return target;
}

/// Why a body with this centre of mass does not stand.
Error tips_over(const SupportPolygon& polygon, const Moments& s, double tolerance_mm, const StandSpec& spec) {
  const std::vector<double> distances = polygon.edge_distances_mm(s.segment<2>(MX) / s[M1]);
  const double beside_mm = -*std::min_element(distances.begin(), distances.end());
  const bool named = spec.target_mm && spec.objective == StandSpec::Objective::lowest;
  return {ErrorCode::goal,
          std::string(named ? "It would tip over: the target lies "
                            : "It cannot stand: as near to its base as the centre of mass can be brought it lies ") +
              number(beside_mm, 2) + " mm beside the base, which is what is within " + number(tolerance_mm, 3) +
              " mm of the lowest point (" + number(polygon.area_mm2, 1) + " mm2)."};
}

void prove(const Plan& plan, const Moments& constant, HollowResult& result) {
  // For every s that meets the constraints, (c_z(s) - c_z) m(s) / (L m) >= q.s + mu.c_0 >= min over all interiors of that.
  // theory.md (27d), (49), (70)
  const Moments& q = result.q;
  const RayIntegrals& rays = *plan.body->integrals;
  const double mass = constant[M1] + rays.priced(q, result.price).pass.moments[M1];
  const Eigen::VectorXd& mu = result.solve.multipliers;
  const double of_bounds = plan.goal.at_most > 0 ? mu.dot(plan.goal.c_0) : 0;
  const double least = of_bounds + q.dot(constant) + rays.least(q, result.price);
  result.duality_gap = std::max(0.0, -least) * mass / constant[M1] / std::abs(result.solve.objective);
  result.proof_figures = {{.name = "duality_gap", .words = "", .value = *result.duality_gap}};
  result.proof = {"centre of mass within " + scientific(std::max(*result.duality_gap, 1e-9)) +
                  " of the lowest possible above the target on these rays (proven by duality)"};
}

/// A plan, and how safely the body would stand.
struct Standing {
  Plan plan;
  double tipping_angle_rad = 0;
};

/// Of the mesh as it is. @throws Error{goal}
Standing standing(const Mesh& solid, const StandSpec& spec, const HollowOptions& options, const Progress& progress) {
  Standing result;
  Plan& plan = result.plan;
  // What touches the ground is known before the inside is.
  double tolerance = 0;
  SupportPolygon polygon;
  Discretisation discretised = discretisation(spec.print, options);
  discretised.require = [&](const Mesh& hull) {
    tolerance = spec.contact_tolerance_mm.value_or(contact_tolerance_mm(bounding_box(hull).sizes().z()));
    polygon = support_polygon(hull, tolerance);
    if (polygon.corners_mm.size() < 3)
      throw Error(ErrorCode::goal, std::string("It cannot stand: it touches the ground in ") +
                                       (polygon.corners_mm.size() < 2 ? "a point" : "an edge") + " only (within " +
                                       number(tolerance, 3) + " mm of its lowest point).");
  };
  plan.body = upright_body(solid, spec.up, discretised, options, progress);
  const Body& body = *plan.body;

  const InteriorNlp::Scale scale{body.solid[M1], body.diagonal_mm};
  Terms terms{scale, std::nullopt};
  const double g_mm3 = 1e-3 * spec.print.density_g_cm3;
  if (spec.most_mass_g) terms.most_mm3 = *spec.most_mass_g / g_mm3;
  if (terms.most_mm3 && body.shell[M1] > *terms.most_mm3)
    throw Error(ErrorCode::goal, "It cannot be so light: with nothing but its shell it weighs " +
                                     number(g_mm3 * body.shell[M1], 2) + " g, and it shall weigh no more than " +
                                     number(*spec.most_mass_g, 2) + " g.");
  const Eigen::Vector2d target = chosen_target(body, polygon, spec, terms, progress);
  StandSpec found = spec;
  found.target_mm = body.to_working.inverse() * Eigen::Vector3d(target.x(), target.y(), 0);
  plan.spec = found;
  const std::optional<Moments> lowest = lowest_above(body, target, terms);
  if (!lowest)
    throw Error(ErrorCode::goal, "The centre of mass cannot be brought above the target: at the nearest any interior comes it is " +
                                     number(smallest_offset_mm(body.inner.rays, body.shell, std::nullopt, target), 3) +
                                     " mm beside it (horizontally)" +
                                     (terms.most_mm3 ? ", whatever it may weigh (--max-mass)." : ".") +
                                     scarce_words(body.inner.rays.grid));
  result.tipping_angle_rad = smallest_tipping_angle(polygon, *lowest);
  if (!(result.tipping_angle_rad > kSmallestTipping_rad)) throw tips_over(polygon, *lowest, tolerance, spec);
  plan.goal = goal_above(target, terms);
  plan.error = [target, terms](const Moments& s) {
    const double too_heavy = terms.most_mm3 ? s[M1] / *terms.most_mm3 - 1 : 0;
    return std::max(too_heavy, (s.segment<2>(MX) / s[M1] - target).norm() / terms.scale.length_mm);
  };
  plan.setup.solver = options.solver;
  plan.setup.scale = scale;
  plan.setup.options = options.solve;
  plan.setup.options.tolerance = std::max(options.solve.tolerance, 1e-7);
  plan.setup.options.barrier_target = 1e-9;
  plan.prove = prove;
  return result;
}

/// Cuts to try, from nothing to all that is allowed.
std::vector<double> cuts_mm(double most_mm) {
  constexpr int kSteps = 16;  // down to 1/256 of it
  std::vector<double> cuts{0};
  for (int n = kSteps; n >= 0; --n) cuts.push_back(most_mm * std::pow(2, -0.5 * n));
  return cuts;
}

/// The first of the cuts at which a body stands safely on few rays, taken that a larger cut is as good as a smaller one; the last
/// one where none does.
std::size_t least_cut(const std::vector<double>& cuts, const Mesh& solid, const StandSpec& spec, const HollowOptions& options,
                      const Progress& progress) {
  const HollowOptions few = on_few_rays(options);
  const Progress quiet{.stage = {}, .cancelled = progress.cancelled};
  const auto stands = [&](std::size_t n) {
    progress.check();
    try {
      return standing(flattened(solid, spec.up, cuts[n], quiet), spec, few, quiet).tipping_angle_rad >= kSafeAngle;
    } catch (const Error& error) {
      if (error.code() != ErrorCode::goal) throw;
      return false;
    }
  };
  // Down from the largest in growing steps, as what is allowed is often just enough, and then by halves.
  std::size_t known = cuts.size() - 1;
  std::size_t first = 1;
  for (std::size_t step = 1; known > first; step *= 2) {
    const std::size_t smaller = known - std::min(step, known - first);
    if (!stands(smaller)) {
      first = smaller + 1;
      break;
    }
    known = smaller;
  }
  while (first < known) {
    const std::size_t middle = (first + known) / 2;
    if (stands(middle))
      known = middle;
    else
      first = middle + 1;
  }
  return known;
}

}  // namespace

Mesh flattened(const Mesh& solid, const Eigen::Vector3d& up, double cut_mm, const Progress& progress) {
  if (cut_mm == 0) return solid;
  const Eigen::Vector3d normal = up.normalized();
  double lowest_mm = std::numeric_limits<double>::infinity();
  for (const Eigen::Vector3d& v : solid.vertices) lowest_mm = std::min(lowest_mm, normal.dot(v));
  return clipped(solid, {normal, lowest_mm + cut_mm}, progress);
}

Plan plan(const Mesh& solid, const StandSpec& spec, const HollowOptions& options, const Progress& progress) {
  if (spec.most_mass_g && options.solver != Solver::quadric)
    throw Error(ErrorCode::usage, "--max-mass is kept by the quadric solver only.");
  StandSpec as_it_is = spec;
  as_it_is.flatten_mm = 0;
  if (spec.flatten_mm == 0) return standing(solid, as_it_is, options, progress).plan;
  std::optional<Standing> whole;
  try {
    whole = standing(solid, as_it_is, options, progress);
  } catch (const Error& error) {
    if (error.code() != ErrorCode::goal) throw;
  }
  if (whole && whole->tipping_angle_rad >= kSafeAngle) return std::move(whole->plan);
  progress.begin("base");
  const std::vector<double> cuts = cuts_mm(spec.flatten_mm);
  std::string refusal;
  // What few rays promise all of them may miss.
  for (std::size_t n = least_cut(cuts, solid, as_it_is, options, progress); n < cuts.size(); ++n) {
    try {
      Standing cut = standing(flattened(solid, spec.up, cuts[n], progress), as_it_is, options, progress);
      if (whole && cut.tipping_angle_rad < kSafeAngle) continue;
      std::get<StandSpec>(cut.plan.spec).flatten_mm = cuts[n];
      return std::move(cut.plan);
    } catch (const Error& error) {
      if (error.code() != ErrorCode::goal) throw;
      refusal = error.what();
    }
  }
  if (whole) return std::move(whole->plan);
  throw Error(ErrorCode::goal,
              refusal + " That is with " + shown(spec.flatten_mm) + " mm cut off below, all that --flatten allows.");
}

}  // namespace rayrep::detail
