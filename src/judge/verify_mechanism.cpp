#include "rayrep/judge/verify_mechanism.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>
#include <optional>
#include <utility>

#include "base/text.h"
#include "judge/figures.h"
#include "judge/parts_off.h"

namespace rayrep {
namespace {

using namespace verify_detail;
using Eigen::Vector3d;

/// A part taken apart, in its own frame.
struct Delivered {
  Mesh outer;  ///< without cavities
  Moments s;   ///< g, g mm, g mm^2
};

Delivered judge_part(const MechanismPart& part, const Mesh* original, const Limits& limits, const Progress& progress,
                     Verdict& verdict) {
  const Surface surface = judge_surface(part.mesh, original, progress, verdict);
  const Vector3d up = Vector3d::UnitZ();  // of a part by itself
  add_surface_criteria(surface, {original != nullptr, part.print, up, limits.wall_ratio}, progress, verdict);
  const Moments s = mesh_moments(surface.material);
  verdict.body = mass_properties(s, part.print.density_g_cm3);
  return {surface.outer, 1e-3 * part.print.density_g_cm3 * s};
}

PlacedPart placed(const MechanismPart& part, const Moments& s) {
  return {part.name, s[M1], s.segment<3>(MX) / s[M1], part.printed};
}

/// What turns on a hinge: how far its centre of mass lies beside the vertical plane through the axis.
void judge_hinge(const HingeBalance& hinge, const PlacedState& in, const std::vector<Delivered>& parts, Verdict& verdict) {
  Vector3d centre = Vector3d::Zero();
  double mass_g = 0;
  Eigen::AlignedBox3d box;
  std::string names;
  for (const std::size_t n : hinge.parts) {
    const PlacedPart& part = in.parts[n];
    mass_g += part.mass_g;
    centre += part.mass_g * part.centre_mm;
    box.extend(bounding_box(transformed(parts[n].outer, in.state.poses[n])));
    names += (names.empty() ? "'" : ", '") + part.name + "'";
  }
  centre /= mass_g;
  const Vector3d up = in.state.rests.up_or(Vector3d::UnitZ());
  const double beside = std::abs(hinge.axis.cross(up).normalized().dot(centre - hinge.point_mm));
  const auto place = 1 + std::count_if(verdict.criteria.begin(), verdict.criteria.end(),
                                       [](const Criterion& c) { return c.name == "hinge_balance"; });
  const std::string prefix = "hinge_" + std::to_string(place) + "_";
  const double off = hinge_off_mm(in, hinge);
  verdict.figures.push_back({.name = prefix + "centre_of_mass_mm", .words = "", .unit = Unit::mm, .value = list(centre)});
  verdict.figures.push_back({.name = prefix + "beside_mm", .words = "", .unit = Unit::mm, .value = beside});
  verdict.figures.push_back({.name = prefix + "with_parts_off_mm", .words = "", .unit = Unit::mm, .value = off});
  verdict.criteria.push_back(at_most("hinge_balance",
                                     "centre of mass of what turns on a hinge beside the plane through it, over the diagonal",
                                     beside / box.diagonal().norm(), in.limits.offset_over_diagonal));
  std::string& meaning = verdict.meaning.back();
  if (!verdict.criteria.back().pass())
    meaning += " What turns on its hinge (" + names + ") does not stay where it is left: its centre of mass lies " +
               number(beside, 2) + " mm beside the plane through it.";
  else
    meaning += " What turns on its hinge (" + names + ") stays where it is left" +
               (hinge.parts.size() > 1 ? "; with parts " + rough_percent(in.limits.too_heavy[0]) +
                                             " off by themselves its centre of mass lies up to " + number(off, 2) + " mm beside it."
                                       : std::string("."));
}

struct How {
  const Limits& limits;
  const Progress& progress;
};

/// Of what floats nowhere. @returns none: it does, or shall do something else
std::optional<PoseVerdict> sunk(const PrintInHull& print, const PoseSpec& spec) {
  const Pose& rests = spec.poses.front();
  if (rests.kind != Pose::Kind::floats || rests.waterline_mm) return std::nullopt;
  PoseVerdict verdict;
  verdict.spec = spec;
  verdict.goal = PoseSpec::kGoal;
  verdict.body = mass_properties(print.s, spec.print.density_g_cm3);
  const double carries_g = 1e-3 * spec.fluid_g_cm3 * mesh_moments(print.hull)[M1];
  if (verdict.body.mass_g < carries_g) return std::nullopt;
  verdict.smallest_tipping_angle_rad = std::numeric_limits<double>::infinity();
  verdict.figures = body_figures(verdict.body, "mass");
  verdict.criteria = {
      at_least("pose_1_afloat", "what it displaces wholly under water over its mass", carries_g / verdict.body.mass_g, 1)};
  verdict.meaning = {"In the state '" + rests.state + "', " + words_of(rests, spec.up) + ": it sinks. It weighs " +
                     number(verdict.body.mass_g, 2) + " g, and wholly under water it displaces " + number(carries_g, 2) + " g."};
  return verdict;
}

/// All parts in their places, as one body.
PoseVerdict judge_state(const Mechanism& mechanism, const MechanismState& state, const std::vector<Delivered>& delivered,
                        const How& how) {
  Mesh all;
  Moments s = Moments::Zero();
  std::vector<PlacedPart> parts;
  for (std::size_t n = 0; n < delivered.size(); ++n) {
    append(all, transformed(delivered[n].outer, state.poses[n]));
    const Moments of_part = moment_map(state.poses[n]) * delivered[n].s;
    s += of_part;
    parts.push_back(placed(mechanism.parts[n], of_part));
  }
  const PoseSpec spec = spec_of(mechanism, state);
  const PrintInHull print = in_hull(merged_mesh(all), s / (1e-3 * spec.print.density_g_cm3), how.progress);
  if (std::optional<PoseVerdict> sinks = sunk(print, spec)) return std::move(*sinks);
  PoseVerdict verdict = judge_print(print, spec, how.limits, how.progress);
  if (delivered.size() > 1)
    verdict.notes.push_back("Assumed: the parts hold together in a state, by a hinge that keeps its angle, or a lock.");
  const PlacedState in{parts, print, state, how.limits};
  judge_parts_off(in, verdict);
  for (const HingeBalance& hinge : state.hinges) judge_hinge(hinge, in, delivered, verdict);
  return verdict;
}

}  // namespace

bool MechanismVerdict::pass() const {
  const auto passes = [](const Verdict& verdict) { return verdict.pass(); };
  return !states.empty() && std::all_of(parts.begin(), parts.end(), passes) && std::all_of(states.begin(), states.end(), passes);
}

MechanismVerdict verify(const Mechanism& mechanism, const std::vector<const Mesh*>& originals, const Limits& limits,
                        const Progress& progress) {
  check(mechanism);
  assert(originals.size() == mechanism.parts.size());
  MechanismVerdict verdict;
  std::vector<Delivered> delivered;
  bool closed = true;
  for (std::size_t n = 0; n < mechanism.parts.size(); ++n) {
    const MechanismPart& part = mechanism.parts[n];
    Verdict of_part;
    of_part.goal = "part";
    of_part.headline = part.name;
    delivered.push_back(judge_part(part, originals[n], limits, progress, of_part));
    verdict.mass_g += of_part.body.mass_g;
    closed = closed && Surface::closed(of_part);
    if (part.printed) verdict.parts.push_back(std::move(of_part));
  }
  if (!closed) return verdict;
  for (const MechanismState& state : mechanism.states) {
    progress.check();
    verdict.states.push_back(judge_state(mechanism, state, delivered, {limits, progress}));
  }
  return verdict;
}

}  // namespace rayrep
