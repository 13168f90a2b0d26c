#include "rayrep/judge/verify.h"

#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>
#include <numbers>
#include <vector>

#include "base/rotation.h"
#include "base/text.h"
#include "judge/drains.h"
#include "judge/figures.h"
#include "judge/inserts.h"
#include "judge/pieces.h"
#include "judge/righting.h"
#include "judge/verify_detail.h"
#include "rayrep/base/error.h"
#include "rayrep/mesh/assembly.h"
#include "rayrep/mesh/boolean.h"
#include "rayrep/mesh/mesh_check.h"

namespace rayrep {
namespace {

using namespace verify_detail;

constexpr double kInfinity = std::numeric_limits<double>::infinity();

// A body in the fluid.
struct Afloat {
  const PreparedHull& hull;
  double mass_g;
  const Eigen::Vector3d& centre_of_mass_mm;
};

// How releases tilted in several directions end: see FloatState::settles.
struct Settled {
  FloatingRest::Outcome how = FloatingRest::Outcome::rests;
  double tilt_rad = 0;
};

Settled settled(const Afloat& body, const FloatSpec& spec, const Limits& limits, const Progress& progress) {
  const Eigen::Vector3d up = spec.up.normalized();
  const Eigen::Vector3d side = up.unitOrthogonal();
  FloatingRestOptions options;
  options.fluid_g_cm3 = spec.fluid_g_cm3;
  std::vector<FloatingRest> rests(std::max(limits.release_directions, 0));
  const auto release = [&](std::size_t k) {
    const double azimuth = 2 * std::numbers::pi * static_cast<double>(k) / static_cast<double>(rests.size());
    const Eigen::Vector3d towards = std::cos(azimuth) * side + std::sin(azimuth) * up.cross(side);
    const Eigen::Vector3d start = std::cos(limits.release_tilt_rad) * up + std::sin(limits.release_tilt_rad) * towards;
    rests[k] = floating_rest(body.hull, body.mass_g, body.centre_of_mass_mm, start, options);
  };
  // One release per thread at a time, so that an interrupt is seen between them.
  const auto batch = static_cast<std::size_t>(std::max(1, tbb::this_task_arena::max_concurrency()));
  for (std::size_t first = 0; first < rests.size(); first += batch) {
    progress.check();
    tbb::parallel_for(first, std::min(first + batch, rests.size()), release);
  }
  Settled result;
  for (const FloatingRest& rest : rests) {
    if (rest.rests())
      result.tilt_rad = std::max(result.tilt_rad, angle_between(rest.up, up));
    else if (result.how != FloatingRest::Outcome::sinks)
      result.how = rest.outcome;
  }
  return result;
}

// What is looked at.
struct Judged {
  const Mesh& body;   // the whole mesh, vertices merged
  const Mesh& outer;  // of these, what can bound the fluid; sealed cavities are left out of it
  MassProperties mass;
  bool overlaps;  // bodies in it, so that only their union bounds anything
};

Judged judged(const Mesh& body, const Mesh& outer, const Mesh& material, const FloatSpec& spec) {
  return {body, outer, mass_properties(material, spec.print.density_g_cm3), material.triangles != body.triangles};
}

// How it is looked at.
struct Judging {
  const Limits& limits;
  enum Depth { afloat, settles, with_more_plastic } depth;  // each with all that comes before
  const Progress& progress;
};

// The body with more plastic, the same everywhere.
HeavierFloat with_more_plastic(double excess, const FloatState& state, const PreparedHull& hull, const FloatSpec& spec,
                               const Judging& judging) {
  const Eigen::Vector3d up = spec.up.normalized();
  HeavierFloat heavier;
  heavier.excess = excess;
  const double mass_g = (1 + excess) * state.body.mass_g;
  if (excess > state.buoyancy_reserve) {
    heavier.settles = FloatingRest::Outcome::sinks;
    return heavier;
  }
  heavier.waterline_mm = waterline_for_volume(hull, up, mass_g / (spec.fluid_g_cm3 * 1e-3)) - lowest_along(hull.mesh(), up);
  // The body as it is has been released in all directions: three tell whether this one still rights itself.
  Limits limits = judging.limits;
  limits.release_directions = std::min(limits.release_directions, 3);
  const Settled end = settled({hull, mass_g, state.body.centre_of_mass_mm}, spec, limits, judging.progress);
  heavier.settles = end.how;
  heavier.settled_tilt_rad = end.tilt_rad;
  return heavier;
}

bool rests_upright(const FloatState& state, const Limits& limits) {
  return state.settles == FloatingRest::Outcome::rests && state.settled_tilt_rad <= limits.settled_tilt_rad;
}

// The centres of mass and buoyancy, whose water is there, and what keeps it up.
void compare_centres(const PreparedHull& hull, const FloatSpec& spec, FloatState& state) {
  const Eigen::Vector3d up = spec.up.normalized();
  state.displaced_mass_g = spec.fluid_g_cm3 * 1e-3 * state.water.displaced_volume_mm3;
  state.mass_error =
      state.displaced_mass_g > 0 ? std::abs(state.body.mass_g - state.displaced_mass_g) / state.displaced_mass_g : kInfinity;
  const Eigen::Vector3d arm = state.body.centre_of_mass_mm - state.water.centre_of_buoyancy_mm;
  state.horizontal_offset_mm = (arm - up.dot(arm) * up).norm();
  state.metacentric_height_mm = state.water.metacentric_radius_mm() - up.dot(arm);
  state.buoyancy_reserve = largest_displacement_mm3(hull, up) * spec.fluid_g_cm3 * 1e-3 / state.body.mass_g - 1;
}

// Under water: the centre of mass hangs below the centre of buoyancy, whichever way the body was let go.
FloatState submerged_state(const PreparedHull& hull, const FloatSpec& spec, const Judging& judging, FloatState state) {
  state.water = submerged_hydrostatics(hull);
  compare_centres(hull, spec, state);
  if (state.body.mass_g > (1 + judging.limits.mass_error) * state.displaced_mass_g) state.settles = FloatingRest::Outcome::sinks;
  state.settled_tilt_rad = std::atan2(state.horizontal_offset_mm, state.metacentric_height_mm);
  if (judging.depth == Judging::with_more_plastic) state.righting = submerged_righting_curve(state.metacentric_height_mm);
  return state;
}

// On the weakest side, or on that over which water comes in first.
RightingCurve righting_of(const FloatingBody& body, const std::optional<FloodingHeel>& flooding) {
  RightingCurve weakest = weakest_righting_curve(body);
  if (!flooding || flooding->angle_rad >= weakest.range_rad) return weakest;
  RightingCurve flooded = righting_curve(body, -flooding->up);
  return flooded.range_rad < weakest.range_rad ? flooded : weakest;
}

FloatState state_of(const Judged& judged, const FloatSpec& spec, const Judging& judging) {
  const auto& [body, outer, mass, overlaps] = judged;
  const Progress& progress = judging.progress;
  const Eigen::Vector3d up = spec.up.normalized();
  FloatState state;
  state.body = mass;

  // Cavities go before the union is taken: shells are whole only as long as nothing has been cut.
  Mesh hull = outer_hull(outer);
  if (overlaps) hull = outer_hull(boundary_of_union(hull, progress));
  const PreparedHull prepared(std::move(hull));
  if (is_submerged(spec)) return submerged_state(prepared, spec, judging, std::move(state));
  state.water = hydrostatics(prepared, {up, lowest_along(body, up) + *spec.waterline_mm});
  compare_centres(prepared, spec, state);
  if (judging.depth == Judging::afloat) return state;
  if (judging.limits.release_directions == 0) {
    state.settled_tilt_rad = std::numeric_limits<double>::quiet_NaN();
    return state;
  }
  const Settled end = settled({prepared, state.body.mass_g, state.body.centre_of_mass_mm}, spec, judging.limits, progress);
  state.settles = end.how;
  state.settled_tilt_rad = end.tilt_rad;
  const FloatingBody afloat{prepared, state.body.mass_g / (spec.fluid_g_cm3 * 1e-3), state.body.centre_of_mass_mm, up};
  std::optional<FloodingHeel> flooding;
  if (state.water.dry_interior_mm3 > 0 && state.buoyancy_reserve >= 0) flooding = flooding_heel(prepared, afloat.volume_mm3, up);
  if (flooding) state.flooding_heel_rad = flooding->angle_rad;
  if (judging.depth != Judging::with_more_plastic || !rests_upright(state, judging.limits)) return state;
  progress.check();
  state.righting = righting_of(afloat, flooding);
  for (const double excess : judging.limits.too_heavy)
    state.heavier.push_back(with_more_plastic(excess, state, prepared, spec, judging));
  return state;
}

// The spec with its waterline filled in: of a fraction of the height, or where the body displaces its own mass. With one at the top
// or above the body is submerged; then there is none.
// @param mesh    vertices merged
// @param mass_g  none: the mesh's own
FloatSpec at_its_waterline(const Mesh& mesh, std::optional<double> mass_g, FloatSpec spec, const Progress& progress) {
  const double height_mm = -lowest_along(mesh, -spec.up.normalized()) - lowest_along(mesh, spec.up.normalized());
  if (is_submerged(spec) || (spec.waterline_mm && *spec.waterline_mm >= height_mm * (1 - 1e-9))) {
    spec.waterline_mm.reset();
    spec.submerged_volume_fraction.reset();
    spec.submerged_fraction = 1;
    return spec;
  }
  if (spec.waterline_mm) return spec;
  const Mesh standing = transformed(mesh, working_frame(mesh, spec.up));
  if (spec.submerged_fraction) {
    spec.waterline_mm = *spec.submerged_fraction * bounding_box(standing).sizes().z();
    spec.submerged_fraction.reset();
    return spec;
  }
  if (unbalanced_edges(mesh) > 0)
    throw Error(ErrorCode::input,
                "The surface is not closed, so that there is no waterline at which it displaces its own mass: name one "
                "(--waterline), or repair the mesh.");
  const Mesh hull = boundary_of_union(outer_hull(standing), progress);
  double displaced_mm3 = 0;
  if (spec.submerged_volume_fraction)
    displaced_mm3 = *spec.submerged_volume_fraction * mesh_moments(hull)[M1];
  else if (mass_g)
    displaced_mm3 = *mass_g / (spec.fluid_g_cm3 * 1e-3);
  else
    displaced_mm3 = mesh_moments(boundary_of_union(standing, progress))[M1] * spec.print.density_g_cm3 / spec.fluid_g_cm3;
  spec.submerged_volume_fraction.reset();
  spec.waterline_mm = waterline_for_volume(hull, Eigen::Vector3d::UnitZ(), displaced_mm3);
  return spec;
}

const char* words_of(FloatingRest::Outcome outcome) {
  return outcome == FloatingRest::Outcome::rests   ? "rests"
         : outcome == FloatingRest::Outcome::sinks ? "sinks"
                                                   : "does not come to rest";
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
  Figure flooding{.name = "flooding_heel_rad", .words = dry ? "takes water at a heel of" : "", .unit = Unit::rad, .value = {}};
  if (state.flooding_heel_rad) flooding.value = *state.flooding_heel_rad;
  add(flooding);
  add({.name = "settles", .words = "", .value = std::string(words_of(state.settles))});
  Figure settled{
      .name = "settled_tilt_rad", .words = "settles at a tilt of", .unit = Unit::rad, .value = {}, .none = words_of(state.settles)};
  if (state.settles == FloatingRest::Outcome::rests) settled.value = state.settled_tilt_rad;
  add(settled);
  add({.name = "buoyancy_reserve", .words = "", .value = state.buoyancy_reserve});
  return figures;
}

// For JSON.
std::vector<Record> records(const std::vector<HeavierFloat>& heavier) {
  std::vector<Record> all;
  for (const HeavierFloat& h : heavier) {
    const bool rests = h.settles == FloatingRest::Outcome::rests;
    all.push_back({{"excess", h.excess},
                   {"waterline_mm", h.waterline_mm ? Scalar(*h.waterline_mm) : Scalar()},
                   {"settles", std::string(words_of(h.settles))},
                   {"settled_tilt_rad", rests ? Scalar(h.settled_tilt_rad) : Scalar()}});
  }
  return all;
}

// "it floats 0.13 mm deeper and rests 0.01 degrees off upright"
std::string heavier_words(const HeavierFloat& heavier, const FloatVerdict& verdict, const Limits& limits) {
  if (heavier.settles != FloatingRest::Outcome::rests) return std::string("it ") + words_of(heavier.settles);
  const double waterline_mm = *heavier.waterline_mm;
  const bool at_its_waterline = verdict.state.mass_error <= limits.mass_error;
  return "it floats " +
         (at_its_waterline ? number(waterline_mm - *verdict.spec.waterline_mm, 2) + " mm deeper"
                           : number(waterline_mm, 2) + " mm deep") +
         " and rests " + degrees(heavier.settled_tilt_rad, 2) + " off upright";
}

// First of all, what it does.
void say(FloatVerdict& verdict, const Limits& limits) {
  const FloatState& state = verdict.state;
  std::string& text = verdict.meaning.emplace_back();
  const std::string upright = "It floats upright, " + number(*verdict.spec.waterline_mm, 2) + " mm deep";
  if (limits.release_directions == 0)
    text =
        state.metacentric_height_mm > 0 ? upright + "." : "It does not stay upright: its metacentre lies below its centre of mass.";
  else if (state.settles != FloatingRest::Outcome::rests)
    text = std::string("It ") + words_of(state.settles) + ".";
  else if (!rests_upright(state, limits))
    text = "It does not stay upright: it comes to rest " + degrees(state.settled_tilt_rad, 2) + " off upright.";
  else if (!(state.mass_error <= limits.mass_error))
    text = "It floats upright, but not at this waterline: there it would have to weigh " + number(state.displaced_mass_g, 2) +
           " g, and it weighs " + number(state.body.mass_g, 2) + " g.";
  else
    text = upright + ", and rights itself " + righting_words(*state.righting);
  if (state.flooding_heel_rad)
    text += " Water comes in over its rim when it is tilted by " + degrees(*state.flooding_heel_rad, 2) + ".";
}

// The same of a submerged body, and what a little too much or too little comes to.
void say_submerged(FloatVerdict& verdict, const Limits& limits) {
  const FloatState& state = verdict.state;
  const std::string weighs = "It weighs " + number(state.body.mass_g, 2) + " g, and wholly under water it displaces " +
                             number(state.displaced_mass_g, 2) + " g";
  std::string& text = verdict.meaning.emplace_back();
  if (!(state.mass_error <= limits.mass_error))
    text = weighs + (state.body.mass_g > state.displaced_mass_g ? ": it sinks." : ": it rises, and floats.");
  else if (!(state.metacentric_height_mm > 0))
    text = "It neither sinks nor rises, but its centre of mass lies above its centre of buoyancy: it hangs upside down.";
  else if (!rests_upright(state, limits))
    text = "It neither sinks nor rises, but hangs " + degrees(state.settled_tilt_rad, 2) + " off upright.";
  else
    text = "It hovers upright at any depth and rights itself from any heel. Its centre of mass hangs " +
           number(state.metacentric_height_mm, 2) +
           " mm below its centre of buoyancy: the arm that rights it is that times the sine of the heel.";
  verdict.meaning.push_back(
      "1 % of its mass is " + number(0.01 * state.body.mass_g, 2) +
      " g: so much more and it sinks to the ground, so much less and it rises to the surface. Prints come out "
      "1 to 2 % too heavy: weigh it, and trim it in the water it is for.");
}

// Whether it is held up by air in a pocket unless that is let out.
void note_pockets(FloatVerdict& verdict) {
  const FloatState& state = verdict.state;
  const double held_g = (1 + state.buoyancy_reserve) * state.body.mass_g - state.displaced_mass_g;
  if (held_g > 1e-3 * state.displaced_mass_g)
    verdict.notes.push_back("An open hollow of it must be full of water: with air in it, it carries " + number(held_g, 2) +
                            " g more and floats.");
}

// The criterion reserve, and what it means.
void judge_reserve(FloatVerdict& verdict, const Limits& limits) {
  const std::vector<HeavierFloat>& heavier = verdict.state.heavier;
  if (heavier.empty()) return;
  const HeavierFloat& often = heavier.front();
  verdict.criteria.push_back(
      at_most("reserve", "the same with " + rough_percent(often.excess) + " more plastic everywhere, rad",
              often.settles == FloatingRest::Outcome::rests ? often.settled_tilt_rad : std::numeric_limits<double>::quiet_NaN(),
              limits.settled_tilt_rad));
  std::string text;
  for (const HeavierFloat& h : heavier) {
    text += (text.empty() ? "With " + rough_percent(h.excess) + " more plastic, the same everywhere (its centre of mass stays), "
                          : "; with " + rough_percent(h.excess) + " more ") +
            heavier_words(h, verdict, limits);
    if (h.settles == FloatingRest::Outcome::sinks) break;
  }
  verdict.meaning.push_back(text + ".");
  const auto bad =
      std::find_if(heavier.begin(), heavier.end(), [&](const HeavierFloat& h) { return !h.rests_within(limits.settled_tilt_rad); });
  if (bad == heavier.end()) return;
  verdict.notes.push_back(
      "Prints come out 1 to 2 % too heavy: with " + rough_percent(bad->excess) + " more plastic " +
      heavier_words(*bad, verdict, limits) +
      (bad->settles == FloatingRest::Outcome::sinks
           ? ", as it displaces at most " + rough_percent(verdict.state.buoyancy_reserve) + " more than it weighs."
           : ".") +
      (bad == heavier.begin() ? " Leave more of it above the water: hollow it to a lower waterline (--waterline)."
                              : " Weigh the print: " + grams(verdict.state.body.mass_g) + " are wanted."));
}

void describe(FloatVerdict& verdict) {
  const FloatSpec& spec = verdict.spec;
  verdict.goal = FloatSpec::kGoal;
  verdict.body = verdict.state.body;
  put_first(figures_of(verdict.state, spec), verdict.figures);
  verdict.figures.push_back({.name = "with_more_plastic", .words = "", .value = records(verdict.state.heavier)});
  add_righting(verdict.state.righting, verdict.figures);
  const bool submerged = is_submerged(spec);
  verdict.headline =
      (submerged ? "wholly under water" : "waterline " + number(*spec.waterline_mm, 3) + " mm above the lowest point") +
      (spec.waterline_searched ? " (found: the largest metacentric height)" : "") + ", fluid " + shown(spec.fluid_g_cm3) +
      " g/cm3, " + print_words(spec.print);
  Figure waterline{.name = "waterline_mm", .words = "", .unit = Unit::mm, .value = {}};
  if (!submerged) waterline.value = *spec.waterline_mm;
  verdict.wanted = {{.name = "up", .words = "", .value = list(spec.up)},
                    waterline,
                    {.name = "waterline_searched", .words = "", .value = spec.waterline_searched},
                    {.name = "submerged", .words = "", .value = submerged},
                    {.name = "fluid_g_cm3", .words = "", .unit = Unit::g_cm3, .value = spec.fluid_g_cm3}};
  add_print(spec.print, verdict.wanted);
}

// The criteria of floating itself, and what they come to.
void conclude(FloatVerdict& verdict, double diagonal_mm, const Limits& limits) {
  const FloatState& state = verdict.state;
  if (state.body.mass_g > 0 && state.displaced_mass_g == 0)
    verdict.notes.push_back("At this waterline the body displaces nothing.");
  if (verdict.trapped_resin_g > 0 && verdict.trapped_resin_g > state.buoyancy_reserve * state.body.mass_g)
    verdict.notes.push_back("With that resin inside it sinks.");
  if (is_submerged(verdict.spec)) {
    say_submerged(verdict, limits);
    note_pockets(verdict);
  } else {
    say(verdict, limits);
  }
  auto& criteria = verdict.criteria;
  criteria.push_back(at_most("mass_error", "mass against displaced mass, relative", state.mass_error, limits.mass_error));
  criteria.push_back(at_most("offset", "horizontal offset of the centres, over the diagonal",
                             state.horizontal_offset_mm / diagonal_mm, limits.offset_over_diagonal));
  // Less is rounding. A neutral body, which floating_rest leaves as it is, does not come back from its releases.
  criteria.push_back(
      at_least("metacentric_height", "metacentre above centre of mass, mm", state.metacentric_height_mm, 1e-5 * diagonal_mm));
  const bool rests = state.settles == FloatingRest::Outcome::rests;
  if (is_submerged(verdict.spec) || limits.release_directions > 0)
    criteria.push_back(at_most("settled_tilt", "largest tilt at rest after tilted releases, rad",
                               rests ? state.settled_tilt_rad : std::numeric_limits<double>::quiet_NaN(), limits.settled_tilt_rad));
  judge_reserve(verdict, limits);
  describe(verdict);
}

/// What is judged, whose refusal says so where its outside is not the original's.
/// @throws Error
template <typename Judge>
auto with_holes_told(bool changed, const Judge& judge) {
  try {
    return judge();
  } catch (const Error& error) {
    if (error.code() != ErrorCode::goal || !changed) throw;
    throw Error(ErrorCode::goal,
                std::string(error.what()) +
                    " But its outside is not the original's: if there are holes in it, water comes in by them. Say --drain auto of "
                    "those by which it was drained, how wide they are (--drain-diameter), and where plugs close them --plug, with "
                    "--plugs FILE where these are in a file of their own.");
  }
}

}  // namespace

bool Verdict::pass() const {
  return std::all_of(criteria.begin(), criteria.end(), [](const Criterion& c) { return c.pass(); });
}

FloatState float_state(const Mesh& mesh, const FloatSpec& spec, const Limits& limits, bool settle, const Progress& progress) {
  check(spec, Setting::For::judging);
  const Mesh merged = merged_mesh(mesh);
  const Mesh material = material_of(merged, unbalanced_edges(merged) == 0, progress);
  return state_of(judged(merged, merged, material, spec), at_its_waterline(merged, std::nullopt, spec, progress),
                  {limits, settle ? Judging::settles : Judging::afloat, progress});
}

FloatVerdict verify(const Mesh& delivered, const Mesh* original, const FloatSpec& spec, const Limits& limits,
                    const Progress& progress) {
  check(spec, Setting::For::judging);
  FloatVerdict verdict;
  const Surface surface = judge_surface(delivered, original, progress, verdict);
  const bool changed = original && verdict.outer_deviation_mm > verdict.coordinate_rounding_mm;
  verdict.spec = with_holes_told(changed, [&] { return at_its_waterline(surface.mesh, std::nullopt, spec, progress); });
  verdict.state = state_of(judged(surface.mesh, surface.outer, surface.material, spec), verdict.spec,
                           {limits, Judging::with_more_plastic, progress});
  add_surface_criteria(surface, {original != nullptr, spec.print, spec.up, limits.wall_ratio}, progress, verdict);
  conclude(verdict, surface.diagonal_mm, limits);
  return verdict;
}

FloatVerdict verify_detail::judge_print(const PrintInHull& print, const FloatSpec& spec, const Limits& limits,
                                        const Progress& progress) {
  FloatVerdict verdict;
  const MassProperties mass = mass_properties(print.s, spec.print.density_g_cm3);
  verdict.spec = at_its_waterline(print.hull, mass.mass_g, spec, progress);
  verdict.state = state_of({print.hull, print.hull, mass, false}, verdict.spec, {limits, Judging::with_more_plastic, progress});
  conclude(verdict, print.diagonal_mm, limits);
  return verdict;
}

PrintInHull verify_detail::in_hull(const Mesh& merged, const Moments& printed, const Progress& progress) {
  // Cavities go first, as in state_of.
  return {outer_hull(boundary_of_union(outer_hull(merged), progress)), printed, bounding_box(merged).diagonal().norm()};
}

namespace {

Verdict judge_any(const PrintInHull& print, const Spec& spec, const Limits& limits, const Progress& progress) {
  return std::visit([&](const auto& s) -> Verdict { return judge_print(print, s, limits, progress); }, spec);
}

void check_any(const Spec& spec) {
  std::visit([](const auto& s) { check(s, Setting::For::judging); }, spec);
}

}  // namespace

Verdict verify_print(const Mesh& original, const Moments& printed, const Spec& spec, const Limits& limits,
                     const Progress& progress) {
  check_any(spec);
  const Mesh merged = merged_mesh(original);
  if (unbalanced_edges(merged) > 0)
    throw Error(ErrorCode::input, "The surface is not closed: of a print in it nothing can be said. Repair the mesh.");
  return judge_any(in_hull(merged, printed, progress), spec, limits, progress);
}

namespace {

/// What is assumed of the sparse regions, and what to do about it. What prints have weighed: docs/theory.md (47).
std::string assumed(const SparseInfill& infill) {
  const std::vector<std::string> measured = infill_patterns();
  const std::string pattern = infill.pattern.empty() ? "the pattern" : infill.pattern;
  std::string caveat;
  if (!is_uniform_infill(infill.pattern))
    caveat = "; but " + pattern + " lays down other shares at other places";
  else if (std::find(measured.begin(), measured.end(), infill.pattern) == measured.end())
    caveat = " (" + pattern + " was not measured)";
  return "Assumed: printed solid but for the sparse regions, whose " + (infill.pattern.empty() ? "" : infill.pattern + " ") +
         "infill of " + number(infill.percent, 1) + " % takes " + number(100 * infill.share, 2) + " % of their room" + caveat +
         ". Prints have weighed 1 to 4 % more than that, which can make a body lean: make it with --slicer, or slice it and let "
         "'rayrep verify NAME.gcode --goal GOAL --original MESH' judge what is printed.";
}

}  // namespace

Verdict verify(const PrintedDelivery& delivered, const Mesh* original, const Spec& spec, const Limits& limits,
               const Progress& progress) {
  check_any(spec);
  const Print& print = print_of(spec);
  const Mesh solid = delivered.delivery.solid();
  require_size(solid);
  Verdict both;
  const bool drained = print.drains.wanted();
  if (drained && !original)
    throw Error(ErrorCode::usage, "Holes are told from the rest of the outside by the original: name it (--original).");
  // Where bodies of it overlap, it is their union that was drilled or cut.
  const bool opened = drained || (original && in_pieces(delivered.delivery));
  const Mesh united = opened ? combined({original, 1}, {}, progress).mesh : Mesh();
  const AllowedOutside outside(solid, opened ? &united : original, spec, progress);
  const Surface surface = judge_surface(solid, outside.mesh(), progress, both, drained ? &print.drains : nullptr);
  // As exact as outer_deviation is where triangles were cut.
  const double tolerance_mm = std::max(outside.tolerance_mm(), opened ? std::ldexp(surface.diagonal_mm, -30) : 0.0);
  add_surface_criteria(surface,
                       {original != nullptr, print, up_of(spec), limits.wall_ratio, tolerance_mm, in_pieces(delivered.delivery)},
                       progress, both);
  outside.tell(both);
  if (!Surface::closed(both)) return both;
  Moments s = delivered.printed + insert_moments(delivered.delivery, print.density_g_cm3);
  Mesh touched = surface.outer;
  Verdict holes;
  if (drained) {
    const Drained what{delivered.delivery, surface, *outside.mesh(), spec};
    holes.cavities = both.cavities;
    judge_drains(what, progress, holes);
    both.trapped_resin_g = holes.trapped_resin_g;
    s += closed_in(what);
    touched = outside_with_plugs(what, both);
  }
  const PrintInHull in = in_hull(merged_mesh(touched), s, progress);
  const bool changed = original && both.outer_deviation_mm > std::max(both.coordinate_rounding_mm, tolerance_mm);
  const bool open = !surface.holes.mouths.empty() && !print.drains.plugged;
  Verdict verdict = with_holes_told(changed || open, [&] { return judge_any(in, spec, limits, progress); });
  // What was found of the surface, and its criteria first.
  both.goal = std::move(verdict.goal);
  both.headline = std::move(verdict.headline);
  both.wanted = std::move(verdict.wanted);
  if (delivered.delivery.has_infill()) both.figures.clear();  // what it fills carries what lies above
  put_first(std::move(verdict.figures), both.figures);
  both.body = verdict.body;
  const auto add = [](auto& to, auto& from) {
    to.insert(to.end(), std::make_move_iterator(from.begin()), std::make_move_iterator(from.end()));
  };
  add(both.figures, holes.figures);
  for (Verdict* part : {&holes, &verdict}) add(both.criteria, part->criteria);
  for (Verdict* part : {&verdict, &holes}) {
    add(both.meaning, part->meaning);
    add(both.notes, part->notes);
  }
  if (delivered.delivery.has_inserts())
    judge_inserts(delivered.delivery, surface.mesh, hull_with_axle(in.hull, spec, progress), progress, both);
  return both;
}

Verdict verify(const Delivery& delivered, const Mesh* original, const Spec& spec, const Limits& limits, const Progress& progress) {
  if (in_pieces(delivered)) {
    check_any(spec);
    const Spec judged = judged_in_pieces(delivered, original, spec);
    const Mesh whole = merged_mesh(delivered.body());
    const Moments s = mesh_moments(material_of(whole, unbalanced_edges(whole) == 0, progress));
    const PrintedDelivery printed{delivered, s};
    Verdict verdict = verify(printed, original, judged, limits, progress);
    judge_pieces(printed, judged, limits, progress, verdict);
    return verdict;
  }
  if (!delivered.has_infill() && !delivered.has_inserts() && !print_of(spec).drains.wanted())
    return verify(delivered.solid(), original, spec, limits, progress);
  require_size(delivered.solid());
  Verdict verdict = verify(PrintedDelivery{delivered, moments_of(delivered, progress)}, original, spec, limits, progress);
  for (const Part& part : delivered.parts)
    if (part.infill) {
      const std::string note = assumed(*part.infill);
      if (std::find(verdict.notes.begin(), verdict.notes.end(), note) == verdict.notes.end()) verdict.notes.push_back(note);
    }
  return verdict;
}

Figures state_figures(const Mesh& mesh, const FloatSpec& spec, const Limits& limits, const Progress& progress) {
  return figures_of(float_state(mesh, spec, limits, true, progress), spec);
}

Verdict verify(const Mesh& delivered, const Mesh* original, const Spec& spec, const Limits& limits, const Progress& progress) {
  require_size(delivered);
  return std::visit([&](const auto& s) -> Verdict { return verify(delivered, original, s, limits, progress); }, spec);
}

Figures state_figures(const Mesh& mesh, const Spec& spec, const Limits& limits, const Progress& progress) {
  return std::visit([&](const auto& s) { return state_figures(mesh, s, limits, progress); }, spec);
}

}  // namespace rayrep
