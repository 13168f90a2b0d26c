#include "make/hollow_detail.h"

#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "base/text.h"
#include "rayrep/base/error.h"
#include "rayrep/make/cavity.h"
#include "rayrep/mesh/mesh_check.h"

namespace rayrep::detail {
namespace {

/// The grid on which the cavity is meshed: as fine as the rays, but not finer than a printer sees, nor so coarse that the wall's
/// own shape is lost.
double field_spacing(double ray_spacing_mm, double wall_mm, double size_mm) {
  const double printer_mm = std::min(0.3, size_mm / 100);
  return std::min(std::max(ray_spacing_mm, printer_mm), 0.5 * wall_mm);
}

InnerDomainOptions inner_options(const HollowOptions& options, double size_mm) {
  InnerDomainOptions inside;
  inside.wall_mm = options.wall_mm;
  inside.ray_spacing_mm = size_mm / options.resolution;
  inside.field_spacing_mm = field_spacing(inside.ray_spacing_mm, options.wall_mm, size_mm);
  inside.min_component_mm3 = options.min_cavity_mm3;
  return inside;
}

/// The cavity of the latest q, and the body with it as it will be stored.
class Built {
public:
  Built(Body& body, const HollowOptions& options) : body_(body), options_(options) {
    cavity_options_.wall_mm = options.wall_mm;
    cavity_options_.min_cavity_mm3 = options.min_cavity_mm3;
  }

  /// Meshes the cavity of q. Once there is one it only follows q, where it can.
  void build(const Moments& q) {
    const bool first = cavity_.mesh.vertices.empty();
    if (first || !follow_quadric(cavity_, body_.inner.field, body_.surface, q, cavity_options_)) {
      cavity_ = mesh_cavity(body_.inner.field, body_.surface, q, cavity_options_);
      followed_ = false;
    } else {
      followed_ = true;
    }
    shells_ = transformed(cavity_.mesh, body_.to_working.inverse());
    if (options_.as_stored) shells_ = options_.as_stored(shells_);
    moments_ = body_.solid + mesh_moments(transformed(shells_, body_.to_working));  // shells face inward: negative
  }

  bool followed() const { return followed_; }
  /// True when following has made the cavity cross itself: it must be meshed anew.
  bool has_folded() const { return followed_ && crossing_triangles(cavity_.mesh).size() > cavity_.crossing; }
  void discard() { cavity_ = {}; }

  const Moments& moments() const { return moments_; }  ///< exact, of the whole body, unit density, working frame
  const CavityMesh& cavity() const { return cavity_; }
  Mesh delivered() const {
    Mesh mesh = body_.outer;
    append(mesh, shells_);
    return mesh;
  }

private:
  Body& body_;
  const HollowOptions& options_;
  CavityOptions cavity_options_;
  CavityMesh cavity_;  ///< working frame
  Mesh shells_;        ///< as stored, in the frame given
  Moments moments_ = Moments::Zero();
  bool followed_ = false;
};

/// The fixed-point iteration c = D(c), sped up by what its last steps have shown of D: Anderson's method. theory.md (16e)
class Feedback {
public:
  /// @param unit  of each moment
  explicit Feedback(const Moments& unit) : unit_(unit) {}

  /// After a jump of D its past says nothing about its future.
  void forget() { steps_.clear(); }

