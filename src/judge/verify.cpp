#include "rayrep/judge/verify.h"

#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <vector>

#include "base/text.h"
#include "judge/figures.h"
#include "judge/verify_detail.h"
#include "rayrep/base/error.h"
#include "rayrep/mesh/mesh_check.h"

namespace rayrep {
namespace {

using namespace verify_detail;

constexpr double kInfinity = std::numeric_limits<double>::infinity();

// How releases tilted in several directions end, into FloatState::settles and settled_tilt_rad.
void settle_body(const Mesh& hull, const FloatSpec& spec, const Limits& limits, const Progress& progress, FloatState& state) {
  const Eigen::Vector3d up = spec.up.normalized();
  const Eigen::Vector3d side = up.unitOrthogonal();
  FloatingRestOptions options;
  options.fluid_g_cm3 = spec.fluid_g_cm3;
  std::vector<FloatingRest> rests(std::max(limits.release_directions, 0));
  const auto release = [&](std::size_t k) {
    const double azimuth = 2 * std::numbers::pi * static_cast<double>(k) / static_cast<double>(rests.size());
    const Eigen::Vector3d towards = std::cos(azimuth) * side + std::sin(azimuth) * up.cross(side);
    const Eigen::Vector3d start = std::cos(limits.release_tilt_rad) * up + std::sin(limits.release_tilt_rad) * towards;
    rests[k] = floating_rest(hull, state.body.mass_g, state.body.centre_of_mass_mm, start, options);
  };
  // One release per thread at a time, so that an interrupt is seen between them.
  const auto batch = static_cast<std::size_t>(std::max(1, tbb::this_task_arena::max_concurrency()));
  for (std::size_t first = 0; first < rests.size(); first += batch) {
    progress.check();
    tbb::parallel_for(first, std::min(first + batch, rests.size()), release);
  }
  for (const FloatingRest& rest : rests) {
    if (rest.rests())
      state.settled_tilt_rad = std::max(state.settled_tilt_rad, std::atan2(rest.up.cross(up).norm(), rest.up.dot(up)));
    else if (state.settles != FloatingRest::Outcome::sinks)
      state.settles = rest.outcome;
  }
}

// What is looked at.
struct Judged {
  const Mesh& body;   // the whole mesh, vertices merged
  const Mesh& outer;  // of these, what can bound the fluid; sealed cavities are left out of it
  const Mesh& material;
  bool closed;  // whether the winding number of `body` means anything
};

// How it is looked at.
struct Judging {
  const Limits& limits;
  bool settle;
  const Progress& progress;
};

FloatState state_of(const Judged& judged, const FloatSpec& spec, const Judging& judging) {
  const auto& [body, outer, material, closed] = judged;
  const Progress& progress = judging.progress;
  const Eigen::Vector3d up = spec.up.normalized();
  FloatState state;
  state.body = mass_properties(material, spec.print.density_g_cm3);

  // Cavities go before the union is taken: shells are whole only as long as nothing has been cut.
  Mesh hull = outer_hull(outer);
  if (closed && material.triangles != body.triangles) hull = outer_hull(boundary_of_union(hull, progress));
  const Waterplane plane{up, lowest_along(body, up) + *spec.waterline_mm};
  state.water = hydrostatics(hull, plane);
  state.displaced_mass_g = spec.fluid_g_cm3 * 1e-3 * state.water.displaced_volume_mm3;
  state.mass_error =
      state.displaced_mass_g > 0 ? std::abs(state.body.mass_g - state.displaced_mass_g) / state.displaced_mass_g : kInfinity;
  const Eigen::Vector3d arm = state.body.centre_of_mass_mm - state.water.centre_of_buoyancy_mm;
  state.horizontal_offset_mm = (arm - up.dot(arm) * up).norm();
  state.metacentric_height_mm = state.water.metacentric_radius_mm() - up.dot(arm);
  if (judging.settle) settle_body(hull, spec, judging.limits, judging.progress, state);
  return state;
}

// The spec with its waterline filled in: of a fraction of the height, or where the body displaces its own mass.
// @param mesh  vertices merged
FloatSpec at_its_waterline(const Mesh& mesh, bool closed, FloatSpec spec, const Progress& progress) {
  if (spec.waterline_mm) return spec;
  const Mesh standing = transformed(mesh, working_frame(mesh, spec.up));
  if (spec.submerged_fraction) {
    spec.waterline_mm = *spec.submerged_fraction * bounding_box(standing).sizes().z();
    spec.submerged_fraction.reset();
    return spec;
  }
  if (!closed)
    throw Error(ErrorCode::input,
                "The surface is not closed, so that there is no waterline at which it displaces its own mass: name one "
                "(--waterline), or repair the mesh.");
  const Mesh hull = boundary_of_union(outer_hull(standing), progress);
  const double displaced_mm3 =
      mesh_moments(boundary_of_union(standing, progress))[M1] * spec.print.density_g_cm3 / spec.fluid_g_cm3;
  spec.waterline_mm = waterline_for_volume(hull, Eigen::Vector3d::UnitZ(), displaced_mm3);
  return spec;
}

Figures figures_of(const FloatState& state, const FloatSpec& spec) {
  const Eigen::Vector3d up = spec.up.normalized();
  Figures figures = body_figures(state.body, "mass");
  const auto add = [&figures](Figure figure) { figures.push_back(std::move(figure)); };
  add({.name = "displaced_mass_g", .words = "displaced at the waterline", .unit = Unit::g, .value = state.displaced_mass_g});
  add({.name = "mass_error", .words = "", .value = state.mass_error});
  add({.name = "centre_of_buoyancy_mm", .words = "", .unit = Unit::mm, .value = list(state.water.centre_of_buoyancy_mm)});
  add({.name = "centre_of_mass_above_buoyancy_mm",
       .words = "centre of mass above centre of buoyancy",
       .unit = Unit::mm,
       .value = up.dot(state.body.centre_of_mass_mm - state.water.centre_of_buoyancy_mm)});
  add({.name = "waterplane_area_mm2", .words = "", .unit = Unit::mm2, .value = state.water.waterplane_area_mm2});
  add({.name = "waterplane_smallest_second_moment_mm4",
       .words = "",
       .unit = Unit::mm4,
       .value = state.water.smallest_second_moment_mm4});
  add({.name = "horizontal_offset_mm",
       .words = "horizontal offset between the two",
       .unit = Unit::mm,
       .value = state.horizontal_offset_mm,
       .digits = 5});
  add({.name = "metacentric_height_mm", .words = "metacentric height", .unit = Unit::mm, .value = state.metacentric_height_mm});
  // Of a body without pockets a table says nothing of them.
  const bool dry = state.water.dry_interior_mm3 > 0;
  add({.name = "dry_interior_mm3",
       .words = dry ? "dry interior" : "",
       .unit = Unit::mm3,
       .value = state.water.dry_interior_mm3,
       .digits = 1});
  Figure freeboard{.name = "freeboard_mm", .words = dry ? "its rim above the water" : "", .unit = Unit::mm, .value = {}};
  if (state.water.freeboard_mm) freeboard.value = *state.water.freeboard_mm;
  add(freeboard);
  const bool rests = state.settles == FloatingRest::Outcome::rests;
  const bool sinks = state.settles == FloatingRest::Outcome::sinks;
  add({.name = "settles", .words = "", .value = std::string(rests ? "rests" : sinks ? "sinks" : "does not come to rest")});
  Figure settled{.name = "settled_tilt_rad",
                 .words = "settles at a tilt of",
                 .unit = Unit::rad,
                 .value = {},
                 .none = sinks ? "sinks" : "does not come to rest"};
  if (rests) settled.value = state.settled_tilt_rad;
  add(settled);
  return figures;
}

void describe(FloatVerdict& verdict) {
  const FloatSpec& spec = verdict.spec;
  verdict.goal = FloatSpec::kGoal;
  verdict.body = verdict.state.body;
  verdict.figures = figures_of(verdict.state, spec);
  verdict.headline = "waterline " + number(*spec.waterline_mm, 3) + " mm above the lowest point" +
                     (spec.waterline_searched ? " (found: the largest metacentric height)" : "") + ", fluid " +
                     shown(spec.fluid_g_cm3) + " g/cm3, " + print_words(spec.print);
  verdict.wanted = {{.name = "up", .words = "", .value = list(spec.up)},
                    {.name = "waterline_mm", .words = "", .unit = Unit::mm, .value = *spec.waterline_mm},
                    {.name = "waterline_searched", .words = "", .value = spec.waterline_searched},
                    {.name = "fluid_g_cm3", .words = "", .unit = Unit::g_cm3, .value = spec.fluid_g_cm3}};
  add_print(spec.print, verdict.wanted);
}

}  // namespace

bool Verdict::pass() const {
  return std::all_of(criteria.begin(), criteria.end(), [](const Criterion& c) { return c.pass(); });
}

FloatState float_state(const Mesh& mesh, const FloatSpec& spec, const Limits& limits, bool settle, const Progress& progress) {
  check(spec, Setting::For::judging);
  const Mesh merged = merged_mesh(mesh);
  const bool closed = unbalanced_edges(merged) == 0;
  return state_of({merged, merged, material_of(merged, closed, progress), closed}, at_its_waterline(merged, closed, spec, progress),
                  {limits, settle, progress});
}

FloatVerdict verify(const Mesh& delivered, const Mesh* original, const FloatSpec& spec, const Limits& limits,
                    const Progress& progress) {
  check(spec, Setting::For::judging);
  FloatVerdict verdict;
  const Surface surface = judge_surface(delivered, original, progress, verdict);
  const bool closed = Surface::closed(verdict);
  verdict.spec = at_its_waterline(surface.mesh, closed, spec, progress);
  verdict.state = state_of({surface.mesh, surface.outer, surface.material, closed}, verdict.spec, {limits, true, progress});
  add_surface_criteria(surface, original != nullptr, spec.print.wall_mm, limits.wall_ratio, verdict);

  const FloatState& state = verdict.state;
  const double diagonal = surface.diagonal_mm;
  if (state.body.mass_g > 0 && state.displaced_mass_g == 0)
    verdict.notes.push_back("At this waterline the body displaces nothing.");
  auto& criteria = verdict.criteria;
  criteria.push_back(at_most("mass_error", "mass against displaced mass, relative", state.mass_error, limits.mass_error));
  criteria.push_back(at_most("offset", "horizontal offset of the centres, over the diagonal", state.horizontal_offset_mm / diagonal,
                             limits.offset_over_diagonal));
  // Below this a body may be neutral: floating_rest leaves it as it is.
  criteria.push_back(
      at_least("metacentric_height", "metacentre above centre of mass, mm", state.metacentric_height_mm, 1e-4 * diagonal));
  const bool rests = state.settles == FloatingRest::Outcome::rests;
  criteria.push_back(at_most("settled_tilt", "largest tilt at rest after tilted releases, rad",
                             rests ? state.settled_tilt_rad : std::numeric_limits<double>::quiet_NaN(), limits.settled_tilt_rad));
  describe(verdict);
  return verdict;
}

Figures state_figures(const Mesh& mesh, const FloatSpec& spec, const Limits& limits, const Progress& progress) {
  return figures_of(float_state(mesh, spec, limits, true, progress), spec);
}

Verdict verify(const Mesh& delivered, const Mesh* original, const Spec& spec, const Limits& limits, const Progress& progress) {
  return std::visit([&](const auto& s) -> Verdict { return verify(delivered, original, s, limits, progress); }, spec);
}

Figures state_figures(const Mesh& mesh, const Spec& spec, const Limits& limits, const Progress& progress) {
  return std::visit([&](const auto& s) { return state_figures(mesh, s, limits, progress); }, spec);
}

}  // namespace rayrep
