#include <cmath>

#include "base/text.h"
#include "judge/figures.h"
#include "judge/verify_detail.h"
#include "rayrep/base/error.h"
#include "rayrep/judge/verify.h"

namespace rayrep {
namespace {

using namespace verify_detail;

TargetState state_of(const MassProperties& mass, double diagonal_mm, const TargetSpec& spec) {
  TargetState state;
  state.body = mass;
  state.deviations = inertial_deviations(spec.wanted, state.body, diagonal_mm);
  state.below = inertial_deviations(spec.at_least, state.body, diagonal_mm);
  for (InertialDeviation& d : state.below)
    if (d.found >= d.wanted) d.relative = 0;
  state.beyond = inertial_deviations(spec.at_most, state.body, diagonal_mm);
  for (InertialDeviation& d : state.beyond)
    if (d.found <= d.wanted) d.relative = 0;
  state.spin_ratio = spin_state(mass, mass.centre_of_mass_mm, spec.up.normalized(), true).ratio_larger;
  return state;
}

std::string description(MomentIndex number) {
  if (number == M1) return "mass against the wanted mass, relative";
  const std::string name = inertial_name(number);
  if (number <= MZ) return "centre of mass, " + name.substr(4) + ", off the wanted one, over the diagonal";
  std::string entry = "I" + name.substr(1);
  if (number <= MZZ) return entry + " about the centre of mass against the wanted one, relative";
  return entry + " off the wanted one, over the mean of the two moments";
}

Record by_name(const std::vector<InertialDeviation>& deviations, double InertialDeviation::*member) {
  Record record;
  for (const InertialDeviation& d : deviations) record.emplace_back(inertial_name(d.number), d.*member);
  return record;
}

Figures figures_of(const TargetState& state, const TargetSpec& spec) {
  Figures figures = body_figures(state.body, "");
  for (int k = M1; k <= MXZ; ++k) {
    const auto number = static_cast<MomentIndex>(k);
    const std::optional<double>& wanted = spec.wanted[static_cast<std::size_t>(k)];
    const std::string unit = k == M1 ? ", g" : k <= MZ ? ", mm" : ", g mm2";
    figures.push_back({.name = inertial_name(number),
                       .words = inertial_name(number) + unit + (wanted ? " (wanted " + shown(*wanted, 8) + ")" : ""),
                       .value = inertial_number(state.body, number),
                       .digits = 8,
                       .significant = true});
  }
  if (spec.least_spin_ratio)
    figures.push_back({.name = "spin_ratio",
                       .words = "spin-ratio, at least " + shown(*spec.least_spin_ratio, 6),
                       .value = state.spin_ratio,
                       .digits = 5});
  figures.push_back({.name = "deviations", .words = "", .value = by_name(state.deviations, &InertialDeviation::relative)});
  return figures;
}

void describe(TargetVerdict& verdict) {
  const TargetSpec& spec = verdict.spec;
  const auto& deviations = verdict.state.deviations;
  verdict.goal = TargetSpec::kGoal;
  verdict.body = verdict.state.body;
  put_first(figures_of(verdict.state, spec), verdict.figures);
  const std::size_t bounds =
      verdict.state.below.size() + verdict.state.beyond.size() + static_cast<std::size_t>(spec.least_spin_ratio.has_value());
  verdict.headline = "wanted: " + std::to_string(deviations.size()) + " of the ten numbers" +
                     (bounds > 0 ? " and " + std::to_string(bounds) + (bounds == 1 ? " bound, " : " bounds, ") : ", ") +
                     print_words(spec.print);
  verdict.wanted = {{.name = "wanted", .words = "", .value = by_name(deviations, &InertialDeviation::wanted)}};
  if (bounds > 0) {
    Record at_least = by_name(verdict.state.below, &InertialDeviation::wanted);
    if (spec.least_spin_ratio) at_least.emplace_back("spin_ratio", *spec.least_spin_ratio);
    verdict.wanted.push_back({.name = "at_least", .words = "", .value = at_least});
    verdict.wanted.push_back({.name = "at_most", .words = "", .value = by_name(verdict.state.beyond, &InertialDeviation::wanted)});
  }
  add_print(spec.print, verdict.wanted);
}

/// The criteria of the numbers wanted, and what they come to.
void conclude(TargetVerdict& verdict, const Limits& limits) {
  for (const InertialDeviation& d : verdict.state.deviations)
    verdict.criteria.push_back(at_most(inertial_name(d.number), description(d.number), d.relative, limits.relative));
  for (const auto& [deviations, words] : {std::pair(&verdict.state.below, "at_least"), std::pair(&verdict.state.beyond, "at_most")})
    for (const InertialDeviation& d : *deviations)
      verdict.criteria.push_back(
          at_most(std::string(inertial_name(d.number)) + "_" + words,
                  std::string(inertial_name(d.number)) + " beyond its bound of " + shown(d.wanted, 6) + ", relative", d.relative,
                  limits.relative));
  if (const auto& least = verdict.spec.least_spin_ratio)
    verdict.criteria.push_back(at_most("spin_ratio_at_least", "spin-ratio beyond its bound of " + shown(*least, 6) + ", relative",
                                       verdict.state.spin_ratio >= *least ? 0 : 1 - verdict.state.spin_ratio / *least,
                                       limits.relative));
  std::string missed;
  for (const auto* deviations : {&verdict.state.deviations, &verdict.state.below, &verdict.state.beyond})
    for (const InertialDeviation& d : *deviations)
      if (!(d.relative <= limits.relative)) missed += (missed.empty() ? "" : ", ") + std::string(inertial_name(d.number));
  if (verdict.spec.least_spin_ratio && !verdict.criteria.back().pass())
    missed += (missed.empty() ? "" : ", ") + std::string("spin-ratio");
  verdict.meaning.push_back(missed.empty() ? "It has the numbers wanted, to within " + shown(100 * limits.relative) + " %."
                                           : "It does not have the numbers wanted: " + missed + " are off.");
  verdict.meaning.push_back(
      "With more plastic than the mesh holds, the same everywhere, mass and moments of inertia grow by as many percent (1 %: " +
      number(1.01 * verdict.state.body.mass_g, 2) + " g, 3 %: " + number(1.03 * verdict.state.body.mass_g, 2) +
      " g) and the centre of mass stays: weigh the print.");
  describe(verdict);
}

}  // namespace

TargetState target_state_of(const Mesh& mesh, const TargetSpec& spec, const Progress& progress) {
  check(spec, Setting::For::judging);
  const Mesh merged = merged_mesh(mesh);
  const Mesh material = material_of(merged, unbalanced_edges(merged) == 0, progress);
  return state_of(mass_properties(material, spec.print.density_g_cm3), bounding_box(merged).diagonal().norm(), spec);
}

TargetVerdict verify(const Mesh& delivered, const Mesh* original, const TargetSpec& spec, const Limits& limits,
                     const Progress& progress) {
  check(spec, Setting::For::judging);
  TargetVerdict verdict;
  verdict.spec = spec;
  const Surface surface = judge_surface(delivered, original, progress, verdict);
  verdict.state = state_of(mass_properties(surface.material, spec.print.density_g_cm3), surface.diagonal_mm, spec);
  add_surface_criteria(surface, {original != nullptr, spec.print, spec.up, limits.wall_ratio}, progress, verdict);
  conclude(verdict, limits);
  return verdict;
}

TargetVerdict verify_detail::judge_print(const PrintInHull& print, const TargetSpec& spec, const Limits& limits, const Progress&) {
  TargetVerdict verdict;
  verdict.spec = spec;
  verdict.state = state_of(mass_properties(print.s, spec.print.density_g_cm3), print.diagonal_mm, spec);
  conclude(verdict, limits);
  return verdict;
}

Figures state_figures(const Mesh& mesh, const TargetSpec& spec, const Limits&, const Progress& progress) {
  return figures_of(target_state_of(mesh, spec, progress), spec);
}

}  // namespace rayrep