  /// Where to go from c, given D(c).
  Moments next(const Moments& c, const Moments& D) {
    const auto n = static_cast<Eigen::Index>(steps_.size());
    Eigen::MatrixXd changes(10, n);  // of D(c) - c
    Eigen::MatrixXd changes_of_D(10, n);
    for (Eigen::Index k = 0; k < n; ++k) {
      const Step& step = steps_[static_cast<std::size_t>(k)];
      changes.col(k) = ((D - c) - (step.D - step.c)).cwiseQuotient(unit_);
      changes_of_D.col(k) = D - step.D;
    }
    steps_.push_back({c, D});
    if (n == 0) return D;
    const Moments more = changes_of_D * changes.completeOrthogonalDecomposition().solve((D - c).cwiseQuotient(unit_));
    // Differences that are noise lead nowhere.
    return more.cwiseQuotient(unit_).norm() < (D - c).cwiseQuotient(unit_).norm() ? Moments(D - more) : D;
  }

private:
  struct Step {
    Moments c;
    Moments D;
  };
  Moments unit_;
  std::vector<Step> steps_;
};

[[noreturn]] void throw_unsolved(const SolveReport& report) {
  throw Error(ErrorCode::solver, "The solver stopped before it converged: " + report.solver + " says " + report.solver_status +
                                     " after " + std::to_string(report.iterations) + " iterations with " +
                                     std::to_string(report.variables) + " variables. Try another resolution (--resolution).");
}

}  // namespace

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

Body::Body(Mesh mesh, const Eigen::Affine3d& frame, const HollowOptions& options, const Progress& progress)
    : outer(std::move(mesh)),
      to_working(frame),
      working(transformed(outer, to_working)),
      hull(outer_hull(working)),
      surface(working) {
  const bool has_sealed_cavities = hull.triangles.size() < working.triangles.size();
  hull = boundary_of_union(hull, progress);
  solid = mesh_moments(has_sealed_cavities ? boundary_of_union(working, progress) : hull);
  const Eigen::AlignedBox3d box = bounding_box(working);
  size_mm = box.sizes().maxCoeff();
  diagonal_mm = box.diagonal().norm();
  height_mm = box.sizes().z();

  const InnerDomainOptions inside = inner_options(options, size_mm);
  if (inside.field_spacing_mm < size_mm / 1000)
    throw Error(ErrorCode::goal, "A wall of " + number(options.wall_mm, 3) + " mm is too thin to be resolved in a body " +
                                     number(size_mm, 1) + " mm long: choose at least " + number(size_mm / 500, 3) +
                                     " mm (--wall). If the body is not meant to be that long, set --unit or --size.");
  inner = inner_domain(surface, inside, progress);
  if (inner.rays.intervals.empty()) throw Error(ErrorCode::goal, nothing_inside(options, progress));
  integrals.emplace(inner.rays);
  shell = solid - integrals->full();
}

bool Body::refine(const HollowOptions& options, const Progress& progress) {
  const double finest_mm = std::max(0.25 * options.wall_mm, size_mm / 1000);
  if (inner.field.spacing_mm < 1.2 * finest_mm) return false;
  progress.begin("domain");
  InnerDomainOptions finer = inner_options(options, size_mm);
  finer.field_spacing_mm = finest_mm;
  inner.field = inner_domain(surface, finer, progress).field;
  return true;
}

std::string Body::nothing_inside(const HollowOptions& options, const Progress& progress) const {
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

Moments solve_as_built(Body& body, InteriorSolver solver, const HollowOptions& options,
                       const std::function<double(const Moments&)>& error, HollowResult& hollow, const Progress& progress,
                       const Moments& start) {
  Feedback feedback(moment_units(body.solid[M1], body.diagonal_mm));
  Moments correction = start;
  Moments best_correction = correction;
  hollow.as_built_error = std::numeric_limits<double>::infinity();
  double last_error = 0.1;
  Built built(body, options);
  const auto start_finer = [&] {
    if (!body.refine(options, progress)) return false;
    built.discard();
    feedback.forget();
    correction = start;
    return true;
  };
  for (int pass = 1; pass <= options.max_passes; ++pass) {
    progress.begin("solve");
    InteriorSolver::Solved solved = solver.solve(body.shell + correction, progress);
    hollow.solver_iterations += solved.report.iterations;
    if (solved.report.status != SolveStatus::converged) {
      if (pass == 1) throw_unsolved(solved.report);
      // At the edge of what can be met a coarse mesh asks for more than there is.
      if (!start_finer()) break;
      continue;
    }
    hollow.passes = pass;

    progress.begin("mesh");
    const bool had_followed = built.followed();
    built.build(solved.q);
    double e = error(built.moments());
    // A mesh that follows cannot tear, close or show what the quadric does away from it: where it folds, or the error stays, it is
    // made anew, if there is a pass left to make up for the change.
    const bool useless = had_followed && e > 0.9 * last_error;
    if (built.followed() && pass < options.max_passes && (useless || built.has_folded())) {
      built.discard();
      built.build(solved.q);
      e = error(built.moments());
    }
    if (!built.followed()) feedback.forget();
    if (e < hollow.as_built_error) {
      hollow.as_built_error = e;
      best_correction = correction;
      hollow.solve = std::move(solved.report);
      hollow.q = solved.q;
      hollow.delivered = built.delivered();
      hollow.cavities = built.cavity().cavities;
      hollow.filled_cavities = built.cavity().filled;
      hollow.filled_mm3 = built.cavity().filled_mm3;
      hollow.removed_islands = built.cavity().removed_islands;
    }
    if (hollow.as_built_error <= options.as_built_tolerance) break;
    // Meshed, and not much nearer than before (in the first pass 2 %): the cavities are too thin for this grid.
    const bool stuck = !built.followed() && e > std::max(1e-3, 0.2 * last_error);
    last_error = e;
    if (stuck && start_finer()) continue;
    correction = feedback.next(correction, correction + built.moments() - solved.model);
  }
  hollow.cast = body.inner.cast;
  hollow.dropped_components = body.inner.dropped_components;
  hollow.ray_spacing_mm = body.inner.rays.grid.spacing_mm;
  hollow.field_spacing_mm = body.inner.field.spacing_mm;
  hollow.to_working = body.to_working;
  return best_correction;
}

}  // namespace rayrep::detail
