#include <algorithm>
#include <cctype>
#include <cmath>
#include <limits>
#include <numbers>
#include <string>

#include "base/text.h"
#include "judge/figures.h"
#include "judge/verify_detail.h"
#include "rayrep/judge/verify.h"
#include "rayrep/physics/ground_rest.h"

namespace rayrep {
namespace {

using namespace verify_detail;

StandSpec as_stand(const PoseSpec& spec, const Pose& pose) {
  StandSpec stand;
  stand.print = spec.print;
  stand.up = pose.up_or(spec.up);
  stand.contact_tolerance_mm = spec.contact_tolerance_mm;
  return stand;
}

FloatSpec as_float(const PoseSpec& spec, const Pose& pose) {
  FloatSpec afloat;
  afloat.print = spec.print;
  afloat.up = pose.up_or(spec.up);
  afloat.fluid_g_cm3 = spec.fluid_g_cm3;
  afloat.waterline_mm = pose.waterline_mm;
  return afloat;
}

SpinSpec as_spin(const PoseSpec& spec, const Pose& pose) {
  SpinSpec spin;
  spin.print = spec.print;
  spin.up = pose.up_or(spec.up);
  spin.axis = pose.axis;
  return spin;
}

Verdict judge_hanging(const PrintInHull& print, const PoseSpec& spec, const Pose& pose, const Limits& limits) {
  Verdict verdict;
  verdict.body = mass_properties(print.s, spec.print.density_g_cm3);
  const HangState state = hang_state_of(verdict.body, pose.point_mm, pose.up_or(spec.up));
  verdict.figures = {
      {.name = "below_mm", .words = "centre of mass below its point", .unit = Unit::mm, .value = state.below_mm},
      {.name = "beside_mm", .words = "and beside the vertical", .unit = Unit::mm, .value = state.beside_mm, .digits = 5},
      {.name = "hangs_at_rad", .words = "hangs at a tilt of", .unit = Unit::rad, .value = state.tilt_rad}};
  verdict.criteria = {at_most("hangs", "tilt at which it hangs, rad", state.tilt_rad, limits.settled_tilt_rad)};
  if (!verdict.criteria.front().pass()) {
    verdict.meaning = {"It does not hang upright: it comes to hang " + degrees(state.tilt_rad, 2) + " off."};
    return verdict;
  }
  const double scatter_mm = print_scatter_mm(print.diagonal_mm);
  verdict.meaning = {"It hangs upright, its centre of mass " + number(state.below_mm, 2) + " mm below the point; with that " +
                     scatter_words(scatter_mm) + " off, as prints scatter, it hangs " +
                     degrees(std::atan2(scatter_mm, state.below_mm), 2) + " off upright."};
  return verdict;
}

Verdict judge_righting(const PrintInHull& print, const PoseSpec& spec, const Pose& pose, const Limits& limits,
                       const Progress& progress) {
  Verdict verdict;
  verdict.body = mass_properties(print.s, spec.print.density_g_cm3);
  const Righted state = righted(print.hull, verdict.body.centre_of_mass_mm, pose.up_or(spec.up), progress);
  Figure tilt{.name = "righted_tilt_rad", .words = "comes to rest at a tilt of", .unit = Unit::rad, .value = {}};
  if (state.rests) tilt.value = state.tilt_rad;
  verdict.figures = {tilt, {.name = "righted_up", .words = "", .value = list(state.up)}};
  verdict.criteria = {at_most("righted", "largest tilt at rest, let go all around, rad",
                              state.rests ? state.tilt_rad : std::numeric_limits<double>::quiet_NaN(), limits.righted_tilt_rad)};
  verdict.meaning = {verdict.criteria.front().pass()
                         ? "It rights itself from wherever it is let go, to within " + degrees(state.tilt_rad, 2) + "."
                     : state.rests ? "It does not right itself: it also rests " + degrees(state.tilt_rad, 2) + " off, with " +
                                         shown(state.up) + " up."
                                   : "It does not come to rest."};
  return verdict;
}

/// What the poses have come to, and the smallest tipping angle of them.
struct Judged {
  std::vector<Verdict> poses;
  double smallest_tipping_angle_rad = std::numeric_limits<double>::infinity();
};

Judged judge_each(const PrintInHull& print, const PoseSpec& spec, const Limits& limits, const Progress& progress) {
  Judged judged;
  for (const Pose& pose : spec.poses) {
    progress.check();
    switch (pose.kind) {
      case Pose::Kind::stands: {
        const StandVerdict stands = judge_print(print, as_stand(spec, pose), limits, progress);
        judged.smallest_tipping_angle_rad = std::min(judged.smallest_tipping_angle_rad, stands.state.smallest_tipping_angle_rad);
        judged.poses.push_back(stands);
        break;
      }
      case Pose::Kind::hangs:
        judged.poses.push_back(judge_hanging(print, spec, pose, limits));
        break;
      case Pose::Kind::floats:
        judged.poses.push_back(judge_print(print, as_float(spec, pose), limits, progress));
        break;
      case Pose::Kind::rights:
        judged.poses.push_back(judge_righting(print, spec, pose, limits, progress));
        break;
      case Pose::Kind::spins:
        judged.poses.push_back(judge_print(print, as_spin(spec, pose), limits, progress));
        break;
    }
  }
  return judged;
}

/// Of the body, then of each pose what is its own: "pose_1_below_mm", "1: centre of mass below its point".
Figures figures_of(const Judged& judged, const MassProperties& body) {
  Figures figures = body_figures(body, "mass");
  const Figures common = figures;
  Figure angle{.name = "smallest_tipping_angle_rad", .words = "smallest tipping angle of all", .unit = Unit::rad, .value = {}};
  if (std::isfinite(judged.smallest_tipping_angle_rad))
    angle.value = judged.smallest_tipping_angle_rad;
  else
    angle.words.clear();
  figures.push_back(angle);
  for (std::size_t n = 0; n < judged.poses.size(); ++n)
    for (Figure figure : judged.poses[n].figures) {
      if (std::any_of(common.begin(), common.end(), [&](const Figure& f) { return f.name == figure.name; })) continue;
      const std::string place = std::to_string(n + 1);
      // Edges are too many for a table.
      figure.words = figure.words.empty() || figure.name == "tipping_angles_rad" ? "" : place + ": " + figure.words;
      figure.name = "pose_" + place + "_" + figure.name;
      figures.push_back(std::move(figure));
    }
  return figures;
}

const char* name_of(Pose::Kind kind) {
  switch (kind) {
    case Pose::Kind::stands:
      return "stands";
    case Pose::Kind::hangs:
      return "hangs";
    case Pose::Kind::floats:
      return "floats";
    case Pose::Kind::spins:
      return "spins";
    case Pose::Kind::rights:
      break;
  }
  return "rights itself";
}

void add_point(const Eigen::Vector3d& point_mm, Record& record) {
  record.emplace_back("point_x_mm", point_mm.x());
  record.emplace_back("point_y_mm", point_mm.y());
  record.emplace_back("point_z_mm", point_mm.z());
}

/// For JSON. @param judged  each of the poses, with what was left open; none: they were not
std::vector<Record> records(const PoseSpec& spec, const std::vector<Verdict>& judged) {
  std::vector<Record> all;
  for (std::size_t n = 0; n < spec.poses.size(); ++n) {
    const Pose& pose = spec.poses[n];
    const Eigen::Vector3d up = pose.up_or(spec.up);
    Record record = {{"words", words_of(pose, spec.up)},
                     {"kind", std::string(name_of(pose.kind))},
                     {"up_x", up.x()},
                     {"up_y", up.y()},
                     {"up_z", up.z()}};
    const double* waterline_mm = n < judged.size() ? wanted_of<double>(judged[n], "waterline_mm") : nullptr;
    if (pose.waterline_mm || waterline_mm) record.emplace_back("waterline_mm", waterline_mm ? *waterline_mm : *pose.waterline_mm);
    const auto* contact_mm = n < judged.size() ? wanted_of<std::vector<double>>(judged[n], "contact_mm") : nullptr;
    if (pose.kind == Pose::Kind::hangs) add_point(pose.point_mm, record);
    if (contact_mm && contact_mm->size() == 3) add_point({(*contact_mm)[0], (*contact_mm)[1], (*contact_mm)[2]}, record);
    all.push_back(std::move(record));
  }
  return all;
}

void describe(PoseVerdict& verdict) {
  const PoseSpec& spec = verdict.spec;
  verdict.goal = PoseSpec::kGoal;
  for (std::size_t n = 0; n < spec.poses.size(); ++n) {
    const Pose& pose = spec.poses[n];
    verdict.headline += "pose " + std::to_string(n + 1) + " " + words_of(pose, spec.up) +
                        (pose.waterline_mm ? " at " + number(*pose.waterline_mm, 3) + " mm" : "") + ", ";
  }
  verdict.headline += print_words(spec.print);
  verdict.wanted = {{.name = "up", .words = "", .value = list(spec.up)},
                    {.name = "poses", .words = "", .value = records(spec, verdict.poses)},
                    {.name = "fluid_g_cm3", .words = "", .unit = Unit::g_cm3, .value = spec.fluid_g_cm3}};
  add_print(spec.print, verdict.wanted);
}

/// "it stands ..." after the name of its pose.
std::string continued(std::string sentence) {
  if (!sentence.empty()) sentence[0] = static_cast<char>(std::tolower(static_cast<unsigned char>(sentence[0])));
  return sentence;
}

/// The criteria of the poses, and what they come to.
void conclude(PoseVerdict& verdict, const PrintInHull& print, const Limits& limits, const Progress& progress) {
  const Judged judged = judge_each(print, verdict.spec, limits, progress);
  verdict.body = mass_properties(print.s, verdict.spec.print.density_g_cm3);
  put_first(figures_of(judged, verdict.body), verdict.figures);
  verdict.smallest_tipping_angle_rad = judged.smallest_tipping_angle_rad;
  verdict.poses = judged.poses;
  for (std::size_t n = 0; n < judged.poses.size(); ++n) {
    const std::string place = std::to_string(n + 1);
    for (Criterion c : judged.poses[n].criteria) {
      c.name = "pose_" + place + "_" + c.name;
      c.description = place + ": " + c.description;
      verdict.criteria.push_back(std::move(c));
    }
    const Pose& posed = verdict.spec.poses[n];
    const std::string title = posed.state.empty() ? "Pose " + place : "In the state '" + posed.state + "'";
    const std::string pose = title + ", " + words_of(posed, verdict.spec.up) + ": ";
    std::string meaning;
    for (const std::string& sentence : judged.poses[n].meaning) meaning += meaning.empty() ? continued(sentence) : " " + sentence;
    verdict.meaning.push_back(pose + meaning);
    for (const std::string& note : judged.poses[n].notes) verdict.notes.push_back(pose + continued(note));
  }
  if (verdict.spec.least_tip_deg)
    verdict.criteria.push_back(at_least("least_tip", "smallest tipping angle of all, rad", judged.smallest_tipping_angle_rad,
                                        *verdict.spec.least_tip_deg * std::numbers::pi / 180 - 1e-4));
  describe(verdict);
}

}  // namespace

HangState hang_state_of(const MassProperties& body, const Eigen::Vector3d& point_mm, const Eigen::Vector3d& up) {
  const Eigen::Vector3d string = point_mm - body.centre_of_mass_mm;
  const Eigen::Vector3d vertical = up.normalized();
  HangState state;
  state.below_mm = vertical.dot(string);
  state.beside_mm = (string - state.below_mm * vertical).norm();
  state.tilt_rad = std::atan2(state.beside_mm, state.below_mm);
  return state;
}

PoseVerdict verify(const Mesh& delivered, const Mesh* original, const PoseSpec& spec, const Limits& limits,
                   const Progress& progress) {
  return judge_in_hull<PoseVerdict>({delivered, original, limits, progress}, spec, conclude, describe, "of its poses");
}

PoseVerdict verify_detail::judge_print(const PrintInHull& print, const PoseSpec& spec, const Limits& limits,
                                       const Progress& progress) {
  PoseVerdict verdict;
  verdict.spec = spec;
  conclude(verdict, print, limits, progress);
  return verdict;
}

Figures state_figures(const Mesh& mesh, const PoseSpec& spec, const Limits& limits, const Progress& progress) {
  check(spec, Setting::For::judging);
  const Mesh merged = merged_mesh(mesh);
  const Mesh material = material_of(merged, unbalanced_edges(merged) == 0, progress);
  const Moments s = mesh_moments(material);
  return figures_of(judge_each(in_hull(merged, s, progress), spec, limits, progress), mass_properties(s, spec.print.density_g_cm3));
}

}  // namespace rayrep
