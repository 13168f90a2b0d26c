#include "rayrep/make/hollow.h"

#include <algorithm>

#include "make/as_built.h"
#include "make/as_printed.h"
#include "make/balls.h"
#include "make/core_maker.h"
#include "make/cut_maker.h"
#include "make/drained_maker.h"
#include "make/fixed.h"
#include "make/plan.h"
#include "make/self_supporting.h"
#include "make/yoyo.h"
#include "rayrep/base/error.h"
#include "rayrep/mesh/mesh_check.h"
#include "rayrep/physics/axle.h"

namespace rayrep {
namespace detail {
namespace {

/// @param exact  a correction is wanted for a neighbouring wall, with which the cavity is compared
std::unique_ptr<Maker> maker_for(Plan& plan, const HollowOptions& options, const Progress& progress, bool exact) {
  Body& body = *plan.body;
  const Print& print = print_of(plan.spec);
  if (print.core.wanted()) return std::make_unique<CoreMaker>(body, print, options, progress);
  const CavityMaker::By by = exact ? CavityMaker::By::grid : CavityMaker::By::cut;
  std::unique_ptr<Maker> maker = std::make_unique<CavityMaker>(body, print, options, progress, by);
  if (print.cut.wanted()) return cut_maker(std::move(maker), body, print_of(plan.spec), progress);
  const SpinSpec* spin = std::get_if<SpinSpec>(&plan.spec);
  if (spin && has_axle(spin->axle)) return yoyo_maker(std::move(maker), *spin);
  return maker;
}

/// @throws Error{usage} for what does not go with a body in pieces
void check_pieces(const HollowOptions& options, const Spec& spec) {
  const SpinSpec* spin = std::get_if<SpinSpec>(&spec);
  const bool halves = spin && has_axle(spin->axle);
  if (!halves && !print_of(spec).cut.wanted()) return;
  const std::string instead = halves ? " out, or say --axle none: then it is made in one piece." : " or --cut out.";
  if (options.as_printed)
    throw Error(ErrorCode::usage, "A body in pieces is not fitted to a slicer's print: leave the slicer" + instead);
  if (!options.fixed.empty())
    throw Error(ErrorCode::usage, "A body in pieces has nothing fixed in it that the print is paused for: leave --fixed" + instead);
}

/// Resin that stays takes more of them. Where roofs are carried there are as many as that already.
int passes(const Print& print, const HollowOptions& options) {
  const bool floods = print.drains.wanted() && print.liquid_g_cm3 > 0 && !print.drained;
  return floods && options.pillars.empty() ? 3 * options.max_passes : options.max_passes;
}

}  // namespace

HollowResult carry_out(Plan& plan, const HollowOptions& options, const Progress& progress, Moments* correction) {
  Body& body = *plan.body;
  HollowResult result;
  const Print& print = print_of(plan.spec);
  std::unique_ptr<Maker> maker = maker_for(plan, options, progress, correction != nullptr);
  const DrainedMaker* drained = nullptr;
  if (print.drains.wanted()) {
    auto with_holes = std::make_unique<DrainedMaker>(std::move(maker), body, plan.spec, options, progress);
    drained = with_holes.get();
    maker = std::move(with_holes);
  }
  const AsBuilt problem{body.shell,
                        moment_units(body.solid[M1], body.diagonal_mm),
                        plan.error,
                        plan.start,
                        passes(print, options),
                        options.as_built_tolerance};
  const InteriorSolver solver(plan.goal, body.inner.rays, *body.integrals, plan.setup);
  result.to_working = body.to_working;
  AsPrinted printing{problem, options, {}};
  if (plan.give_way)
    printing.give_way = [&plan](const Moments& printed) {
      plan.give_way(plan, printed);  // the solver follows: it refers to the plan's goal
      return plan.error;
    };
  const Moments found = options.as_printed ? solve_as_printed(printing, solver, *maker, result, progress)
                                           : solve_as_built(problem, solver, *maker, result, progress);
  if (correction) *correction = found;
  result.spec = plan.spec;
  if (drained) print_of(result.spec).drains.points_mm = drained->mouths();
  result.cast = body.inner.cast;
  result.dropped_components = body.inner.dropped_components;
  result.ray_spacing_mm = body.inner.rays.grid.spacing_mm;
  result.field_spacing_mm = body.inner.field.spacing_mm;
  result.wall_mm = print_of(plan.spec).wall_mm;
  plan.prove(plan, body.shell + found, result);
  return result;
}

HollowOptions on_few_rays(const HollowOptions& options) {
  constexpr int kFewRays = 80;  // along the longest side
  HollowOptions few = options;
  few.resolution = std::min(options.resolution, kFewRays);
  few.as_printed = nullptr;
  few.look_only = true;
  return few;
}

Mesh stored(const Mesh& solid, const HollowOptions& options) {
  const Mesh mesh = with_rooms(solid, options.fixed);
  return options.as_stored ? options.as_stored(mesh) : mesh;
}

std::shared_ptr<Body> upright_body(const Mesh& solid, const Eigen::Vector3d& up, const Discretisation& discretised,
                                   const HollowOptions& options, const Progress& progress) {
  progress.begin("domain");
  Mesh outer = stored(solid, options);
  const Eigen::Affine3d frame = working_frame(outer, up);
  return resolved_body(std::move(outer), frame, discretised, progress);
}

/// With something in it whose place counts from the ground: the base is cut first.
HollowResult hollow_flattened(const Mesh& solid, const StandSpec& spec, const HollowOptions& options, const Progress& progress) {
  const double cut_mm = std::get<StandSpec>(plan(solid, spec, options, progress).spec).flatten_mm;
  StandSpec on_base = spec;
  on_base.flatten_mm = 0;
  HollowResult result = hollow(flattened(solid, spec.up, cut_mm, progress), on_base, options, progress);
  std::get<StandSpec>(result.spec).flatten_mm = cut_mm;
  return result;
}

namespace {

/// By the way that such a spec asks for.
HollowResult made_of(const Mesh& solid, const Spec& spec, const HollowOptions& options, const Progress& progress) {
  if (print_of(spec).self_supporting_deg > 0) return hollow_self_supporting(solid, spec, options, progress);
  if (const TargetSpec* target = std::get_if<TargetSpec>(&spec))
    if (const auto result = hollow_determined(solid, *target, options, progress)) {
      if (!options.as_printed) return *result;
      throw Error(
          ErrorCode::usage,
          "A body with all ten numbers given cannot be fitted to what a slicer lays down: leave one of them open, or slice it "
          "yourself (rayrep measure tells what came of it).");
    }
  Plan planned = std::visit([&](const auto& s) { return plan(solid, s, options, progress); }, spec);
  return carry_out(planned, options, progress);
}

}  // namespace
}  // namespace detail

Settings settings(HollowOptions& options, const Spec& spec) {
  Settings rows = {
      {.name = "resolution",
       .value = "N",
       .words = "rays along the longest side, 20 to 1000",
       .details = "",
       .place = &options.resolution,
       .range = {.lo = 20, .hi = 1000, .open = false}},
      {.name = "bounds",
       .value = "B",
       .words = "of --solver rays: complete, or the paper's: paper",
       .details = "Which segments of material a ray may hold: any one, or none (complete), or only those around the middle of its "
                  "interval (paper). --bounds paper means --solver rays.",
       .place = choice("bounds", options.bounds, kSegmentBoundsNames),
       .rare = true},
      {.name = "solver",
       .value = "NAME",
       .words = "quadric (exact), or by Ipopt: rays (the paper's), voxels, octree",
       .details =
           "quadric is exact on the rays. The others are there to compare with: rays (the ray-reps paper's), voxels and octree.",
       .place = choice("solver", options.solver, kSolverNames),
       .rare = true}};
  std::erase_if(rows, [&spec](const Setting& row) {
    return (row.name == "bounds" && !std::holds_alternative<SpinSpec>(spec)) ||
           (row.name == "solver" && (std::holds_alternative<TargetSpec>(spec) || std::holds_alternative<PoseSpec>(spec) ||
                                     std::holds_alternative<DiceSpec>(spec)));
  });
  return rows;
}

HollowResult hollow(const Mesh& solid, const Spec& spec, const HollowOptions& options, const Progress& progress) {
  detail::check(options, spec);
  std::visit([](const auto& s) { check(s, Setting::For::making); }, spec);
  detail::check_pieces(options, spec);
  require_size(solid);
  if (const auto* stand = std::get_if<StandSpec>(&spec);
      stand && stand->flatten_mm > 0 && (!options.fixed.empty() || stand->print.balls.wanted()))
    return detail::hollow_flattened(solid, *stand, options, progress);
  detail::require_room(options.fixed, solid, print_of(spec).wall_mm, progress);
  detail::require_kept(options.keep_solid, solid, progress);
  if (print_of(spec).balls.wanted()) return detail::hollow_with_balls(solid, spec, options, progress);
  if (!options.fixed.empty() && options.pauses_mm.empty()) {
    HollowOptions paused = options;
    paused.pauses_mm = detail::pauses_mm(options.fixed, solid, up_of(spec));
    return hollow(solid, spec, paused, progress);
  }
  HollowResult result = detail::made_of(solid, spec, options, progress);
  detail::require_held(options, solid, result);
  return result;
}

}  // namespace rayrep
