#include <nlohmann/json.hpp>

#include "rayrep/report/motion_report.h"
#include "rayrep/report/report.h"

namespace rayrep {
namespace {

using Json = nlohmann::ordered_json;

std::string dumped(const Json& json) { return json.dump(2, ' ', false, Json::error_handler_t::replace) + "\n"; }

Json point(const Eigen::Vector3d& p) { return {p.x(), p.y(), p.z()}; }

const char* word(CollisionInterval::Kind kind) {
  switch (kind) {
    case CollisionInterval::Kind::undecided:
      return "undecided";
    case CollisionInterval::Kind::contact:
      return "contact";
    case CollisionInterval::Kind::overlap:
      break;
  }
  return "overlap";
}

Json json_of(const CollisionInterval& interval) {
  Json json = {{"kind", word(interval.kind)}, {"from", interval.from}, {"to", interval.to}, {"within", interval.within}};
  json["intersection_mm"] = interval.intersection_mm;
  Json worst = {{"time", interval.worst_time},
                {"box_mm", {point(interval.worst_box_mm.min()), point(interval.worst_box_mm.max())}},
                {"depth_mm", interval.depth_mm},
                {"distance_mm", interval.distance_mm},
                {"contour_length_mm", interval.contour_length_mm}};
  worst["contour_mm"] = Json::array();
  for (const auto& piece : interval.contour_mm) worst["contour_mm"].push_back({point(piece[0]), point(piece[1])});
  json["worst"] = worst;
  return json;
}

const char* word(SceneProblem::Kind kind) {
  switch (kind) {
    case SceneProblem::Kind::not_solid:
      return "not_solid";
    case SceneProblem::Kind::no_part:
      return "no_part";
    case SceneProblem::Kind::leaves:
      return "leaves";
    case SceneProblem::Kind::overlap:
      return "overlap";
    case SceneProblem::Kind::form:
      break;
  }
  return "form";
}

}  // namespace

std::string to_json(const Scene& scene, const MotionReport& report) {
  Json json = {{"schema", 1}, {"version", version()}, {"command", "motion"}, {"pass", report.free()}};
  json["transitions"] = Json::array();
  for (const Transition& t : scene.transitions)
    json["transitions"].push_back({{"name", t.name}, {"from", scene.states[t.from].name}, {"to", scene.states[t.to].name}});
  json["pairs"] = Json::array();
  for (const PairMotion& pair : report.pairs) {
    Json told = {{"transition", scene.transitions[pair.transition].name},
                 {"parts", {scene.parts[pair.first].name, scene.parts[pair.second].name}},
                 {"clearance_mm", pair.clearance_mm}};
    told["intervals"] = Json::array();
    for (const CollisionInterval& interval : pair.intervals) told["intervals"].push_back(json_of(interval));
    json["pairs"].push_back(told);
  }
  json["moments"] = report.moments;
  return dumped(json);
}

std::string to_json(const SceneFile& file, const std::string& name) {
  Json json = {{"schema", 1}, {"version", version()}, {"command", "scene"}, {"scene", name}, {"pass", file.problems.empty()}};
  json["parts"] = Json::array();
  for (const ScenePart& part : file.scene.parts)
    json["parts"].push_back({{"name", part.name},
                             {"mesh", part.file.string()},
                             {"triangles", part.mesh ? part.mesh->triangles.size() : 0},
                             {"printed", part.printed},
                             {"density_g_cm3", part.print.density_g_cm3},
                             {"wall_mm", part.print.wall_mm}});
  json["states"] = Json::array();
  for (const SceneState& state : file.scene.states) json["states"].push_back(state.name);
  json["transitions"] = Json::array();
  for (const Transition& t : file.scene.transitions) json["transitions"].push_back(t.name);
  json["notes"] = file.notes;
  json["problems"] = Json::array();
  for (const SceneProblem& problem : file.problems) {
    Json told = {{"kind", word(problem.kind)}, {"where", problem.where}, {"message", problem.message}};
    if (!problem.part.empty()) told["part"] = problem.part;
    if (!problem.other.empty()) told["other"] = problem.other;
    if (problem.place_mm) told["place_mm"] = point(*problem.place_mm);
    json["problems"].push_back(told);
  }
  return dumped(json);
}

std::string to_json(const std::string& part, const std::string& by, const std::string& output, const Carving& carving) {
  return dumped({{"schema", 1},
                 {"version", version()},
                 {"command", "carve"},
                 {"part", part},
                 {"by", by},
                 {"output", output},
                 {"at_least_mm", carving.at_least_mm},
                 {"at_most_mm", carving.at_most_mm},
                 {"removed_mm3", carving.removed_mm3},
                 {"bodies", carving.bodies},
                 {"triangles", carving.left.triangles.size()}});
}

}  // namespace rayrep
