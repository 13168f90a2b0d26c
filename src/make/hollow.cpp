#include "rayrep/make/hollow.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "base/text.h"
#include "make/hollow_detail.h"
#include "make/spin_search.h"
#include "rayrep/base/error.h"
#include "rayrep/make/waterline.h"
#include "rayrep/mesh/mesh_check.h"
#include "rayrep/physics/support_polygon.h"
#include "rayrep/solve/goals.h"
#include "rayrep/solve/quadric.h"

namespace rayrep {

using detail::Body;
using detail::check_options;
using detail::require;
using detail::solve_as_built;

Eigen::Affine3d working_frame(const Mesh& mesh, const Eigen::Vector3d& up) {
  Eigen::Matrix3d R = Eigen::Quaterniond::FromTwoVectors(up, Eigen::Vector3d::UnitZ()).toRotationMatrix();
  const Eigen::Matrix3d rounded = R.array().round();
  if ((R - rounded).norm() < 1e-12) R = rounded;
  Eigen::AlignedBox3d box;
  for (const auto& v : mesh.vertices) box.extend(R * v);
  Eigen::Affine3d T = Eigen::Affine3d::Identity();
  T.linear() = R;
  T.translation() << -box.center().x(), -box.center().y(), -box.min().z();
  return T;
}

namespace {

Error refusal(const Explanation& why) { return {ErrorCode::goal, why.text, why.remedies}; }

/// best_waterline on as many rays as tell waterlines apart, and on all of them if that one cannot be met there.
std::optional<double> searched_waterline(const FloatProblem& problem, const Body& body, const Progress& progress) {
  constexpr std::size_t enough = 15000;
  int step = 1;
  while (problem.inner.intervals.size() > 2 * enough * static_cast<std::size_t>(step * step)) ++step;
  if (step > 1) {
    const RayRep inner = problem.inner.thinned(step);
    const RayIntegrals integrals(inner);
    const FloatProblem coarse{problem.hull,        inner,
                              integrals,           body.solid - integrals.full(),
                              problem.fluid_g_cm3, problem.density_g_cm3,
                              problem.wall_mm,     problem.height_mm,
                              problem.diagonal_mm};
    const std::optional<double> best = best_waterline(coarse, progress);
    if (best && at_waterline(problem, *best).attainable) return best;
  }
  return best_waterline(problem, progress);
}

}  // namespace

FloatResult hollow_float(const Mesh& solid, const FloatOptions& options, const Progress& progress) {
  const HollowOptions& common = options.hollow;
  check_options(common);
  require(options.fluid_g_cm3 > 0 && std::isfinite(options.fluid_g_cm3),
          "The fluid's density must be positive; it is " + number(options.fluid_g_cm3, 3) + " g/cm3.");
  require(!(options.waterline_mm && options.submerged_fraction), "Give either a waterline or a submerged fraction, not both.");

  progress.begin("domain");
  Mesh outer = common.as_stored ? common.as_stored(solid) : solid;
  const Eigen::Affine3d frame = working_frame(outer, common.up);
  Body body(std::move(outer), frame, common, progress);
  const FloatProblem problem{body.hull,      body.inner.rays,     *body.integrals,
                             body.shell,     options.fluid_g_cm3, common.density_g_cm3,
                             common.wall_mm, body.height_mm,      body.diagonal_mm};

  FloatResult result;
  progress.begin("waterline");
  if (options.waterline_mm || options.submerged_fraction) {
    result.waterline_mm = options.waterline_mm ? *options.waterline_mm : *options.submerged_fraction * body.height_mm;
    require(result.waterline_mm > 0 && result.waterline_mm < body.height_mm,
            "The waterline must lie between the lowest and the highest point, 0 and " + number(body.height_mm, 2) + " mm; it is " +
                number(result.waterline_mm, 2) + " mm.");
  } else {
    const std::optional<double> best = searched_waterline(problem, body, progress);
    if (!best) throw refusal(explain_no_waterline(problem, body.surface, progress));
    result.waterline_mm = *best;
    result.waterline_searched = true;
  }
  const WaterlineState target = at_waterline(problem, result.waterline_mm);
  if (!target.attainable) throw refusal(explain_unattainable(problem, target, body.surface, progress));
  if (target.metacentric_height_mm <= 0)
    throw Error(ErrorCode::goal,
                "It cannot float upright at a waterline of " + number(result.waterline_mm, 2) +
                    " mm: with the lowest possible centre of mass the metacentric height is " +
                    number(target.metacentric_height_mm, 2) +
                    " mm, and it must be positive. Leave the waterline to the search (no --waterline), or try a denser "
                    "material (--density) or a thinner wall (--wall).");

  const double material_mm3 = target.water.displaced_volume_mm3 * options.fluid_g_cm3 / common.density_g_cm3;
  const Eigen::Vector2d centre = target.water.centre_of_buoyancy_mm.head<2>();
  const FloatGoal goal(material_mm3, centre, body.diagonal_mm);
  const auto error = [&](const Moments& s) {
    const double offset = (s.segment<2>(MX) / s[M1] - centre).norm() / body.diagonal_mm;
    return std::max(std::abs(s[M1] / material_mm3 - 1), offset);
  };
  InteriorSolver::Setup setup;
  setup.solver = common.solver;
  setup.scale = {material_mm3, body.diagonal_mm};
  setup.options = common.solve;
  const InteriorSolver solver(goal, body.inner.rays, *body.integrals, setup);
  const Moments correction = solve_as_built(body, solver, common, error, result.hollow, progress);
  const double bound = solve_quadric(goal, *body.integrals, body.shell + correction).lower_bound;
  result.hollow.duality_gap = (result.hollow.solve.objective - bound) / std::abs(bound);
  return result;
}

Eigen::Vector3d contact_point(const Mesh& mesh, const SpinAxis& axis, const Eigen::Vector3d& up, const Progress& progress) {
  const Eigen::Affine3d standing = working_frame(mesh, up);
  const Mesh upright = transformed(mesh, standing);
  Eigen::Vector3d through = Eigen::Vector3d::Zero();
  switch (axis.through) {
    case SpinAxis::Through::lowest_point: {
      // Vertices merge where the lowest place is an edge or a face: its middle.
      const double diagonal = bounding_box(upright).diagonal().norm();
      Eigen::AlignedBox3d lowest;
      for (const auto& v : upright.vertices)
        if (v.z() <= 1e-6 * diagonal) lowest.extend(v);
      return standing.inverse() * Eigen::Vector3d(lowest.center().x(), lowest.center().y(), 0);
    }
    case SpinAxis::Through::centre_of_mass:
    case SpinAxis::Through::best: {  // where its search starts
      const Moments s = mesh_moments(boundary_of_union(upright, progress));
      through = s.segment<3>(MX) / s[M1];
      break;
    }
    case SpinAxis::Through::point:
      if (!axis.leaves_below) return axis.point_mm;
      through = standing * axis.point_mm;
      break;
  }
  // The centre of mass may lie in a hole: a tip is then thought down to the level of the lowest point.
  std::vector<LineHit> hits;
  line_hits_brute_force(upright, through.head<2>(), hits);
  require(!hits.empty() || axis.through != SpinAxis::Through::point,
          "The spin axis does not meet the mesh: choose a point of it (--point) below or inside the body.");
  return standing.inverse() * Eigen::Vector3d(through.x(), through.y(), hits.empty() ? 0 : hits.front().z_mm);
}

namespace {

/// The largest wall, down to the thinnest that can be printed, with which the body spins about the axis as wanted; none if there is
/// no such wall. At a resolution that is enough for advice.
std::optional<double> wall_for_balance(const Body& body, const SpinGoal& goal, const SpinOptions& options,
                                       const Progress& progress) {
  constexpr double thinnest_mm = 0.4;
  const Progress quiet{.stage = {}, .cancelled = progress.cancelled};
  const auto balances = [&](double wall) {
    InnerDomainOptions inner_options;
    inner_options.wall_mm = wall;
    inner_options.ray_spacing_mm = inner_options.field_spacing_mm = body.size_mm / 80;
    const RayIntegrals inner(inner_domain(body.surface, inner_options, quiet).rays);
    if (inner.intervals() == 0) return false;
    const QuadricSolution solution = solve_quadric(goal, inner, body.solid - inner.full());
    return solution.converged && detail::spins_as_wanted(solution.moments, options.largest);
  };
  Interval wall{thinnest_mm, options.hollow.wall_mm};
  if (wall.length() <= 0 || !balances(wall.lo)) return std::nullopt;
  while (wall.length() > 0.02) (balances(wall.middle()) ? wall.lo : wall.hi) = wall.middle();
  return wall.lo;
}

std::string vector_text(const Eigen::Vector3d& v, int digits) {
  return number(v.x(), digits) + "," + number(v.y(), digits) + "," + number(v.z(), digits);
}

/// Why the body cannot be balanced about this axis, how near it comes, and what would make it possible.
Error unbalanced(const Body& body, const SpinOptions& options, const SpinGoal& goal, const Progress& progress) {
  progress.begin("advice");
  const NearestSolution nearest = nearest_attainable(goal, *body.integrals, body.shell, 1e-6);
  const Moments& s = nearest.moments;
  const double offset = (options.yoyo ? s.segment<3>(MX).norm() : s.segment<2>(MX).norm()) / s[M1];
  const double products = Eigen::Vector2d(s[MXZ], s[MYZ]).norm() / s[M1];
  std::string text = "It cannot be balanced about this axis: no interior on these rays brings the centre of mass onto " +
                     std::string(options.yoyo ? "the centre" : "the axis") +
                     " and makes the products of inertia vanish (proven). The centre of mass alone comes to within " +
                     number(smallest_offset_mm(body.inner.rays, body.shell, std::nullopt, {0, 0}), 3) +
                     " mm of the axis; where the static moment and the products together are smallest, it lies " +
                     number(offset, 3) + " mm beside it, the mass is " + number(s[M1] * options.hollow.density_g_cm3 / 1000, 2) +
                     " g and the products are " + number(products, 3) + " mm2 per unit of mass.";
  const detail::SpinSearch search(body, options);
  const Eigen::Affine3d back = body.to_working.inverse();
  std::vector<std::string> remedies;
  std::string ways;
  const auto add = [&](const std::string& way, const std::string& remedy) {
    ways += (ways.empty() ? "" : "; ") + way + " (" + remedy + ")";
    remedies.push_back(remedy);
  };
  if (const auto point = search.nearest_point({}, progress))
    add("move the axis by " + number(point->second, 2) + " mm",
        (options.yoyo ? "--center " : "--point ") + vector_text(back * point->first.contact_mm, 3));
  if (const auto tilt = search.smallest_tilt({}, progress))
    add("tilt it by " + number(tilt->second * 180 / std::numbers::pi, 1) + " degrees",
        "--up " + vector_text(back.linear() * tilt->first.up, 5));
  if (const auto wall = wall_for_balance(body, goal, options, progress))
    add("make the wall thinner", "--wall " + number(std::floor(*wall * 100) / 100, 2));
  text += ways.empty() ? " No parallel axis (--point), no tilt up to 30 degrees (--up) and no wall down to 0.4 mm (--wall) would "
                         "help: try another "
                         "shape, or a larger body (--size)."
                       : " What would make it possible: " + ways + ".";
  return {ErrorCode::goal, text, remedies};
}

/// Axis and contact point in the frame of the mesh that was given, searched at a coarse resolution where that is asked for.
detail::SpinFrame spin_frame(const Mesh& outer, const SpinOptions& options, const Progress& progress) {
  detail::SpinFrame frame{options.hollow.up.normalized(), options.yoyo
                                                              ? options.centre_mm.value_or(bounding_box(outer).center())
                                                              : contact_point(outer, options.axis, options.hollow.up, progress)};
  const bool points = options.axis.through == SpinAxis::Through::best && !options.yoyo;
  if (!points && options.max_tilt_rad == 0) return frame;
  HollowOptions coarse = options.hollow;
  coarse.resolution = std::min(coarse.resolution, 80);
  Eigen::Affine3d working = working_frame(outer, options.hollow.up);
  working.translation() = -(working.linear() * frame.contact_mm);
  const Body body(outer, working, coarse, progress);
  progress.begin("axis");
  const detail::SpinFrame best = detail::SpinSearch(body, options).best({}, points, options.max_tilt_rad, progress);
  frame.up = working.linear().transpose() * best.up;
  frame.contact_mm = working.inverse() * best.contact_mm;
  return frame;
}

}  // namespace

SpinResult hollow_spin(const Mesh& solid, const SpinOptions& options, const Progress& progress) {
  HollowOptions common = options.hollow;
  check_options(common);
  require(options.weights.lambda >= 0 && options.weights.gamma_c >= 0 && options.weights.gamma_i >= 0 &&
              std::isfinite(options.weights.lambda + options.weights.gamma_c + options.weights.gamma_i),
          "The weights of the objective must not be negative.");
  require(!options.certify || (options.largest && options.weights.gamma_c == 0),
          "The global optimum can be proven for the largest axis and the objective of the ray-reps paper, and for yo-yos.");
  require(options.max_tilt_rad >= 0 && options.max_tilt_rad <= std::numbers::pi / 2,
          "The axis can be searched within 0 to 90 degrees of the up direction.");

  progress.begin("domain");
  Mesh outer = common.as_stored ? common.as_stored(solid) : solid;
  const detail::SpinFrame axis = spin_frame(outer, options, progress);
  SpinResult result;
  result.up = axis.up;
  result.contact_mm = axis.contact_mm;
  common.up = axis.up;
  progress.begin("domain");
  Eigen::Affine3d frame = working_frame(outer, common.up);
  frame.translation() = -(frame.linear() * result.contact_mm);
  Body body(std::move(outer), frame, common, progress);

  const InteriorNlp::Scale scale{body.solid[M1], body.diagonal_mm};
  const SpinGoal goal(options.weights, options.largest, options.yoyo, scale.volume_mm3, scale.length_mm);
  progress.begin("solve");
  const QuadricSolution exact = solve_quadric(goal, *body.integrals, body.shell);
  if (exact.infeasible) throw unbalanced(body, options, goal, progress);
  // What was solved to see whether it can be done is where the first pass starts.
  const QuadricSolution* known = &exact;
  if (options.certify) {
    const Eigen::AlignedBox3d box = bounding_box(body.working);
    result.certificate = certify_spin({.lambda = options.weights.lambda,
                                       .gamma_i = options.weights.gamma_i,
                                       .yoyo = options.yoyo,
                                       .volume_mm3 = scale.volume_mm3,
                                       .length_mm = scale.length_mm},
                                      *body.integrals, body.shell, {box.min().z(), box.max().z()}, {}, progress);
    known = &result.certificate->best;
  }
  InteriorSolver::Setup setup;
  setup.solver = common.solver;
  if (known->converged) {
    setup.warm.moments = known->moments;
    setup.warm.multipliers = known->multipliers;
  }
  setup.segments = true;
  setup.bounds = options.bounds;
  setup.between = options.largest ? Between::material : Between::cavity;
  setup.start_fill = options.start_fill;
  setup.scale = scale;
  setup.options = common.solve;
  setup.options.tolerance = std::max(common.solve.tolerance, 1e-6);
  setup.options.barrier_target = 1e-7;
  setup.options.max_iterations = std::min(common.solve.max_iterations, 200);
  const auto error = [&](const Moments& s) {
    const double m = s[M1];
    const double L = scale.length_mm;
    const double products = Eigen::Vector2d(s[MXZ], s[MYZ]).norm() / (m * L * L);
    const double offset = (options.yoyo ? s.segment<3>(MX).norm() : s.segment<2>(MX).norm()) / (m * L);
    return std::max(offset, products);
  };
  solve_as_built(body, InteriorSolver(goal, body.inner.rays, *body.integrals, setup), common, error, result.hollow, progress);
  result.objective = result.hollow.solve.objective;
  return result;
}

namespace {

/// The lowest centre of mass above `target`; none if out of reach.
std::optional<Moments> lowest_above(const Body& body, const Eigen::Vector2d& target, const InteriorNlp::Scale& scale) {
  const QuadricSolution lowest = solve_quadric(StandGoal(target, scale.volume_mm3, scale.length_mm), *body.integrals, body.shell);
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

}  // namespace

StandResult hollow_stand(const Mesh& solid, const StandOptions& options, const Progress& progress) {
  const HollowOptions& common = options.hollow;
  check_options(common);
  progress.begin("domain");
  Mesh outer = common.as_stored ? common.as_stored(solid) : solid;
  const Eigen::Affine3d frame = working_frame(outer, common.up);
  Body body(std::move(outer), frame, common, progress);
  const double tolerance = options.contact_tolerance_mm ? *options.contact_tolerance_mm : contact_tolerance_mm(body.height_mm);
  const SupportPolygon polygon = support_polygon(body.hull, tolerance);
  if (polygon.corners_mm.size() < 3)
    throw Error(ErrorCode::goal,
                std::string("It cannot stand: it touches the ground in ") +
                    (polygon.corners_mm.size() < 2 ? "a point" : "an edge") + " only (within " + number(tolerance, 3) +
                    " mm of its lowest point). Flatten its base, choose another attitude (--up), or allow for more give "
                    "(--contact).");

  const InteriorNlp::Scale scale{body.solid[M1], body.diagonal_mm};
  StandResult result;
  Eigen::Vector2d target = options.target_mm ? Eigen::Vector2d((frame * *options.target_mm).head<2>()) : polygon.safest_point_mm();
  progress.begin("target");
  // Half filled everywhere, no end is at its bound: a centre of mass with room on all sides.
  const Moments half = body.shell + 0.5 * ray_moments(body.inner.rays);
  const Eigen::Vector2d middle = half.segment<2>(MX) / half[M1];
  // A target at the edge of what these rays reach leaves no room to correct the mesh, which differs a little.
  constexpr double room = 0.05;
  const bool in_reach = lowest_above(body, target + room * (target - middle), scale).has_value();
  if (options.objective == StandOptions::Objective::tip_angle || (!in_reach && !options.target_mm)) {
    target = safest_target(body, polygon, in_reach ? target : middle, scale, progress);
    target += room * (middle - target);
  }
  result.target_mm = frame.inverse() * Eigen::Vector3d(target.x(), target.y(), 0);

  const StandGoal goal(target, scale.volume_mm3, scale.length_mm);
  if (!lowest_above(body, target, scale))
    throw Error(ErrorCode::goal,
                "The centre of mass cannot be brought above the target: at the nearest any interior comes it is " +
                    number(smallest_offset_mm(body.inner.rays, body.shell, std::nullopt, target), 3) +
                    " mm beside it (horizontally). Choose another target (--target), a thinner wall (--wall), or let the "
                    "target be searched (--objective tip-angle).",
                {"--objective tip-angle"});
  InteriorSolver::Setup setup;
  setup.solver = common.solver;
  setup.scale = scale;
  setup.options = common.solve;
  setup.options.tolerance = std::max(common.solve.tolerance, 1e-7);
  setup.options.barrier_target = 1e-9;
  const auto error = [&](const Moments& s) { return (s.segment<2>(MX) / s[M1] - target).norm() / scale.length_mm; };
  const InteriorSolver solver(goal, body.inner.rays, *body.integrals, setup);
  const Moments constant = body.shell + solve_as_built(body, solver, common, error, result.hollow, progress);
  result.objective = result.hollow.solve.objective;
  // For every s that meets the constraints, (c_z(s) - c_z) m(s) / (L m) = q.s >= min over all interiors of q.s. theory.md (27d)
  const Moments& q = result.hollow.q;
  const Moments s = constant + body.integrals->moments(q);
  result.hollow.duality_gap = std::max(0.0, -q.dot(s)) * s[M1] / constant[M1] / std::abs(result.objective);
  return result;
}

}  // namespace rayrep
