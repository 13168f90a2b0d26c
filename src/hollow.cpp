#include "rayrep/hollow.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>
#include <numbers>

#include "rayrep/cavity.h"
#include "rayrep/error.h"
#include "rayrep/goals.h"
#include "rayrep/mesh_check.h"
#include "rayrep/quadric.h"
#include "rayrep/ray_interior.h"
#include "rayrep/support_polygon.h"
#include "rayrep/waterline.h"
#include "text.h"

namespace rayrep {
namespace {

void require(bool holds, const std::string& message) {
  if (!holds) throw Error(ErrorCode::usage, message);
}

void check_options(const HollowOptions& options) {
  require(options.up.allFinite() && options.up.norm() > 0, "The up direction must be a vector that is not zero.");
  require(options.wall_mm > 0 && std::isfinite(options.wall_mm),
          "The wall must be thicker than 0 mm; it is " + number(options.wall_mm, 3) + " mm.");
  require(options.density_g_cm3 > 0 && std::isfinite(options.density_g_cm3),
          "The density must be positive; it is " + number(options.density_g_cm3, 3) + " g/cm3.");
  require(options.resolution >= 20 && options.resolution <= 1000,
          "The resolution must lie between 20 and 1000 rays; it is " + std::to_string(options.resolution) + ".");
  require(options.max_passes >= 1, "At least one pass is needed.");
}

/// The grid on which the cavity is meshed: as fine as the rays, but not finer than a printer sees, nor so coarse that the triangles
/// between the vertices cut into the wall (a chord of length h takes h^2 / (4 wall)); up to twice as coarse for a large body, whose
/// memory would run out.
double field_spacing(double ray_spacing_mm, double wall_mm, double size_mm) {
  const double printer_mm = std::min(0.3, size_mm / 100);
  return std::min(std::max(ray_spacing_mm, printer_mm), std::max(0.25 * wall_mm, std::min(0.5 * wall_mm, size_mm / 500)));
}

/// What every goal needs: the body in the working frame and its inner domain.
struct Body {
  Mesh outer;  ///< as stored, in the frame given
  Eigen::Affine3d to_working;
  Mesh working;   ///< outer in the working frame
  Mesh hull;      ///< what a fluid touches: sealed cavities left out, overlaps united; working frame
  Moments solid;  ///< of the union of its components, unit density, working frame
  double size_mm = 0;
  double diagonal_mm = 0;
  double height_mm = 0;
  SurfaceQuery surface;
  InnerDomain inner;
  Moments shell;  ///< solid - inner domain

