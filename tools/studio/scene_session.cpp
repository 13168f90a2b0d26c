#include "scene_session.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <utility>

#include "rayrep/base/error.h"
#include "rayrep/judge/verify_mechanism.h"
#include "rayrep/mesh/mesh_check.h"
#include "rayrep/report/balance_report.h"
#include "rayrep/report/scene_page.h"

namespace rayrep::tool {
namespace {

using Json = nlohmann::json;

[[noreturn]] void refuse(const std::string& what) { throw Error(ErrorCode::usage, "The edit cannot be used: " + what + "."); }

Json object_of(const std::string& text) {
  const Json json = Json::parse(text, nullptr, false);
  if (!json.is_object() || !json.contains("transitions") || !json["transitions"].is_array()) refuse("it has no \"transitions\"");
  return json;
}

double number_of(const Json& json, double most) {
  if (!json.is_number() || !(std::abs(json.get<double>()) <= most)) refuse("a number is missing, or too large");
  return json.get<double>();
}

const Json& member(const Json& json, const char* name) {
  if (!json.is_object() || !json.contains(name)) refuse(std::string("a \"") + name + "\" is missing");
  return json[name];
}

Eigen::Vector3d point_of(const Json& json) {
  if (!json.is_array() || json.size() != 3) refuse("a point is not three numbers");
  return {number_of(json[0], kLargestBody_mm), number_of(json[1], kLargestBody_mm), number_of(json[2], kLargestBody_mm)};
}

Eigen::Quaterniond rotation_of(const Json& json) {
  if (!json.is_array() || json.size() != 4) refuse("a rotation is not four numbers");
  const Eigen::Quaterniond q(number_of(json[0], 1.001), number_of(json[1], 1.001), number_of(json[2], 1.001),
                             number_of(json[3], 1.001));
  if (std::abs(q.norm() - 1) > 1e-3) refuse("a rotation is no quaternion of length 1");
  return q.normalized();
}

/// A list of keys, from 0 to 1 or of one, with times that ascend.
template <typename Key, typename Read>
std::vector<Key> keys_of(const Json& json, const Read& read) {
  constexpr std::size_t kMost = 10000;
  if (!json.is_array() || json.size() > kMost) refuse("a way has no list of keys, or too long a one");
  std::vector<Key> keys;
  for (const Json& one : json) {
    keys.push_back(read(one));
    keys.back().time = number_of(member(one, "time"), 1);
  }
  const bool ascends = std::is_sorted(keys.begin(), keys.end(), [](const Key& a, const Key& b) { return a.time <= b.time; });
  if (!ascends) refuse("times of keys have to ascend");
  if (keys.size() > 1 && (keys.front().time != 0 || keys.back().time != 1)) refuse("keys have to begin at 0 and to end at 1");
  return keys;
}

Motion motion_of(const Json& json) {
  Motion motion;
  motion.translation = keys_of<TranslationKey>(member(json, "translation"), [](const Json& one) {
    return TranslationKey{0, point_of(member(one, "at")), point_of(member(one, "in")), point_of(member(one, "out"))};
  });
  motion.rotation = keys_of<RotationKey>(member(json, "rotation"), [](const Json& one) {
    return RotationKey{0, rotation_of(member(one, "rotation"))};
  });
  return motion;
}

/// @throws Error{usage} where it does not begin and end in the states
void require_ends(const Motion& motion, const PartPose& from, const PartPose& to, const std::string& part) {
  const auto meets = [](const PartPose& a, const PartPose& b) {
    return (a.translation_mm - b.translation_mm).norm() <= 1e-6 * (1 + b.translation_mm.norm()) &&
           a.rotation.angularDistance(b.rotation) <= 1e-5;
  };
  if (!meets(motion.at(0), from) || !meets(motion.at(1), to)) refuse("'" + part + "' does not begin and end in the states");
}

/// Puts the parts where an edit has them in the states; an edit without states leaves them.
void put_parts(const Json& edit, Scene& scene) {
  if (!edit.contains("states")) return;
  const Json& states = edit["states"];
  if (!states.is_array() || states.size() != scene.states.size()) refuse("it has another number of states");
  for (std::size_t n = 0; n < scene.states.size(); ++n) {
    const Json& poses = member(states[n], "poses");
    if (!poses.is_array() || poses.size() != scene.parts.size()) refuse("a state has another number of parts");
    for (std::size_t p = 0; p < scene.parts.size(); ++p)
      scene.states[n].poses[p] = {rotation_of(member(poses[p], "rotation")), point_of(member(poses[p], "translation"))};
  }
}

bool same_states(const Scene& a, const Scene& b) {
  const auto same_pose = [](const PartPose& x, const PartPose& y) {
    return x.rotation.coeffs() == y.rotation.coeffs() && x.translation_mm == y.translation_mm;
  };
  return std::equal(a.states.begin(), a.states.end(), b.states.begin(), b.states.end(),
                    [&](const SceneState& x, const SceneState& y) {
                      return std::equal(x.poses.begin(), x.poses.end(), y.poses.begin(), y.poses.end(), same_pose);
                    });
}

/// What overlaps in the states. @param states  without ways
Json json_of(const std::vector<SceneProblem>& problems, const Scene& states) {
  Json json = Json::array();
  for (const SceneProblem& problem : problems) {
    std::size_t n = 0;
    while (n < states.states.size() && problem.where != "states, " + states.states[n].name) ++n;
    const Eigen::Vector3d place = problem.place_mm.value_or(Eigen::Vector3d::Zero());
    json.push_back({{"state", n}, {"message", problem.message}, {"place_mm", {place.x(), place.y(), place.z()}}});
  }
  return json;
}

/// Most of what would be sent, and only wanted once all is known.
MotionReport without_contours(MotionReport report) {
  for (PairMotion& pair : report.pairs)
    for (CollisionInterval& interval : pair.intervals) interval.contour_mm.clear();
  return report;
}

}  // namespace

SceneSession::SceneSession(const std::filesystem::path& path, const MotionCheckOptions& options, const Progress& progress)
    : path_(path), options_(options) {
  SceneFile file = read_scene(path, progress);
  require_scene(file, path.string());
  scene_ = std::move(file.scene);
}

std::string SceneSession::start() const {
  const PageData data = page_data(scene_, MotionReport{}, {path_.filename().string(), options_.tolerance});
  Json blocks = Json::object();
  for (const auto& [id, packed] : data.meshes) blocks[id] = packed;
  return "{\"data\":" + data.json + ",\"blocks\":" + blocks.dump() + "}";
}

Scene SceneSession::edited(const Json& edit) const {
  Scene scene = scene_;
  put_parts(edit, scene);
  const Json& transitions = edit.at("transitions");
  if (transitions.size() != scene.transitions.size()) refuse("it has another number of ways");
  for (std::size_t t = 0; t < scene.transitions.size(); ++t) {
    Transition& transition = scene.transitions[t];
    const Json& motions = member(transitions[t], "motions");
    if (!motions.is_array() || motions.size() != scene.parts.size()) refuse("a way has another number of parts");
    for (std::size_t p = 0; p < scene.parts.size(); ++p) {
      transition.motions[p] = motion_of(motions[p]);
      require_ends(transition.motions[p], scene.states[transition.from].poses[p], scene.states[transition.to].poses[p],
                   scene.parts[p].name);
    }
  }
  return scene;
}

void SceneSession::check(const std::string& edit, const std::function<bool(const std::string&)>& tell) {
  const Scene scene = edited(object_of(edit));
  const Latest::Turn turn(latest_, Latest::Kind::looks);
  bool heard = true;
  const ScenePage page{path_.filename().string(), options_.tolerance};
  MotionCheckOptions options = options_;
  options.found = [&](const MotionReport& report) {
    if (report.stage != MotionReport::Stage::complete) heard = heard && tell(found_json(scene, without_contours(report), page));
  };
  const Progress progress{.stage = {}, .cancelled = [&] { return !heard || turn.superseded(); }};
  progress.check();
  Json found = Json::parse(found_json(scene, checker_.check(scene, options, progress), page));
  found["misplaced"] = clashes(scene, progress);
  tell(found.dump(-1, ' ', false, Json::error_handler_t::replace));
}

const Json& SceneSession::clashes(const Scene& scene, const Progress& progress) {
  if (clashes_ && same_states(scene, clashing_)) return *clashes_;
  clashes_.reset();
  clashing_ = scene;
  clashing_.transitions.clear();
  clashes_ = json_of(misplaced(clashing_, progress), clashing_);
  return *clashes_;
}

std::string SceneSession::balance(const std::string& edit) {
  const Scene scene = edited(object_of(edit));
  const Latest::Turn turn(judging_, Latest::Kind::looks);
  const Progress progress{.stage = {}, .cancelled = [&] { return turn.superseded(); }};
  progress.check();
  BalanceReport report{path_.filename().string(), mechanism_of(scene), {}, {}, {}};
  // What is in one place twice would count twice.
  require_scene({scene, misplaced(scene, progress), {}}, report.scene);
  report.verdict = verify(report.mechanism, std::vector<const Mesh*>(scene.parts.size(), nullptr), {}, progress);
  return balance_json(scene, report);
}

std::string SceneSession::file(const std::string& edit, const std::filesystem::path& path) const {
  return scene_text(edited(object_of(edit)), path);
}

std::string SceneSession::file_with_parts(const std::filesystem::path& path) const {
  Scene scene = read_scene(path, {}).scene;
  const std::filesystem::path put = path_.parent_path() / "parts" / path.filename();  // a folder of any name
  for (ScenePart& part : scene.parts)
    if (part.file.parent_path() == path.parent_path()) part.file = put.parent_path() / part.file.filename();
  return scene_text(scene, put);
}

}  // namespace rayrep::tool
