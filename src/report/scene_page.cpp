#include "rayrep/report/scene_page.h"

#include <algorithm>
#include <nlohmann/json.hpp>
#include <vector>

#include "base/text.h"
#include "rayrep/report/motion_report.h"
#include "rayrep/report/report.h"
#include "report/packed_mesh.h"
#include "report/page.h"

// What the page is given is written down in tools/report/README.md.

namespace rayrep {
namespace {

using namespace report_detail;
using Json = nlohmann::ordered_json;
using Kind = CollisionInterval::Kind;

constexpr std::size_t kMostTriangles = 600'000;  ///< of all parts, that are shown
constexpr std::size_t kMostTold = 5;             ///< collisions in words

std::string dumped(const Json& json) { return json.dump(-1, ' ', false, Json::error_handler_t::replace); }

Json vector(const Eigen::Vector3d& v) { return {v.x(), v.y(), v.z()}; }
Json quaternion(const Eigen::Quaterniond& q) { return {q.w(), q.x(), q.y(), q.z()}; }

// ------------------------------------------------------------------------------------------------------------------------- words

std::string percent(double share) { return concat(number(100 * share, 1), " %"); }

std::string names_of(const Scene& scene, const PairMotion& pair) {
  return concat(scene.parts[pair.first].name, " and ", scene.parts[pair.second].name);
}

struct Told {
  const PairMotion* pair;
  const CollisionInterval* interval;
};

std::string sentence(const Scene& scene, const Told& told) {
  const CollisionInterval& one = *told.interval;
  const bool near = one.only_near(told.pair->clearance_mm);
  std::string text =
      concat(names_of(scene, *told.pair), near ? " come too near to each other" : " overlap", " from ", percent(one.from), " to ",
             percent(one.to), " of '", scene.transitions[told.pair->transition].name, "'");
  if (one.worst_box_mm.isEmpty()) return concat(text, ".");
  text += concat(", worst at ", percent(one.worst_time), ": ");
  return concat(text,
                near ? concat(number(one.distance_mm, 3), " mm apart.") : concat(number(one.depth_mm, 2), " mm deep or more."));
}

/// Pairs that do no more than touch.
std::size_t touching_in(const MotionReport& report) {
  return static_cast<std::size_t>(std::count_if(report.pairs.begin(), report.pairs.end(), [](const PairMotion& pair) {
    return !pair.intervals.empty() &&
           std::all_of(pair.intervals.begin(), pair.intervals.end(), [](const auto& one) { return one.kind == Kind::contact; });
  }));
}

std::size_t undecided_in(const MotionReport& report) {
  return static_cast<std::size_t>(std::count_if(report.pairs.begin(), report.pairs.end(), [](const PairMotion& pair) {
    return std::any_of(pair.intervals.begin(), pair.intervals.end(), [](const auto& one) { return one.kind == Kind::undecided; });
  }));
}

/// Overlaps, the worst first.
std::vector<Told> overlaps_of(const MotionReport& report) {
  std::vector<Told> all;
  for (const PairMotion& pair : report.pairs)
    for (const CollisionInterval& one : pair.intervals)
      if (one.kind == Kind::overlap) all.push_back({&pair, &one});
  std::stable_sort(all.begin(), all.end(), [](const Told& a, const Told& b) {
    if (a.interval->intersection_mm != b.interval->intersection_mm)
      return a.interval->intersection_mm > b.interval->intersection_mm;
    return a.interval->to - a.interval->from > b.interval->to - b.interval->from;
  });
  return all;
}

std::string tested(const Scene& scene, const MotionReport& report) {
  return concat(plural(report.pairs.size(), "pair", "pairs"), " of parts on ", plural(scene.transitions.size(), "way", "ways"));
}

std::vector<std::string> told_of(const Scene& scene, const MotionReport& report, double tolerance) {
  if (report.stage != MotionReport::Stage::complete && report.pairs.empty()) return {"Collisions are being looked for."};
  if (report.pairs.empty()) return {"Nothing moves past anything else: no pair of parts had to be tested."};
  std::vector<std::string> sentences;
  const std::vector<Told> overlaps = overlaps_of(report);
  const std::size_t undecided = undecided_in(report);
  if (!overlaps.empty()) {
    sentences.push_back(concat("Parts get into each other: ", plural(overlaps.size(), "collision", "collisions"), " among ",
                               tested(scene, report), "."));
    for (std::size_t n = 0; n < std::min(overlaps.size(), kMostTold); ++n) sentences.push_back(sentence(scene, overlaps[n]));
    if (overlaps.size() > kMostTold) sentences.push_back(concat("And ", overlaps.size() - kMostTold, " more."));
  } else if (undecided == 0) {
    sentences.push_back(concat("No part gets into another: of ", tested(scene, report), " none overlaps for longer than ",
                               shown(100 * tolerance), " % of the way."));
  }
  if (undecided > 0) sentences.push_back(concat(plural(undecided, "pair is", "pairs are"), " still being looked at."));
  if (const std::size_t touching = touching_in(report))
    sentences.push_back(concat(plural(touching, "pair touches", "pairs touch"), ", which is no failure."));
  return sentences;
}

// -------------------------------------------------------------------------------------------------------------------------- data

Json json_of(const Motion& motion) {
  Json json = {{"translation", Json::array()}, {"rotation", Json::array()}};
  for (const TranslationKey& key : motion.translation)
    json["translation"].push_back(
        {{"time", key.time}, {"at", vector(key.at_mm)}, {"in", vector(key.in_mm)}, {"out", vector(key.out_mm)}});
  for (const RotationKey& key : motion.rotation)
    json["rotation"].push_back({{"time", key.time}, {"rotation", quaternion(key.rotation)}});
  return json;
}

Json ways_of(const Scene& scene) {
  Json ways = Json::array();
  for (const Transition& transition : scene.transitions) {
    Json way = {{"name", transition.name}, {"from", transition.from}, {"to", transition.to}, {"motions", Json::array()}};
    for (const Motion& motion : transition.motions) way["motions"].push_back(json_of(motion));
    ways.push_back(std::move(way));
  }
  return ways;
}

Json states_of(const Scene& scene) {
  Json states = Json::array();
  for (const SceneState& state : scene.states) {
    Json one = {{"name", state.name}, {"up", vector(state.up)}, {"rests", state.rests.has_value()}, {"poses", Json::array()}};
    for (const PartPose& pose : state.poses)
      one["poses"].push_back({{"rotation", quaternion(pose.rotation)}, {"translation", vector(pose.translation_mm)}});
    states.push_back(std::move(one));
  }
  return states;
}

/// What to_json tells, with ways and parts by their numbers: names need not be unique.
Json found_of(const Scene& scene, const MotionReport& report, double tolerance) {
  static constexpr const char* kStages[] = {"coarse", "when", "complete"};
  Json told = Json::parse(to_json(scene, report));
  Json found = {{"stage", kStages[static_cast<std::size_t>(report.stage)]},
                {"pass", report.free()},
                {"tolerance", tolerance},
                {"told", told_of(scene, report, tolerance)},
                {"kept", report.kept},
                {"pairs", std::move(told["pairs"])}};
  for (std::size_t n = 0; n < report.pairs.size(); ++n) {
    Json& pair = found["pairs"][n];
    pair["transition"] = report.pairs[n].transition;
    pair.erase("parts");
    pair["first"] = report.pairs[n].first;
    pair["second"] = report.pairs[n].second;
    for (std::size_t k = 0; k < report.pairs[n].intervals.size(); ++k)
      if (report.pairs[n].intervals[k].worst_box_mm.isEmpty()) pair["intervals"][k]["worst"] = nullptr;
  }
  return found;
}

}  // namespace

std::string found_json(const Scene& scene, const MotionReport& report, const ScenePage& page) {
  return dumped(found_of(scene, report, page.tolerance));
}

PageData page_data(const Scene& scene, const MotionReport& report, const ScenePage& page) {
  std::size_t all = 0;
  for (const ScenePart& part : scene.parts) all += part.mesh->triangles.size();
  const double share = std::min(1.0, static_cast<double>(kMostTriangles) / static_cast<double>(std::max<std::size_t>(all, 1)));
  Json parts = Json::array();
  PageData data;
  for (const ScenePart& part : scene.parts) {
    const auto most = static_cast<std::size_t>(share * static_cast<double>(part.mesh->triangles.size()));
    const Mesh drawn = coarsened(with_merged_vertices(*part.mesh), std::max<std::size_t>(most, 1000));
    const Eigen::AlignedBox3d box = bounding_box(drawn);
    const std::string id = concat("rayrep-mesh-", data.meshes.size());
    parts.push_back({{"name", part.name},
                     {"id", id},
                     {"low_mm", vector(box.min())},
                     {"size_mm", vector(box.sizes())},
                     {"pivot_mm", vector(part.pivot_mm)},
                     {"printed", part.printed},
                     {"triangles", part.mesh->triangles.size()},
                     {"shown", drawn.triangles.size()}});
    data.meshes.emplace_back(id, base64(packed(drawn, box)));
  }
  Json json = {{"contract", 1},
               {"title", page.name},
               {"version", version()},
               {"scene", {{"parts", std::move(parts)}, {"states", states_of(scene)}, {"transitions", ways_of(scene)}}},
               {"found", found_of(scene, report, page.tolerance)}};
  if (page.balance) json["balance"] = Json::parse(balance_json(scene, *page.balance));
  data.json = dumped(json);
  return data;
}

std::string to_html(const Scene& scene, const MotionReport& report, const ScenePage& page) {
  const std::string text = (page.balance ? to_text(*page.balance) + "\n" : "") + to_text(scene, report);
  return written(page.name, text, page_data(scene, report, page));
}

}  // namespace rayrep