  Body(Mesh mesh, const Eigen::Affine3d& frame, const HollowOptions& options, const Progress& progress)
      : outer(std::move(mesh)),
        to_working(frame),
        working(transformed(outer, to_working)),
        hull(boundary_of_union(outer_hull(working), progress)),
        solid(mesh_moments(boundary_of_union(working, progress))),
        surface(working) {
    const Eigen::AlignedBox3d box = bounding_box(working);
    size_mm = box.sizes().maxCoeff();
    diagonal_mm = box.diagonal().norm();
    height_mm = box.sizes().z();

    InnerDomainOptions inner_options;
    inner_options.wall_mm = options.wall_mm;
    inner_options.ray_spacing_mm = size_mm / options.resolution;
    inner_options.field_spacing_mm = field_spacing(inner_options.ray_spacing_mm, options.wall_mm, size_mm);
    inner_options.min_component_mm3 = options.min_cavity_mm3;
    if (inner_options.field_spacing_mm > 0.5 * options.wall_mm || inner_options.field_spacing_mm < size_mm / 1000)
      throw Error(ErrorCode::goal, "A wall of " + number(options.wall_mm, 3) + " mm is too thin to be resolved in a body " +
                                       number(size_mm, 1) + " mm long: choose at least " + number(size_mm / 500, 3) +
                                       " mm (--wall). If the body is not meant to be that long, set --unit or --size.");
    inner = inner_domain(surface, inner_options, progress);
    if (inner.rays.intervals.empty()) throw Error(ErrorCode::goal, nothing_inside(options, progress));
    shell = solid - ray_moments(inner.rays);
  }

private:
  std::string nothing_inside(const HollowOptions& options, const Progress& progress) const {
    const ClosestPoint deepest = deepest_point(surface, progress);
    const Eigen::Vector3d at = to_working.inverse() * deepest.point_mm;
    const Eigen::Vector3d size = bounding_box(outer).sizes();
    std::string text = "Nothing remains inside a wall of " + number(options.wall_mm, 2) + " mm: the deepest point, at (" +
                       number(at.x(), 2) + ", " + number(at.y(), 2) + ", " + number(at.z(), 2) + "), is only " +
                       number(deepest.distance_mm, 3) + " mm from the surface";
    if (deepest.distance_mm > options.wall_mm) text += " and the room around it is too small to print";
    return text + ". The body measures " + number(size.x(), 2) + " x " + number(size.y(), 2) + " x " + number(size.z(), 2) +
           " mm: if that is not what you meant, set the unit (--unit) or the size (--size); otherwise choose a thinner wall "
           "(--wall).";
  }
};

/// Meshes the cavity of q and appends it to the outer surface, as it will be stored.
struct Built {
  Mesh delivered;
  CavityMesh cavity;  ///< working frame
  Moments body;       ///< exact moments of the delivered body, unit density, working frame
};

Built build(Body& body, const Moments& q, const HollowOptions& options) {
  CavityOptions cavity_options;
  cavity_options.wall_mm = options.wall_mm;
  cavity_options.min_cavity_mm3 = options.min_cavity_mm3;
  Built built;
  built.cavity = mesh_cavity(body.inner.field, body.surface, q, cavity_options);
  Mesh shells = transformed(built.cavity.mesh, body.to_working.inverse());
  if (options.as_stored) shells = options.as_stored(shells);
  built.body = body.solid + mesh_moments(transformed(shells, body.to_working));  // shells face inward: negative
  built.delivered = body.outer;
  append(built.delivered, shells);
  return built;
}

/// Solves and meshes until the mesh itself meets the goal: what the mesh has more than the model is added to the model's constant
/// part.
/// @param error      of a body with these moments, to compare with HollowOptions::as_built_tolerance
/// @param if_failed  called with the report of a solver that did not converge; throws
template <typename ErrorOf, typename IfFailed>
Moments solve_as_built(Body& body, const Goal& goal, const Interior& interior, const InteriorNlp::Scale& scale, double fill,
                       const HollowOptions& options, const ErrorOf& error, const IfFailed& if_failed, HollowResult& hollow,
                       const Progress& progress) {
  Moments correction = Moments::Zero();
  Moments best_correction = correction;
  double best_error = std::numeric_limits<double>::infinity();
  for (int pass = 1; pass <= options.max_passes; ++pass) {
    progress.begin("solve");
    const InteriorNlp nlp(goal, interior, body.shell + correction, scale, fill);
    SolveReport solve = solve_ipopt(nlp, options.solve, progress);
    hollow.solver_iterations += solve.iterations;
    if (solve.status != SolveStatus::converged && !nlp.quadratic()) {
      SolveOptions other = options.solve;
      other.adaptive_barrier = !other.adaptive_barrier;
      solve = solve_ipopt(nlp, other, progress);
      hollow.solver_iterations += solve.iterations;
    }
    hollow.passes = pass;
    if (solve.status != SolveStatus::converged) {
      // At the edge of what can be met the feedback may ask for too much: keep the best so far.
      if (std::isfinite(best_error)) break;
      if_failed(solve);
    }
    solve.x = nlp.interior_variables(solve.x);
    solve.variables = interior.variables();
    const Moments model = body.shell + correction + interior.moments(solve.x);
    solve.objective = goal.objective(model);
    const Moments q = nlp.switching(solve.multipliers);

    progress.begin("mesh");
    Built built = build(body, q, options);
    if (const double e = error(built.body); e < best_error) {
      best_error = e;
      best_correction = correction;
      hollow.solve = std::move(solve);
      hollow.q = q;
      hollow.delivered = std::move(built.delivered);
      hollow.cavities = built.cavity.cavities;
      hollow.filled_cavities = built.cavity.filled;
      hollow.filled_mm3 = built.cavity.filled_mm3;
      hollow.removed_islands = built.cavity.removed_islands;
    }
    if (best_error <= options.as_built_tolerance) break;
    correction += built.body - model;
  }
  hollow.cast = body.inner.cast;
  hollow.dropped_components = body.inner.dropped_components;
  hollow.ray_spacing_mm = body.inner.rays.grid.spacing_mm;
  hollow.field_spacing_mm = body.inner.field.spacing_mm;
  hollow.to_working = body.to_working;
  return best_correction;
}

[[noreturn]] void throw_unsolved(const SolveReport& report) {
  throw Error(ErrorCode::solver, "The solver stopped before it converged: " + report.solver + " says " + report.solver_status +
                                     " after " + std::to_string(report.iterations) + " iterations with " +
                                     std::to_string(report.variables) + " variables. Try another resolution (--resolution).");
}

}  // namespace

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
  const FloatProblem problem{body.hull,      body.inner.rays, body.shell,      options.fluid_g_cm3, common.density_g_cm3,
                             common.wall_mm, body.height_mm,  body.diagonal_mm};

