#include "rayrep/hollow.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <cstdio>

#include "rayrep/cavity.h"
#include "rayrep/error.h"
#include "rayrep/goals.h"
#include "rayrep/mesh_check.h"
#include "rayrep/quadric.h"
#include "rayrep/ray_interior.h"
#include "rayrep/waterline.h"

namespace rayrep {
namespace {

std::string number(double value, int digits) {
  char text[64];
  std::snprintf(text, sizeof text, "%.*f", digits, value);
  return text;
}

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

/// The grid on which the cavity is meshed: as fine as the rays, but not finer than a printer sees, nor so coarse that triangles
/// between vertices cut into the wall, nor so fine for a large body that memory runs out.
double field_spacing(double ray_spacing_mm, double wall_mm, double size_mm) {
  constexpr double printer_mm = 0.2;
  return std::clamp(ray_spacing_mm, std::min(printer_mm, size_mm / 100), std::max({0.5 * wall_mm, size_mm / 400, printer_mm}));
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

  Body(Mesh mesh, const HollowOptions& options, const Progress& progress)
      : outer(std::move(mesh)),
        to_working(working_frame(outer, options.up)),
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

Built build(const Body& body, const Moments& q, const HollowOptions& options) {
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

void throw_if_unsolved(const SolveReport& report) {
  if (report.status == SolveStatus::converged) return;
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
  const Body body(common.as_stored ? common.as_stored(solid) : solid, common, progress);
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
  HollowResult& hollow = result.hollow;
  Moments correction = Moments::Zero();
  Built built;
  for (hollow.passes = 1;; ++hollow.passes) {
    progress.begin("solve");
    const AffineGoalNlp nlp(goal, interior, body.shell + correction, body.diagonal_mm);
    hollow.solve = solve_ipopt(nlp, common.solve, progress);
    hollow.solver_iterations += hollow.solve.iterations;
    throw_if_unsolved(hollow.solve);
    hollow.q = nlp.switching(hollow.solve.x, hollow.solve.multipliers);
    const Moments model = nlp.body(hollow.solve.x);
    const double bound = solve_quadric(goal, body.inner.rays, body.shell + correction).lower_bound;
    hollow.duality_gap = (goal.objective(model) - bound) / std::abs(bound);

    progress.begin("mesh");
    built = build(body, hollow.q, common);
    const double mass_error = std::abs(built.body[M1] / material_mm3 - 1);
    const double offset = (built.body.segment<2>(MX) / built.body[M1] - centre).norm() / body.diagonal_mm;
    if (std::max(mass_error, offset) <= common.as_built_tolerance || hollow.passes == common.max_passes) break;
    correction += built.body - model;
  }

  hollow.delivered = std::move(built.delivered);
  hollow.cavities = built.cavity.cavities;
  hollow.filled_cavities = built.cavity.filled;
  hollow.filled_mm3 = built.cavity.filled_mm3;
  hollow.removed_islands = built.cavity.removed_islands;
  hollow.cast = body.inner.cast;
  hollow.dropped_components = body.inner.dropped_components;
  hollow.ray_spacing_mm = body.inner.rays.grid.spacing_mm;
  hollow.field_spacing_mm = body.inner.field.spacing_mm;
  hollow.to_working = body.to_working;
  return result;
}

}  // namespace rayrep
