#include <Eigen/Geometry>
#include <cmath>
#include <numbers>

#include "base/text.h"
#include "judge/figures.h"
#include "judge/verify_detail.h"
#include "physics/spin_simulation.h"
#include "rayrep/base/error.h"
#include "rayrep/judge/verify.h"
#include "rayrep/physics/axle.h"
#include "rayrep/physics/hydrostatics.h"

namespace rayrep {
namespace {

using namespace verify_detail;

/// Contact point of a top, centre of a yo-yo, once it has been filled in.
Eigen::Vector3d place_of(const SpinSpec& spec) { return spec.yoyo ? *spec.centre_mm : spec.axis.point_mm; }

/// The spec with its contact point or centre filled in. The centre of mass that may name it is the solid's: of the original, or of
/// the mesh with its sealed cavities filled.
/// @param mesh  vertices merged
SpinSpec at_its_place(const Mesh& mesh, const Mesh* original, SpinSpec spec, const Progress& progress) {
  if (spec.yoyo) {
    if (!spec.centre_mm) spec.centre_mm = bounding_box(mesh).center();
    return spec;
  }
  const bool by_mass = spec.axis.through == SpinAxis::Through::centre_of_mass;
  if (by_mass && !original && unbalanced_edges(mesh) > 0)
    throw Error(
        ErrorCode::input,
        "The surface is not closed, so that it has no centre of mass to spin on: name the contact point (--point X,Y,Z), or "
        "repair the mesh.");
  const Mesh solid = !by_mass ? mesh : original ? *original : outer_hull(mesh);
  spec.axis.point_mm = contact_point(solid, spec.axis, spec.up, progress);
  spec.axis.through = SpinAxis::Through::point;
  spec.axis.leaves_below = false;
  return spec;
}

/// @param spec  with its place filled in
SpinState state_of(const MassProperties& body, const SpinSpec& spec) {
  const Eigen::Vector3d contact_mm = place_of(spec);
  return spin_state(body, contact_mm, spec.up.normalized(), spec.yoyo);
}

/// What the criteria of spinning look at besides the state.
struct Judged {
  const Mesh& mesh;
  double diagonal_mm;
};

void add_notes(SpinVerdict& verdict, const Judged& judged) {
  const SpinSpec& spec = verdict.spec;
  std::vector<std::string>& notes = verdict.notes;
  const Eigen::Vector3d contact_mm = place_of(spec);
  const AxisClass found = verdict.state.axis_class;
  if (found == AxisClass::middle)
    notes.push_back(
        "The spin axis is the middle one of the three principal axes: at speed the body tumbles however well it is centred.");
  else if (found != spec.prefer)
    notes.push_back(
        found == AxisClass::smallest
            ? "The spin axis is that of the smallest moment of inertia: it can be stable, but not as the largest would be."
            : "The spin axis is that of the largest moment of inertia, where the smallest was asked for.");
  if (spec.yoyo) return;
  const Eigen::Vector3d up = spec.up.normalized();
  if (const double below = up.dot(contact_mm) - lowest_along(judged.mesh, up); below > 1e-3 * judged.diagonal_mm) {
    notes.push_back("The body reaches " + shown(below, 3) +
                    " mm below its contact point: it needs a tip at least that long to spin there.");
  }
}

/// A speed in the last of its ranges of stable speed. @param state  with such a range
double speed_to_look_at(const SpinState& state) {
  constexpr double beyond_the_end = 1.2;
  const SpeedRange& range = state.sliding.back();
  return std::isfinite(range.hi_rad_s) ? 0.5 * (range.lo_rad_s + range.hi_rad_s)
         : range.lo_rad_s > 0          ? beyond_the_end * range.lo_rad_s
                                       : 10;  // a free body: the speed only sets the unit of time
}

/// The largest tilt of the body as it is, off-centre and all, spun at that speed and kicked a little.
double simulated_tilt(const SpinState& state, const SpinSpec& spec) {
  const Eigen::Vector3d contact_mm = place_of(spec);
  constexpr double kick_rad = 1e-3;
  physics::Spin spin;
  spin.axis = spec.up.normalized();
  spin.speed_rad_s = speed_to_look_at(state);
  spin.kick = kick_rad;
  const physics::Body body{state.body.mass_g, state.body.inertia_g_mm2, contact_mm - state.body.centre_of_mass_mm};
  return simulate(body, spec.yoyo ? physics::Support::none : physics::Support::sliding, spin).largest_tilt_rad;
}

/// "387 to 412, above 498". Ends too near to be told apart in the text count as one: a gap or range of a fraction of a turn is of
/// no use.
std::string speeds(const std::vector<SpeedRange>& all) {
  std::vector<SpeedRange> ranges;
  for (const SpeedRange& range : all) {
    if (!ranges.empty() && rpm(range.lo_rad_s) - rpm(ranges.back().hi_rad_s) < 1)
      ranges.back().hi_rad_s = range.hi_rad_s;
    else
      ranges.push_back(range);
  }
  std::erase_if(ranges, [](const SpeedRange& range) { return rpm(range.hi_rad_s) - rpm(range.lo_rad_s) < 1; });
  std::string text;
  for (const SpeedRange& range : ranges) {
    text += text.empty() ? "" : ", ";
    if (!std::isfinite(range.hi_rad_s))
      text += range.lo_rad_s > 0 ? "above " + number(rpm(range.lo_rad_s), 0) : "any speed";
    else
      text += number(rpm(range.lo_rad_s), 0) + " to " + number(rpm(range.hi_rad_s), 0);
  }
  return text.empty() ? "none" : text;
}

/// What keeps it from being balanced about its axis; empty if it is.
std::string imbalance(const SpinVerdict& verdict, double diagonal_mm, const Limits& limits) {
  const SpinState& state = verdict.state;
  const double allowed_mm = limits.offset_over_diagonal * diagonal_mm;
  if (!(state.offset_mm <= allowed_mm)) return "its centre of mass lies " + number(state.offset_mm, 2) + " mm beside the axis";
  if (verdict.spec.yoyo && !((state.body.centre_of_mass_mm - place_of(verdict.spec)).norm() <= allowed_mm))
    return "its centre of mass lies " + number(std::abs(state.height_mm), 2) + " mm beside the centre, along the axis";
  if (!(state.axis_angle_rad <= limits.axis_angle_rad))
    return "its nearest principal axis is " + number(state.axis_angle_rad * 180 / std::numbers::pi, 2) +
           " degrees off, so that it wobbles at any speed";
  return "";
}

/// What it does, in one sentence.
std::string spins(const SpinVerdict& verdict, const std::string& imbalance) {
  const SpinState& state = verdict.state;
  const SpinSpec& spec = verdict.spec;
  const std::string fails = std::string("It does not spin as a ") + (spec.yoyo ? "yo-yo" : "top") + ": ";
  if (!imbalance.empty()) return fails + imbalance + ".";
  if (state.sliding.empty()) return fails + "at no speed is the spin about this axis stable.";
  if (spec.yoyo) return "It spins as a yo-yo without wobbling, at " + speeds(state.sliding) + ".";
  const auto fast = [](const std::vector<SpeedRange>& ranges) { return !ranges.empty() && std::isinf(ranges.back().hi_rad_s); };
  if (!fast(state.sliding) || !fast(state.fixed))
    return "It spins as a top, upright, at these speeds in rpm: " + speeds(state.sliding) + ".";
  const double sliding = rpm(state.sliding.back().lo_rad_s);
  const double fixed = rpm(state.fixed.back().lo_rad_s);
  return "It spins as a top, upright, when it is spun faster than " + number(std::ceil(std::max(sliding, fixed)), 0) +
         " rpm on any ground (" + number(std::ceil(sliding), 0) + " rpm where its tip slides freely).";
}

/// What it does, and what the print's scatter does to a body that can spin.
void say(SpinVerdict& verdict, double diagonal_mm, const Limits& limits) {
  const SpinState& state = verdict.state;
  verdict.scatter_mm = print_scatter_mm(diagonal_mm);
  const std::string off_balance = imbalance(verdict, diagonal_mm, limits);
  verdict.meaning.push_back(spins(verdict, off_balance));
  if (state.sliding.empty() || !off_balance.empty()) return;
  const std::string off = "With its centre of mass " + scatter_words(verdict.scatter_mm) + " off the axis, as prints scatter, ";
  if (verdict.spec.yoyo) {
    constexpr double turns_rpm = 1000;
    constexpr double gravity_mm_s2 = 9806.65;
    const double speed_rad_s = turns_rpm / rpm(1);
    verdict.meaning.push_back(off + "it shakes: at " + shown(turns_rpm) + " rpm with " +
                              number(verdict.scatter_mm * speed_rad_s * speed_rad_s / gravity_mm_s2, 2) + " of its weight.");
    return;
  }
  const Eigen::Vector3d up = verdict.spec.up.normalized();
  const double axial = up.dot(state.body.inertia_g_mm2 * up);
  const Top top{state.body.mass_g, state.height_mm, axial / state.ratio_smaller, axial / state.ratio_larger, axial};
  const double speed_rad_s = speed_to_look_at(state);
  verdict.scatter_tilt_rad = off_balance_tilt_rad(top, verdict.scatter_mm, speed_rad_s);
  verdict.meaning.push_back(off + "its axis leans by " + number(*verdict.scatter_tilt_rad * 180 / std::numbers::pi, 2) +
                            " degrees at " + number(rpm(speed_rad_s), 0) +
                            " rpm, and less the faster it spins. More plastic, the same everywhere, changes none of its speeds.");
}

/// Off its principal axis a body wobbles at any speed.
std::string stable_speeds(const SpinState& state, const SpinSpec& spec, const Limits& limits) {
  if (!(state.axis_angle_rad <= limits.axis_angle_rad)) return "none, it is not balanced about this axis";
  return speeds(state.sliding) + (spec.yoyo ? "" : " (sliding tip); " + speeds(state.fixed) + " (fixed tip)");
}

std::vector<Record> records(const std::vector<SpeedRange>& ranges) {
  std::vector<Record> all;
  for (const SpeedRange& range : ranges) all.push_back({{"from_rpm", rpm(range.lo_rad_s)}, {"to_rpm", rpm(range.hi_rad_s)}});
  return all;
}

Figures figures_of(const SpinState& state, const SpinSpec& spec, const Limits& limits) {
  Figures figures = body_figures(state.body, "mass");
  const auto add = [&figures](Figure figure) { figures.push_back(std::move(figure)); };
  add({.name = "offset_mm", .words = "centre of mass beside the axis", .unit = Unit::mm, .value = state.offset_mm, .digits = 5});
  add({.name = "height_mm",
       .words = spec.yoyo ? "" : "centre of mass above the contact",
       .unit = Unit::mm,
       .value = state.height_mm});
  add({.name = "axis_angle_rad",
       .words = "axis off the nearest principal axis",
       .unit = Unit::rad,
       .value = state.axis_angle_rad,
       .digits = 4});
  add({.name = "ratio_to_larger_lateral", .words = "Izz over the larger lateral moment", .value = state.ratio_larger, .digits = 4});
  add({.name = "ratio_to_smaller_lateral",
       .words = "Izz over the smaller lateral moment",
       .value = state.ratio_smaller,
       .digits = 4});
  add({.name = "axis_class", .words = "the axis is that of the ... moment", .value = std::string(name_of(state.axis_class))});
  add({.name = "stable_speeds", .words = "stable speeds", .unit = Unit::rpm, .value = stable_speeds(state, spec, limits)});
  add({.name = "stable_sliding", .words = "", .value = records(state.sliding)});
  add({.name = "stable_fixed", .words = "", .value = records(state.fixed)});
  return figures;
}

void describe(SpinVerdict& verdict, const Limits& limits) {
  const SpinSpec& spec = verdict.spec;
  const Eigen::Vector3d place = place_of(spec);
  verdict.goal = spec.yoyo ? "yo-yo" : SpinSpec::kGoal;
  verdict.body = verdict.state.body;
  put_first(figures_of(verdict.state, spec, limits), verdict.figures);
  verdict.figures.push_back({.name = "scatter_mm", .words = "", .unit = Unit::mm, .value = verdict.scatter_mm});
  Figure lean{.name = "scatter_tilt_rad", .words = "", .unit = Unit::rad, .value = {}};
  if (verdict.scatter_tilt_rad) lean.value = *verdict.scatter_tilt_rad;
  verdict.figures.push_back(lean);
  const Eigen::Vector3d& up = spec.up;
  if (spec.max_tilt_rad > 0)
    verdict.headline = "axis along (" + number(up.x(), 5) + ", " + number(up.y(), 5) + ", " + number(up.z(), 5) + "), ";
  verdict.headline += (spec.yoyo ? "centre at " : "contact at ") + place_words(place) + ", " + print_words(spec.print);
  verdict.wanted = {{.name = "axis", .words = "", .value = list(up)},
                    {.name = spec.yoyo ? "centre_mm" : "contact_mm", .words = "", .unit = Unit::mm, .value = list(place)},
                    {.name = "prefer", .words = "", .value = std::string(name_of(spec.prefer))}};
  if (has_axle(spec.axle)) {
    SpinSpec told = spec;
    for (const Setting& row : settings(told, Setting::For::judging))
      if (row.name == "axle") verdict.wanted.push_back({.name = "axle", .words = "", .value = shown(row)});
    verdict.wanted.push_back({.name = "gap_mm", .words = "", .unit = Unit::mm, .value = spec.axle.gap_mm});
  }
  add_print(spec.print, verdict.wanted);
}

/// The criteria of spinning itself, and what they come to.
void conclude(SpinVerdict& verdict, const Judged& judged, const Limits& limits, const Progress& progress) {
  const SpinSpec& spec = verdict.spec;
  const SpinState& state = verdict.state;
  auto& criteria = verdict.criteria;
  criteria.push_back(at_most("offset", "distance of the centre of mass from the axis, over the diagonal",
                             state.offset_mm / judged.diagonal_mm, limits.offset_over_diagonal));
  if (spec.yoyo)
    criteria.push_back(at_most("centre", "distance of the centre of mass from the centre, over the diagonal",
                               (state.body.centre_of_mass_mm - place_of(spec)).norm() / judged.diagonal_mm,
                               limits.offset_over_diagonal));
  criteria.push_back(at_most("axis_angle", "angle between the spin axis and the nearest principal axis, rad", state.axis_angle_rad,
                             limits.axis_angle_rad));
  if (spec.prefer == AxisClass::largest)
    criteria.push_back(
        at_least("axis_class", "moment about the axis, over the larger lateral one", state.ratio_larger, 1 + limits.class_margin));
  else
    criteria.push_back(
        at_most("axis_class", "moment about the axis, over the smaller lateral one", state.ratio_smaller, 1 - limits.class_margin));
  criteria.push_back(at_least("stable_speeds",
                              spec.yoyo ? "ranges of speed in which the free body spins stably"
                                        : "ranges of speed in which it spins stably on a sliding tip",
                              static_cast<double>(state.sliding.size()), 1));
  if (!state.sliding.empty()) {
    progress.check();
    criteria.push_back(at_most("simulated_tilt", "largest tilt in 100 turns after a kick of 0.001, simulated, rad",
                               simulated_tilt(state, spec), limits.simulated_tilt_rad));
  }
  say(verdict, judged.diagonal_mm, limits);
  add_notes(verdict, judged);
  describe(verdict, limits);
}

}  // namespace

SpinState spin_state_of(const Mesh& mesh, const SpinSpec& spec, const Progress& progress) {
  check(spec, Setting::For::judging);
  const Mesh merged = merged_mesh(mesh);
  const SpinSpec placed = at_its_place(merged, nullptr, spec, progress);
  const Mesh material = material_of(merged, unbalanced_edges(merged) == 0, progress);
  return state_of(mass_properties(material, spec.print.density_g_cm3), placed);
}

SpinVerdict verify(const Mesh& delivered, const Mesh* original, const SpinSpec& spec, const Limits& limits,
                   const Progress& progress) {
  check(spec, Setting::For::judging);
  SpinVerdict verdict;
  const Surface surface = judge_surface(delivered, original, progress, verdict);
  verdict.spec = at_its_place(surface.mesh, original, spec, progress);
  verdict.state = state_of(mass_properties(surface.material, spec.print.density_g_cm3), verdict.spec);
  add_surface_criteria(surface, {original != nullptr, spec.print, spec.up, limits.wall_ratio}, progress, verdict);
  conclude(verdict, {surface.mesh, surface.diagonal_mm}, limits, progress);
  return verdict;
}

SpinVerdict verify_detail::judge_print(const PrintInHull& print, const SpinSpec& spec, const Limits& limits,
                                       const Progress& progress) {
  SpinVerdict verdict;
  verdict.spec = at_its_place(print.hull, &print.hull, spec, progress);
  verdict.state = state_of(mass_properties(print.s, spec.print.density_g_cm3), verdict.spec);
  conclude(verdict, {print.hull, print.diagonal_mm}, limits, progress);
  return verdict;
}

Figures state_figures(const Mesh& mesh, const SpinSpec& spec, const Limits& limits, const Progress& progress) {
  return figures_of(spin_state_of(mesh, spec, progress), spec, limits);
}

}  // namespace rayrep