  FloatResult result;
  progress.begin("waterline");
  if (options.waterline_mm || options.submerged_fraction) {
    result.waterline_mm = options.waterline_mm ? *options.waterline_mm : *options.submerged_fraction * body.height_mm;
    require(result.waterline_mm > 0 && result.waterline_mm < body.height_mm,
            "The waterline must lie between the lowest and the highest point, 0 and " + number(body.height_mm, 2) + " mm; it is " +
                number(result.waterline_mm, 2) + " mm.");
  } else {
    const std::optional<double> best = best_waterline(problem, progress);
    if (!best) throw Error(ErrorCode::goal, explain_no_waterline(problem, body.surface, progress));
    result.waterline_mm = *best;
    result.waterline_searched = true;
  }
  const WaterlineState target = at_waterline(problem, result.waterline_mm);
  if (!target.attainable) throw Error(ErrorCode::goal, explain_unattainable(problem, target, body.surface, progress));
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
  const BottomFilledRays interior(body.inner.rays);
  const auto error = [&](const Moments& s) {
    const double offset = (s.segment<2>(MX) / s[M1] - centre).norm() / body.diagonal_mm;
    return std::max(std::abs(s[M1] / material_mm3 - 1), offset);
  };
  const Moments correction = solve_as_built(body, goal, interior, {material_mm3, body.diagonal_mm}, 0.5, common, error,
                                            throw_unsolved, result.hollow, progress);
  const double bound = solve_quadric(goal, body.inner.rays, body.shell + correction).lower_bound;
  result.hollow.duality_gap = (result.hollow.solve.objective - bound) / std::abs(bound);
  return result;
}

namespace {

/// Contact point of a top or centre of a yo-yo, in the frame of the mesh that was given.
Eigen::Vector3d spin_origin(const Mesh& mesh, const SpinOptions& options, const Progress& progress) {
  const Eigen::Affine3d standing = working_frame(mesh, options.hollow.up);
  const Mesh upright = transformed(mesh, standing);
  if (options.yoyo) return options.centre_mm ? *options.centre_mm : Eigen::Vector3d(bounding_box(mesh).center());

  const double diagonal = bounding_box(upright).diagonal().norm();
  Eigen::Vector3d through = Eigen::Vector3d::Zero();
  switch (options.axis.through) {
    case SpinAxis::Through::lowest_point: {
      // Vertices merge where the lowest place is an edge or a face: its middle.
      Eigen::AlignedBox3d lowest;
      for (const auto& v : upright.vertices)
        if (v.z() <= 1e-6 * diagonal) lowest.extend(v);
      return standing.inverse() * Eigen::Vector3d(lowest.center().x(), lowest.center().y(), 0);
    }
    case SpinAxis::Through::centre_of_mass: {
      const Moments s = mesh_moments(boundary_of_union(upright, progress));
      through = s.segment<3>(MX) / s[M1];
      break;
    }
    case SpinAxis::Through::point:
      if (!options.axis.leaves_below) return options.axis.point_mm;
      through = standing * options.axis.point_mm;
      break;
  }
  // The centre of mass may lie in a hole: a tip is then thought down to the level of the lowest point.
  std::vector<LineHit> hits;
  SurfaceQuery(upright).line_hits_brute_force(through.head<2>(), hits);
  require(!hits.empty() || options.axis.through == SpinAxis::Through::centre_of_mass,
          "The spin axis does not meet the mesh: choose a point of it (--point) below or inside the body.");
  return standing.inverse() * Eigen::Vector3d(through.x(), through.y(), hits.empty() ? 0 : hits.front().z_mm);
}

}  // namespace

