#include <algorithm>
#include <cmath>
#include <numbers>

#include "base/text.h"
#include "make/plan.h"
#include "make/spin_search.h"
#include "make/yoyo.h"
#include "rayrep/base/error.h"
#include "rayrep/make/waterline.h"
#include "rayrep/physics/axle.h"

namespace rayrep::detail {
namespace {

/// Why a body that can be balanced does not spin for all that.
Error tumbles(const Moments& s, bool largest) {
  const SpinState state = spin_state(mass_properties(s, 1), Eigen::Vector3d::Zero(), Eigen::Vector3d::UnitZ());
  const std::string other = largest ? "larger" : "smaller";
  return {ErrorCode::goal,
          "It can be balanced about this axis, but would not spin stably: at best its moment of inertia about the axis is " +
              number(largest ? state.ratio_larger : state.ratio_smaller, 4) + " times the " + other +
              " of the two across it, and must be " + (largest ? "more" : "less") + " than that one. " +
              (state.axis_class == AxisClass::middle ? "A body tumbles about an axis of middle moment."
               : largest                             ? "It is the axis of its smallest moment: see --prefer smallest."
                                                     : "It is the axis of its largest moment: see --prefer largest.")};
}

/// What a judge is to hold it to.
SpinSpec filled_in(SpinSpec spec, const SpinFrame& frame) {
  spec.up = frame.up;
  if (spec.yoyo) {
    spec.centre_mm = frame.contact_mm;
  } else {
    spec.axis.through = SpinAxis::Through::point;
    spec.axis.leaves_below = false;
    spec.axis.point_mm = frame.contact_mm;
  }
  return spec;
}

/// The solver's options: Ipopt stays on the central path, where spin problems converge. theory.md (26)
InteriorSolver::Setup setup_of(const SpinSpec& spec, const HollowOptions& options, const InteriorNlp::Scale& scale) {
  InteriorSolver::Setup setup;
  setup.solver = options.solver;
  setup.segments = true;
  setup.bounds = options.bounds;
  setup.between = spec.prefer == AxisClass::largest ? Between::material : Between::cavity;
  setup.start_fill = options.start_fill;
  setup.scale = scale;
  setup.options = options.solve;
  setup.options.tolerance = std::max(options.solve.tolerance, 1e-6);
  setup.options.barrier_target = 1e-7;
  setup.options.max_iterations = std::min(options.solve.max_iterations, 200);
  return setup;
}

void prove(const Plan& plan, const Moments&, HollowResult& result) {
  result.certificate = plan.certificate;
  if (!result.certificate) return;
  const SpinCertificate& c = *result.certificate;
  result.proof = {"no interior on these rays does better than " + number(c.lower_bound, 6) + ", this one " +
                  number(c.best.objective, 6) + ": within " + scientific(std::max(c.gap, 1e-9)) +
                  " of the global optimum (proven, " + std::to_string(c.nodes) + " heights)"};
  result.proof_figures = {{.name = "certificate", .words = "", .value = record_of(c)}};
}

}  // namespace

Record record_of(const SpinCertificate& certificate) {
  return {{"objective", certificate.best.objective},
          {"lower_bound", certificate.lower_bound},
          {"gap", certificate.gap},
          {"closed", certificate.closed},
          {"nodes", static_cast<double>(certificate.nodes)},
          {"evaluations", static_cast<double>(certificate.evaluations)}};
}

Error unbalanced(const Body& body, const SpinSpec& spec, const Goal& goal) {
  const NearestSolution nearest = nearest_attainable(goal, *body.integrals, body.shell, 1e-6);
  if (nearest.attainable)
    return {ErrorCode::goal, "It cannot be balanced about this axis with so little core." + scarce_words(body.inner.rays.grid)};
  const Moments& s = nearest.moments;
  const double offset = (spec.yoyo ? s.segment<3>(MX).norm() : s.segment<2>(MX).norm()) / s[M1];
  const double products = Eigen::Vector2d(s[MXZ], s[MYZ]).norm() / s[M1];
  return {ErrorCode::goal, "It cannot be balanced about this axis: no interior on these rays brings the centre of mass onto " +
                               std::string(spec.yoyo ? "the centre" : "the axis") +
                               " and makes the products of inertia vanish (proven). The centre of mass alone comes to within " +
                               number(smallest_offset_mm(body.inner.rays, body.shell, std::nullopt, {0, 0}), 3) +
                               " mm of the axis; where the static moment and the products together are smallest, it lies " +
                               number(offset, 3) + " mm beside it, the mass is " +
                               number(s[M1] * spec.print.density_g_cm3 / 1000, 2) + " g and the products are " +
                               number(products, 3) + " mm2 per unit of mass."};
}

SpinWeights weights_of(const SpinSpec& spec) {
  SpinWeights weights{.lambda = 0, .gamma_c = 0, .gamma_i = spec.gamma_i};
  if (spec.yoyo) return weights;
  (spec.objective == SpinSpec::Objective::rayreps ? weights.lambda : weights.gamma_c) =
      spec.objective == SpinSpec::Objective::rayreps ? spec.lambda : spec.gamma_c;
  return weights;
}

Plan plan(const Mesh& solid, const SpinSpec& spec, const HollowOptions& options, const Progress& progress) {
  progress.begin("domain");
  Mesh outer = stored(solid, options);
  const SpinFrame axis = spin_frame(outer, spec, discretisation(spec.print, options), progress);
  progress.begin("domain");
  Plan plan;
  const SpinSpec placed = filled_in(spec, axis);
  plan.spec = placed;
  Discretisation inside = discretisation(spec.print, options);
  if (has_axle(spec.axle)) {
    outer = outside_of_halves(outer, placed, progress);
    inside.fixed += axle_moments(placed);
  }
  plan.body = body_about(axis, std::move(outer), inside, progress);
  const Body& body = *plan.body;
  const InteriorNlp::Scale scale{body.solid[M1], body.diagonal_mm};
  const bool largest = spec.prefer == AxisClass::largest;
  const Goal goal = spin_goal(weights_of(spec), largest, spec.yoyo, scale.volume_mm3, scale.length_mm);
  progress.begin("solve");
  const QuadricSolution exact = solve_quadric(goal, *body.integrals, body.shell);
  if (exact.infeasible) throw unbalanced(body, spec, goal);
  // What was solved to see whether it can be done is where the first pass starts.
  const QuadricSolution* known = &exact;
  if (spec.certify) {
    const Eigen::AlignedBox3d box = bounding_box(body.working);
    plan.certificate = certify_spin({.lambda = weights_of(spec).lambda,
                                     .gamma_i = spec.gamma_i,
                                     .yoyo = spec.yoyo,
                                     .volume_mm3 = scale.volume_mm3,
                                     .length_mm = scale.length_mm},
                                    *body.integrals, body.shell, {.heights = {box.min().z(), box.max().z()}}, progress);
    known = &plan.certificate->best;
  }
  plan.setup = setup_of(spec, options, scale);
  if (known->converged) {
    if (!spins_as_wanted(known->moments, largest)) throw tumbles(known->moments, largest);
    plan.setup.warm.moments = known->moments;
    plan.setup.warm.multipliers = known->multipliers;
  }
  plan.goal = goal;
  plan.error = [yoyo = spec.yoyo, L = scale.length_mm](const Moments& s) {
    const double m = s[M1];
    const double products = Eigen::Vector2d(s[MXZ], s[MYZ]).norm() / (m * L * L);
    const double offset = (yoyo ? s.segment<3>(MX).norm() : s.segment<2>(MX).norm()) / (m * L);
    return std::max(offset, products);
  };
  plan.prove = prove;
  return plan;
}

}  // namespace rayrep::detail
