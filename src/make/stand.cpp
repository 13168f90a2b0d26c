#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "base/text.h"
#include "make/plan.h"
#include "rayrep/base/error.h"
#include "rayrep/make/waterline.h"
#include "rayrep/physics/support_polygon.h"

namespace rayrep::detail {
namespace {

/// The lowest centre of mass above `target`; none if out of reach.
std::optional<Moments> lowest_above(const Body& body, const Eigen::Vector2d& target, const InteriorNlp::Scale& scale) {
  const QuadricSolution lowest = solve_quadric(stand_goal(target, scale.volume_mm3, scale.length_mm), *body.integrals, body.shell);
  if (!lowest.converged) return std::nullopt;
  return lowest.moments;
}

/// The target where the smallest tipping angle is largest. The angle is a quasiconcave function of the target, since the attainable
/// centres of mass and those beyond a tipping angle are convex sets: a pattern search climbs to its top.
Eigen::Vector2d safest_target(const Body& body, const SupportPolygon& polygon, const Eigen::Vector2d& start,
                              const InteriorNlp::Scale& scale, const Progress& progress) {
  const auto angle_at = [&](const Eigen::Vector2d& target) {
    progress.check();
    const std::optional<Moments> s = lowest_above(body, target, scale);
    if (!s) return -std::numeric_limits<double>::infinity();
    const std::vector<double> angles = tipping_angles_rad(polygon, s->segment<3>(MX) / (*s)[M1]);
    return *std::min_element(angles.begin(), angles.end());
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
Eigen::Vector2d chosen_target(const Body& body, const SupportPolygon& polygon, const StandSpec& spec,
                              const InteriorNlp::Scale& scale, const Progress& progress) {
  Eigen::Vector2d target =
      spec.target_mm ? Eigen::Vector2d((body.to_working * *spec.target_mm).head<2>()) : polygon.safest_point_mm();
  progress.begin("target");
  // Half filled everywhere, no end is at its bound: a centre of mass with room on all sides.
  const Moments half = body.shell + 0.5 * ray_moments(body.inner.rays);
  const Eigen::Vector2d middle = half.segment<2>(MX) / half[M1];
  // A target at the edge of what these rays reach leaves no room to correct the mesh, which differs a little.
  constexpr double room = 0.05;
  const bool in_reach = lowest_above(body, target + room * (target - middle), scale).has_value();
  if (spec.objective == StandSpec::Objective::tip_angle || (!in_reach && !spec.target_mm)) {
    target = safest_target(body, polygon, in_reach ? target : middle, scale, progress);
    target += room * (middle - target);
  }
  return target;
}

void prove(const Plan& plan, const Moments& constant, HollowResult& result) {
  // For every s that meets the constraints, (c_z(s) - c_z) m(s) / (L m) = q.s >= min over all interiors of q.s. theory.md (27d)
  const Moments& q = result.q;
  const Moments s = constant + plan.body->integrals->moments(q);
  result.duality_gap = std::max(0.0, -q.dot(s)) * s[M1] / constant[M1] / std::abs(result.solve.objective);
  result.proof_figures = {{.name = "duality_gap", .words = "", .value = *result.duality_gap}};
  result.proof = {"centre of mass within " + scientific(std::max(*result.duality_gap, 1e-9)) +
                  " of the lowest possible above the target on these rays (proven by duality)"};
}

}  // namespace

Plan plan(const Mesh& solid, const StandSpec& spec, const HollowOptions& options, const Progress& progress) {
  Plan plan;
  plan.body = upright_body(solid, spec.up, spec.print, options, progress);
  const Body& body = *plan.body;
  const double tolerance = spec.contact_tolerance_mm ? *spec.contact_tolerance_mm : contact_tolerance_mm(body.height_mm);
  const SupportPolygon polygon = support_polygon(body.hull, tolerance);
  if (polygon.corners_mm.size() < 3)
    throw Error(ErrorCode::goal,
                std::string("It cannot stand: it touches the ground in ") +
                    (polygon.corners_mm.size() < 2 ? "a point" : "an edge") + " only (within " + number(tolerance, 3) +
                    " mm of its lowest point). Flatten its base, choose another attitude (--up), or allow for more give "
                    "(--contact).");

  const InteriorNlp::Scale scale{body.solid[M1], body.diagonal_mm};
  const Eigen::Vector2d target = chosen_target(body, polygon, spec, scale, progress);
  StandSpec found = spec;
  found.target_mm = body.to_working.inverse() * Eigen::Vector3d(target.x(), target.y(), 0);
  plan.spec = found;
  if (!lowest_above(body, target, scale))
    throw Error(ErrorCode::goal,
                "The centre of mass cannot be brought above the target: at the nearest any interior comes it is " +
                    number(smallest_offset_mm(body.inner.rays, body.shell, std::nullopt, target), 3) +
                    " mm beside it (horizontally). Choose another target (--target), a thinner wall (--wall), or let the "
                    "target be searched (--objective tip-angle).",
                {"--objective tip-angle"});
  plan.goal = stand_goal(target, scale.volume_mm3, scale.length_mm);
  plan.error = [target, L = scale.length_mm](const Moments& s) { return (s.segment<2>(MX) / s[M1] - target).norm() / L; };
  plan.setup.solver = options.solver;
  plan.setup.scale = scale;
  plan.setup.options = options.solve;
  plan.setup.options.tolerance = std::max(options.solve.tolerance, 1e-7);
  plan.setup.options.barrier_target = 1e-9;
  plan.prove = prove;
  return plan;
}

}  // namespace rayrep::detail