SpinResult hollow_spin(const Mesh& solid, const SpinOptions& options, const Progress& progress) {
  HollowOptions common = options.hollow;
  check_options(common);
  require(options.weights.lambda >= 0 && options.weights.gamma_c >= 0 && options.weights.gamma_i >= 0 &&
              std::isfinite(options.weights.lambda + options.weights.gamma_c + options.weights.gamma_i),
          "The weights of the objective must not be negative.");

  progress.begin("domain");
  Mesh outer = common.as_stored ? common.as_stored(solid) : solid;
  SpinResult result;
  result.contact_mm = spin_origin(outer, options, progress);
  Eigen::Affine3d frame = working_frame(outer, common.up);
  frame.translation() = -(frame.linear() * result.contact_mm);
  Body body(std::move(outer), frame, common, progress);

  const InteriorNlp::Scale scale{body.solid[M1], body.diagonal_mm};
  const SpinGoal goal(options.weights, options.largest, options.yoyo, scale.volume_mm3, scale.length_mm);
  const SegmentRays interior(body.inner.rays, options.bounds);
  progress.begin("solve");
  const NearestSolution nearest = nearest_attainable(goal.constraint_jacobian(body.shell), body.inner.rays, body.shell, 1e-6);
  if (!nearest.attainable) {
    const Moments& s = nearest.moments;
    const double offset = (options.yoyo ? s.segment<3>(MX).norm() : s.segment<2>(MX).norm()) / s[M1];
    const double products = Eigen::Vector2d(s[MXZ], s[MYZ]).norm() / s[M1];
    throw Error(ErrorCode::goal,
                "It cannot be balanced about this axis: no interior on these rays brings the centre of mass onto " +
                    std::string(options.yoyo ? "the centre" : "the axis") +
                    " and makes the products of inertia vanish. The centre of mass alone comes to within " +
                    number(smallest_offset_mm(body.inner.rays, body.shell, std::nullopt, {0, 0}), 3) +
                    " mm of the axis; where the static moment and the products together are smallest, it lies " +
                    number(offset, 3) + " mm beside it and the products are " + number(products, 3) +
                    " mm2 per unit of mass. Try another axis (--up, " + (options.yoyo ? "--center" : "--point") +
                    "), a thinner wall (--wall), a larger body (--size) or a finer --resolution.");
  }
  // Void rays may lie anywhere on their interval: the optimum is flat, and only the central path leads to one point of it.
  common.solve.tolerance = std::max(common.solve.tolerance, 1e-6);
  common.solve.barrier_target = 1e-7;
  common.solve.max_iterations = std::min(common.solve.max_iterations, 200);
  const auto error = [&](const Moments& s) {
    const double m = s[M1];
    const double L = scale.length_mm;
    const double products = Eigen::Vector2d(s[MXZ], s[MYZ]).norm() / (m * L * L);
    const double offset = (options.yoyo ? s.segment<3>(MX).norm() : s.segment<2>(MX).norm()) / (m * L);
    return std::max(offset, products);
  };
  solve_as_built(body, goal, interior, scale, options.start_fill, common, error, throw_unsolved, result.hollow, progress);
  result.objective = result.hollow.solve.objective;
  return result;
}

namespace {

/// The lowest centre of mass above `target`, by Dinkelbach's iteration on s_z - gamma s_1 with the quadric solver; none if out of
/// reach.
std::optional<Moments> lowest_above(const Body& body, const Eigen::Vector2d& target, const InteriorNlp::Scale& scale) {
  Moments s = body.solid;
  for (int iteration = 0; iteration < 12; ++iteration) {
    const double height = s[MZ] / s[M1];
    const LoweringGoal goal(target, height, scale.volume_mm3, scale.length_mm);
    const QuadricSolution solution = solve_quadric(goal, body.inner.rays, body.shell);
    if (!solution.converged) return std::nullopt;
    s = solution.moments;
    if (height - s[MZ] / s[M1] < 1e-6 * scale.length_mm) break;
  }
  return s;
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
  HollowOptions common = options.hollow;
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
  const BottomFilledRays interior(body.inner.rays);
  if (!lowest_above(body, target, scale))
    throw Error(ErrorCode::goal,
                "The centre of mass cannot be brought above the target: at the nearest any interior comes it is " +
                    number(smallest_offset_mm(body.inner.rays, body.shell, std::nullopt, target), 3) +
                    " mm beside it (horizontally). Choose another target (--target), a thinner wall (--wall), or let the "
                    "target be searched (--objective tip-angle).");
  common.solve.tolerance = std::max(common.solve.tolerance, 1e-7);
  common.solve.barrier_target = 1e-9;
  const auto error = [&](const Moments& s) { return (s.segment<2>(MX) / s[M1] - target).norm() / scale.length_mm; };
  solve_as_built(body, goal, interior, scale, 0.5, common, error, throw_unsolved, result.hollow, progress);
  result.objective = result.hollow.solve.objective;
  return result;
}

}  // namespace rayrep
