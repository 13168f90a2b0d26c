#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <string>

#include "base/text.h"
#include "judge/figures.h"
#include "judge/verify_detail.h"
#include "rayrep/base/error.h"
#include "rayrep/judge/verify.h"

namespace rayrep {
namespace {

using namespace verify_detail;

constexpr double kRounding = 1e-3;  ///< of the fairness
constexpr double kEqual = 1.05;     ///< a ratio of shares that people call fair

std::string percent(double share) { return rayrep::percent(share, 2); }
std::string up_words(const Eigen::Vector3d& up) { return shown_to_thousandths(up.normalized()); }

DiceState state_of(const Tumbler& tumbler, const MassProperties& body, const DiceSpec& spec) {
  DiceState state;
  state.body = body;
  state.rests = tumbler.rests(body.centre_of_mass_mm);
  state.counted = spec.faces > 0 ? std::min(state.rests.size(), static_cast<std::size_t>(spec.faces)) : state.rests.size();
  state.largest_share = state.rests.front().share;
  state.smallest_share = state.rests[state.counted - 1].share;
  if (spec.load) state.load_share = share_with_up(state.rests, spec.load->up);
  return state;
}

double ratio(const DiceState& state) {
  return state.smallest_share > 0 ? state.largest_share / state.smallest_share : std::numeric_limits<double>::infinity();
}

/// The largest principal moment of inertia over the smallest one.
double unevenness(const MassProperties& body) { return body.principal_moments_g_mm2[2] / body.principal_moments_g_mm2[0]; }

/// What a table tells of each face, by what is up; of many the first, and the others together.
Record shares_by_up(const DiceState& state) {
  constexpr std::size_t most = 24;
  Record shares;
  double others = 0;
  for (std::size_t n = 0; n < state.rests.size(); ++n)
    if (n < most)
      shares.emplace_back(up_words(state.rests[n].up), state.rests[n].share);
    else
      others += state.rests[n].share;
  if (state.rests.size() > most) shares.emplace_back("one of the " + std::to_string(state.rests.size() - most) + " others", others);
  return shares;
}

std::vector<Record> records(const DiceState& state) {
  std::vector<Record> faces;
  for (const RestingFace& face : state.rests)
    faces.push_back({{"up_x", face.up.x()},
                     {"up_y", face.up.y()},
                     {"up_z", face.up.z()},
                     {"share", face.share},
                     {"height_mm", face.height_mm},
                     {"holds_rad", face.holds_rad}});
  return faces;
}

Figures figures_of(const DiceState& state, const DiceSpec& spec) {
  Figures figures = body_figures(state.body, "mass");
  figures.push_back(
      {.name = "inertia_ratio", .words = "largest moment of inertia over the smallest", .value = unevenness(state.body)});
  figures.push_back({.name = "resting_faces",
                     .words = "faces on which it comes to rest",
                     .value = static_cast<double>(state.rests.size()),
                     .digits = 0});
  figures.push_back({.name = "counted_faces",
                     .words = spec.faces > 0 ? "of these count" : "",
                     .value = static_cast<double>(state.counted),
                     .digits = 0});
  figures.push_back({.name = "largest_share", .words = "", .value = state.largest_share});
  figures.push_back({.name = "smallest_share", .words = "", .value = state.smallest_share});
  if (!spec.load) {
    figures.push_back(
        {.name = "share_ratio", .words = "largest share of throws over the smallest", .value = ratio(state), .digits = 4});
    double off = 0;
    const double fair = 1 / static_cast<double>(state.counted);
    for (std::size_t n = 0; n < state.counted; ++n) off = std::max(off, std::abs(state.rests[n].share - fair));
    figures.push_back({.name = "off_equal", .words = "largest deviation from an equal share", .value = off, .digits = 5});
  } else {
    figures.push_back({.name = "load_share",
                       .words = "share of throws with " + up_words(spec.load->up) + " up",
                       .value = state.load_share,
                       .digits = 4});
  }
  figures.push_back({.name = "shares", .words = "share of throws, up:", .value = shares_by_up(state), .digits = 4});
  figures.push_back({.name = "faces", .words = "", .value = records(state)});
  return figures;
}

/// The state at its worst with the centre of mass off by so much in any of 14 directions.
double scattered(const Tumbler& tumbler, const DiceState& state, const DiceSpec& spec, double scatter_mm) {
  std::vector<Eigen::Vector3d> directions;
  for (int axis = 0; axis < 3; ++axis)
    for (const double sign : {-1.0, 1.0}) directions.push_back(sign * Eigen::Vector3d::Unit(axis));
  for (int n = 0; n < 8; ++n) directions.push_back(Eigen::Vector3d(n & 1 ? 1 : -1, n & 2 ? 1 : -1, n & 4 ? 1 : -1).normalized());
  std::vector<double> found(directions.size());
  tbb::parallel_for(std::size_t{0}, directions.size(), [&](std::size_t n) {
    MassProperties body = state.body;
    body.centre_of_mass_mm += scatter_mm * directions[n];
    try {
      const DiceState there = state_of(tumbler, body, spec);
      found[n] = spec.load ? there.load_share : ratio(there);
    } catch (const Error&) {
      found[n] = spec.load ? 0 : std::numeric_limits<double>::infinity();  // outside of a body that is so small
    }
  });
  return spec.load ? *std::min_element(found.begin(), found.end()) : *std::max_element(found.begin(), found.end());
}

void say_fair(DiceVerdict& verdict, bool falls_fairly) {
  const DiceState& state = verdict.state;
  const std::string least = percent(state.smallest_share);
  const std::string most = percent(state.largest_share);
  const std::string shares = least == most ? most : least + " to " + most;
  const std::string scatter = scatter_words(verdict.scatter_mm);
  const std::size_t all = state.rests.size();
  const std::string faces = state.counted == all ? "each of its " + std::to_string(all) + " faces"
                                                 : std::to_string(state.counted) + " of its " + std::to_string(all) + " faces";
  const std::string how = !falls_fairly            ? "It does not fall fairly"
                          : ratio(state) <= kEqual ? "It falls fairly"
                                                   : "It falls as fairly as was asked for";
  verdict.meaning.push_back(how + ": thrown, it comes to rest on " + faces + " in " + shares + " of all throws" +
                            (falls_fairly ? "" : ", with " + up_words(state.rests.front().up) + " up most often") +
                            (std::isfinite(verdict.scattered)
                                 ? "; with its centre of mass " + scatter + " off, as prints scatter, on one up to " +
                                       number(verdict.scattered, 2) + " times as often as on another."
                                 : "."));
  if (state.counted == all) return;
  double others = 0;
  for (std::size_t n = state.counted; n < all; ++n) others += state.rests[n].share;
  verdict.meaning.push_back("In " + percent(others) + " of all throws it comes to rest on one of the " +
                            std::to_string(all - state.counted) + " others, which do not count.");
}

void say_loaded(DiceVerdict& verdict) {
  const std::string up = up_words(verdict.spec.load->up);
  const DiceState& state = verdict.state;
  verdict.meaning.push_back(
      state.load_share > 0
          ? "It is loaded: thrown, it comes to rest with " + up + " up in " + percent(state.load_share) +
                " of all throws (solid in " + percent(verdict.solid.load_share) + "); with its centre of mass " +
                scatter_words(verdict.scatter_mm) + " off, as prints scatter, in no less than " + percent(verdict.scattered) + "."
          : "It never comes to rest with " + up + " up, but most often with " + up_words(state.rests.front().up) + " up.");
}

void say_model(DiceVerdict& verdict) {
  verdict.meaning.push_back(
      "These shares are those of a body that is let go with a random attitude on level, hard ground and rolls to rest without "
      "bouncing, sliding or momentum. Real throws bounce, and how often each face comes up then depends on hand and table" +
      (verdict.spec.load
           ? std::string(".")
           : "; equal moments of inertia, which favour no axis, are the second thing a fair die has: here the largest "
             "is " +
                 number(unevenness(verdict.state.body), 3) + " times the smallest."));
}

void describe(DiceVerdict& verdict) {
  const DiceSpec& spec = verdict.spec;
  verdict.goal = DiceSpec::kGoal;
  const std::string share = spec.load && spec.load->share ? " in " + percent(*spec.load->share) + " of all throws" : "";
  verdict.headline = (spec.load ? "loaded: " + up_words(spec.load->up) + " up" + share
                                : (spec.faces > 0 ? std::to_string(spec.faces) + " faces" : std::string("all faces")) +
                                      " as often, to a ratio of " + shown(spec.fairness)) +
                     ", " + print_words(spec.print);
  Figure load_up{.name = "load_up", .words = "", .value = {}};
  Figure load_share{.name = "load_share", .words = "", .value = {}};
  if (spec.load) load_up.value = list(spec.load->up);
  if (spec.load && spec.load->share) load_share.value = *spec.load->share;
  verdict.wanted = {load_up, load_share, {.name = "faces", .words = "", .value = {}}};
  if (spec.faces > 0) verdict.wanted.back().value = static_cast<double>(spec.faces);
  verdict.wanted.push_back({.name = "fairness", .words = "", .value = spec.fairness});
  verdict.wanted.push_back({.name = "shake_deg", .words = "", .value = spec.shake_deg});
  add_print(spec.print, verdict.wanted);
}

/// The criteria of the die, and what they come to.
void conclude(DiceVerdict& verdict, const PrintInHull& print, const Limits& limits, const Progress& progress) {
  const DiceSpec& spec = verdict.spec;
  progress.check();
  const Tumbler tumbler(print.hull, spec.shake_deg * std::numbers::pi / 180);
  verdict.state = state_of(tumbler, mass_properties(print.s, spec.print.density_g_cm3), spec);
  verdict.solid = state_of(tumbler, mass_properties(print.hull, spec.print.density_g_cm3), spec);
  verdict.body = verdict.state.body;
  verdict.scatter_mm = print_scatter_mm(print.diagonal_mm);
  verdict.scattered = scattered(tumbler, verdict.state, spec, verdict.scatter_mm);
  progress.check();
  put_first(figures_of(verdict.state, spec), verdict.figures);
  auto& criteria = verdict.criteria;
  if (!spec.load) {
    criteria.push_back(at_least("faces", "faces on which it comes to rest", static_cast<double>(verdict.state.rests.size()),
                                std::max(2, spec.faces)));
    criteria.push_back(
        at_most("fairness", "largest share of throws over the smallest", ratio(verdict.state), spec.fairness * (1 + kRounding)));
    say_fair(verdict, criteria.back().pass() && criteria[criteria.size() - 2].pass());
  } else {
    const double share = verdict.state.load_share;
    criteria.push_back(spec.load->share ? at_most("load", "share of throws off the wanted one", std::abs(share - *spec.load->share),
                                                  limits.load_share)
                                        : at_least("load", "share of throws", share, 1e-9));
    say_loaded(verdict);
  }
  say_model(verdict);
  describe(verdict);
}

}  // namespace

DiceVerdict verify(const Mesh& delivered, const Mesh* original, const DiceSpec& spec, const Limits& limits,
                   const Progress& progress) {
  return judge_in_hull<DiceVerdict>({delivered, original, limits, progress}, spec, conclude, describe, "of its throws");
}

DiceVerdict verify_detail::judge_print(const PrintInHull& print, const DiceSpec& spec, const Limits& limits,
                                       const Progress& progress) {
  DiceVerdict verdict;
  verdict.spec = spec;
  conclude(verdict, print, limits, progress);
  return verdict;
}

Figures state_figures(const Mesh& mesh, const DiceSpec& spec, const Limits&, const Progress& progress) {
  check(spec, Setting::For::judging);
  const Mesh merged = merged_mesh(mesh);
  const Mesh material = material_of(merged, unbalanced_edges(merged) == 0, progress);
  const Tumbler tumbler(in_hull(merged, mesh_moments(material), progress).hull, spec.shake_deg * std::numbers::pi / 180);
  return figures_of(state_of(tumbler, mass_properties(material, spec.print.density_g_cm3), spec), spec);
}

}  // namespace rayrep
