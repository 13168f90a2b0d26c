#include "rayrep/judge/verify_mechanism.h"

#include <algorithm>
#include <cassert>
#include <cmath>

#include "judge/figures.h"
#include "judge/verify_detail.h"

namespace rayrep {
namespace {

using namespace verify_detail;

/// A part taken apart, in its own frame.
struct Delivered {
  Mesh outer;  ///< without cavities
  Moments s;   ///< g, g mm, g mm^2
};

Delivered judge_part(const MechanismPart& part, const Mesh* original, const Limits& limits, const Progress& progress,
                     Verdict& verdict) {
  const Surface surface = judge_surface(part.mesh, original, progress, verdict);
  const Eigen::Vector3d up = Eigen::Vector3d::UnitZ();  // of a part by itself
  add_surface_criteria(surface, {original != nullptr, part.print, up, limits.wall_ratio}, progress, verdict);
  const Moments s = mesh_moments(surface.material);
  verdict.body = mass_properties(s, part.print.density_g_cm3);
  return {surface.outer, 1e-3 * part.print.density_g_cm3 * s};
}

/// What turns on a hinge: how far its centre of mass lies beside the vertical plane through the axis.
void judge_hinge(const HingeBalance& hinge, const MechanismState& state, const std::vector<Delivered>& parts, const Limits& limits,
                 Verdict& verdict) {
  Moments s = Moments::Zero();
  Eigen::AlignedBox3d box;
  for (const std::size_t n : hinge.parts) {
    s += moment_map(state.poses[n]) * parts[n].s;
    box.extend(bounding_box(transformed(parts[n].outer, state.poses[n])));
  }
  const Eigen::Vector3d up = state.rests.up_or(Eigen::Vector3d::UnitZ());
  const Eigen::Vector3d across = hinge.axis.cross(up).normalized();
  const Eigen::Vector3d centre = s.segment<3>(MX) / s[M1];
  const double beside = std::abs(across.dot(centre - hinge.point_mm));
  const auto place = 1 + std::count_if(verdict.criteria.begin(), verdict.criteria.end(),
                                       [](const Criterion& c) { return c.name == "hinge_balance"; });
  verdict.figures.push_back(
      {.name = "hinge_" + std::to_string(place) + "_centre_of_mass_mm", .words = "", .unit = Unit::mm, .value = list(centre)});
  verdict.criteria.push_back(at_most("hinge_balance",
                                     "centre of mass of what turns on a hinge beside the plane through it, over the diagonal",
                                     beside / box.diagonal().norm(), limits.offset_over_diagonal));
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
    Mesh all;
    Moments s = Moments::Zero();
    for (std::size_t n = 0; n < delivered.size(); ++n) {
      append(all, transformed(delivered[n].outer, state.poses[n]));
      s += moment_map(state.poses[n]) * delivered[n].s;
    }
    const PoseSpec spec = spec_of(mechanism, state);
    verdict.states.push_back(
        judge_print(in_hull(merged_mesh(all), s / (1e-3 * spec.print.density_g_cm3), progress), spec, limits, progress));
    if (delivered.size() > 1)
      verdict.states.back().notes.push_back(
          "Assumed: the parts hold together in a state, by a hinge that keeps its angle, or a lock.");
    for (const HingeBalance& hinge : state.hinges) judge_hinge(hinge, state, delivered, limits, verdict.states.back());
  }
  return verdict;
}

}  // namespace rayrep
