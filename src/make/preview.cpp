#include "rayrep/make/preview.h"

#include <algorithm>
#include <utility>
#include <variant>

#include "make/as_built.h"
#include "make/fixed.h"
#include "make/kept_bodies.h"
#include "make/plan.h"
#include "make/self_supporting.h"
#include "rayrep/base/error.h"
#include "rayrep/mesh/mesh_check.h"
#include "rays/positive_part.h"

namespace rayrep {
namespace {

/// What takes more than one plan.
void refuse_whole_runs(const Spec& spec) {
  const TargetSpec* target = std::get_if<TargetSpec>(&spec);
  const bool determined =
      target && std::all_of(target->wanted.begin(), target->wanted.end(), [](const auto& w) { return w.has_value(); });
  if (print_of(spec).balls.wanted() || determined)
    throw Error(ErrorCode::usage, std::string(determined ? "A body with all ten numbers given" : "A body with balls in it") +
                                      " is found by a whole run only: there is no preview of it.");
}

detail::Plan plan_of(const Mesh& solid, const Spec& spec, const HollowOptions& options, const Progress& progress) {
  if (print_of(spec).self_supporting_deg > 0) return detail::plan_self_supporting(solid, spec, options, progress);
  return std::visit([&](const auto& s) { return detail::plan(solid, s, options, progress); }, spec);
}

}  // namespace

Previewer::Previewer(Mesh solid) : solid_(std::move(solid)), kept_(std::make_shared<detail::KeptBodies>()) {}
Previewer::~Previewer() = default;

Preview Previewer::look(const Spec& spec, HollowOptions options, const Progress& progress) {
  options.solver = Solver::quadric;
  options.as_printed = nullptr;
  options.look_only = true;
  options.kept = kept_;
  detail::check(options, spec);
  std::visit([](const auto& s) { check(s, Setting::For::making); }, spec);
  require_size(solid_);
  refuse_whole_runs(spec);
  detail::require_room(options.fixed, solid_, print_of(spec).wall_mm, progress);
  const detail::Plan plan = plan_of(solid_, spec, options, progress);
  const detail::Body& body = *plan.body;
  InteriorSolver solver(plan.goal, body.inner.rays, *body.integrals, plan.setup);
  progress.begin("solve");
  const InteriorSolver::Solved solved = solver.solve(body.shell, progress);
  if (solved.report.status != SolveStatus::converged) throw detail::unsolved(solved.report);
  Preview preview;
  preview.spec = plan.spec;
  preview.moments = moment_map(body.to_working.inverse()) * solved.model;
  preview.outside = body.outer;
  preview.to_working = body.to_working;
  preview.voids = positive_part(body.inner.rays, solved.q);
  return preview;
}

}  // namespace rayrep
