#include <algorithm>
#include <cmath>
#include <fstream>
#include <map>
#include <nlohmann/json.hpp>
#include <numbers>
#include <set>

#include "base/text.h"
#include "rayrep/base/error.h"
#include "rayrep/base/setting.h"
#include "rayrep/io/mesh_io.h"
#include "rayrep/mesh/mesh_check.h"
#include "rayrep/motion/scene.h"
#include "rayrep/physics/materials.h"

namespace rayrep {
namespace {

using Eigen::Quaterniond;
using Eigen::Vector3d;
using Json = nlohmann::ordered_json;
using Kind = SceneProblem::Kind;

constexpr double kDegree = std::numbers::pi / 180;

std::string text_in(const std::filesystem::path& path) {
  constexpr std::size_t most = 64 << 20;
  std::ifstream in(path, std::ios::binary);
  std::error_code ignored;
  if (!in.is_open() || std::filesystem::is_directory(path, ignored))
    throw Error(ErrorCode::input, "Cannot read the scene '" + path.string() + "'.");
  std::string text(std::istreambuf_iterator<char>(in), {});
  if (in.bad()) throw Error(ErrorCode::input, "Cannot read the scene '" + path.string() + "'.");
  if (text.size() > most) throw Error(ErrorCode::input, "'" + path.string() + "' is too large for a scene.");
  return text;
}

Json object_in(const std::string& text, const std::string& name) {
  try {
    Json json = Json::parse(text);
    if (json.is_object()) return json;
  } catch (const Json::exception& error) {
    const std::string what = error.what();
    const std::size_t at = what.find("line ");
    throw Error(ErrorCode::input, name + " is no JSON: " + (at == what.npos ? what : what.substr(at)) + ".");
  }
  throw Error(ErrorCode::input,
              name + " is no scene: it has to be an object with parts, states and transitions, see docs/scene.md.");
}

/// An attitude as it is written: about an axis by an angle that may go round more than once, or any other.
struct Turn {
  Quaterniond rotation = Quaterniond::Identity();
  std::optional<Vector3d> axis;  ///< of length 1
  double deg = 0;
};

Turn turn_by(const Vector3d& axis, double deg) { return {Quaterniond(Eigen::AngleAxisd(deg * kDegree, axis)), axis, deg}; }

/// Keys from one attitude to another, the first left out: by their angles where both are about one axis, else the shorter way.
void add_turn(std::vector<RotationKey>& keys, const Turn& before, double time, const Turn& turn) {
  const bool one_axis = turn.axis && (before.deg == 0 || (before.axis && before.axis->isApprox(*turn.axis, 1e-9)));
  const bool known = one_axis && (before.axis || before.rotation.isApprox(Quaterniond::Identity()));
  const double by = known ? turn.deg - before.deg : 0;
  const int pieces = std::max(1, static_cast<int>(std::ceil(std::abs(by) / 120)));
  const double begin = keys.empty() ? time : keys.back().time;
  for (int n = 1; n < pieces; ++n) {
    const double share = static_cast<double>(n) / pieces;
    keys.push_back({begin + share * (time - begin), turn_by(*turn.axis, before.deg + share * by).rotation});
  }
  keys.push_back({time, turn.rotation});
}

/// Reads what a scene's file says, and notes what is wrong with it.
class SceneReader {
public:
  SceneReader(std::filesystem::path path, const Progress& progress) : path_(std::move(path)), progress_(progress) {}

  SceneFile read() {
    const Json json = object_in(text_in(path_), path_.string());
    known_names(json, "the scene",
                {"parts", "states", "transitions", "may_touch", "clearance", "room", "fluid", "least_tip", "about"});
    for (const auto& [name, value] : object(json, "parts", "the scene").items()) read_part(name, value);
    if (scene().parts.empty()) complain({}, "parts", "there are none: \"parts\" names them with their meshes");
    for (const auto& [name, value] : object(json, "states", "the scene").items()) read_state(name, value);
    for (const Json& value : list(json, "transitions", "the scene")) read_transition(value);
    for (const Json& value : list(json, "may_touch", "the scene")) read_pair(value);
    if (json.contains("clearance")) scene().clearance_mm = number(json["clearance"], "clearance", 0);
    if (json.contains("room")) read_room(json["room"]);
    if (json.contains("fluid")) read_fluid(json["fluid"]);
    if (json.contains("least_tip")) scene().least_tip_deg = number(json["least_tip"], "least_tip", 0);
    return std::move(file_);
  }

private:
  Scene& scene() { return file_.scene; }

  void complain(SceneProblem problem, const std::string& where, const std::string& what) {
    problem.where = where;
    problem.message = where + ": " + what + (what.ends_with('?') ? "" : ".");
    file_.problems.push_back(std::move(problem));
  }

  void known_names(const Json& json, const std::string& where, const std::vector<std::string>& known) {
    if (!json.is_object()) return;
    for (const auto& [name, value] : json.items()) {
      if (std::find(known.begin(), known.end(), name) != known.end()) continue;
      const std::string meant = nearest_name(name, known);
      complain({}, where, "'" + name + "' means nothing here" + (meant.empty() ? "" : "; is it " + meant + "?"));
    }
  }

  /// That of a name, which may be missing.
  const Json& object(const Json& json, const char* name, const std::string& where) {
    static const Json kNone = Json::object();
    if (!json.is_object() || !json.contains(name)) return kNone;
    if (json[name].is_object()) return json[name];
    complain({}, where, std::string(name) + " has to be an object of names, { \"lid\": ... }");
    return kNone;
  }
  const Json& list(const Json& json, const char* name, const std::string& where) {
    static const Json kNone = Json::array();
    if (!json.is_object() || !json.contains(name)) return kNone;
    if (json[name].is_array()) return json[name];
    complain({}, where, std::string(name) + " has to be a list, [ ... ]");
    return kNone;
  }

  double number(const Json& json, const std::string& where, double least) {
    if (json.is_number() && json.get<double>() >= least) return json.get<double>();
    complain({}, where,
             "it takes a number" + (least > -1e300 ? " of at least " + shown(least) : std::string()) + ", not " +
                 json.dump(-1, ' ', false, Json::error_handler_t::replace));
    return std::max(least, 0.0);
  }
  double number(const Json& json, const std::string& where) { return number(json, where, -1e308); }

  Vector3d point(const Json& json, const std::string& where) {
    if (json.is_array() && json.size() == 3 && std::all_of(json.begin(), json.end(), [](const Json& v) { return v.is_number(); })) {
      const Vector3d p(json[0].get<double>(), json[1].get<double>(), json[2].get<double>());
      if (p.cwiseAbs().maxCoeff() <= kLargestBody_mm) return p;
      complain({.kind = Kind::leaves}, where, shown(p) + " is further away than " + shown(kLargestBody_mm) + " mm");
      return Vector3d::Zero();
    }
    complain({}, where, "it takes three numbers, [x, y, z], not " + json.dump(-1, ' ', false, Json::error_handler_t::replace));
    return Vector3d::Zero();
  }

  Vector3d direction(const Json& json, const std::string& where) {
    try {
      if (json.is_string()) return parse_direction(json.get<std::string>());
    } catch (const Error&) {
      // told below
    }
    const Vector3d d = json.is_array() ? point(json, where) : Vector3d::Zero();
    if (d.norm() > 0) return d.normalized();
    complain({}, where, "it takes a direction, \"z\" or [0, 0, 1]");
    return Vector3d::UnitZ();
  }

  Turn turn(const Json& json, const std::string& where) {
    if (json.contains("quaternion")) {
      const Json& q = json["quaternion"];
      if (q.is_array() && q.size() == 4 && std::all_of(q.begin(), q.end(), [](const Json& v) { return v.is_number(); })) {
        const Quaterniond rotation(q[0].get<double>(), q[1].get<double>(), q[2].get<double>(), q[3].get<double>());
        if (std::abs(rotation.norm() - 1) < 1e-3) return {rotation.normalized(), {}, 0};
      }
      complain({}, where, "quaternion takes [w, x, y, z] of length 1");
      return {};
    }
    if (json.contains("axis") != json.contains("deg")) complain({}, where, "axis and deg go together");
    if (!json.contains("axis") || !json.contains("deg")) return {};
    return turn_by(direction(json["axis"], where + ", axis"), number(json["deg"], where + ", deg"));
  }

  void read_part(const std::string& name, const Json& json) {
    const std::string where = "parts, " + name;
    known_names(json, where, {"mesh", "unit", "pivot", "printed", "material", "density", "wall"});
    ScenePart part;
    part.name = name;
    if (json.is_object() && json.contains("mesh") && json["mesh"].is_string()) {
      part.file = json["mesh"].get<std::string>();
      if (part.file.is_relative()) part.file = path_.parent_path() / part.file;
      read_mesh_of(part, json, where);
    } else {
      complain({.part = name}, where, "\"mesh\" has to name its file");
    }
    if (!json.is_object()) return;
    if (json.contains("pivot")) part.pivot_mm = point(json["pivot"], where + ", pivot");
    if (json.contains("printed")) {
      if (!json["printed"].is_boolean()) complain({.part = name}, where, "printed is true or false");
      part.printed = json["printed"] != false;
    }
    try {
      if (json.contains("material")) {
        const Material& of = material(json["material"].is_string() ? json["material"].get<std::string>() : json["material"].dump());
        part.print.density_g_cm3 = of.density_g_cm3;
        part.print.liquid_g_cm3 = of.liquid_g_cm3;
      }
    } catch (const Error& error) {
      complain({.part = name}, where + ", material", error.what());
    }
    if (json.contains("density")) part.print.density_g_cm3 = number(json["density"], where + ", density", 1e-3);
    if (json.contains("wall")) part.print.wall_mm = number(json["wall"], where + ", wall", 0);
    scene().parts.push_back(std::move(part));
  }

  void read_mesh_of(ScenePart& part, const Json& json, const std::string& where) {
    SceneProblem problem{.kind = Kind::not_solid, .part = part.name};
    try {
      progress_.check();
      const LengthUnit unit = json.contains("unit") && json["unit"].is_string() ? parse_length_unit(json["unit"].get<std::string>())
                                                                                : LengthUnit::millimetre;
      std::shared_ptr<const Mesh>& kept = meshes_[{part.file.lexically_normal().string(), unit}];
      if (!kept) {
        CheckedMesh checked =
            check_mesh(read_mesh(part.file, {.unit = unit}).mesh, {.self_intersections = false, .unite = false}, progress_);
        if (!checked.report.usable) {
          if (const Defect& open = checked.report.unbalanced_edges) problem.place_mm = open.first_mm;
          complain(problem, where, "'" + part.file.string() + "' is no solid. " + trimmed(checked.report.refusal));
          return;
        }
        require_size(checked.mesh, part.file.string());
        for (const std::string& note : checked.report.notes) file_.notes.push_back(part.name + ": " + note);
        kept = std::make_shared<const Mesh>(std::move(checked.mesh));
      }
      part.mesh = kept;
    } catch (const Error& error) {
      if (error.code() == ErrorCode::interrupted) throw;
      complain(problem, where, trimmed(error.what()));
    }
  }

  static std::string trimmed(std::string sentence) {
    while (!sentence.empty() && sentence.back() == '.') sentence.pop_back();
    return sentence;
  }

  std::optional<std::size_t> part_named(const std::string& name, const std::string& where) {
    std::vector<std::string> names;
    for (std::size_t n = 0; n < scene().parts.size(); ++n) {
      if (scene().parts[n].name == name) return n;
      names.push_back(scene().parts[n].name);
    }
    const std::string meant = nearest_name(name, names);
    complain({.kind = Kind::no_part, .part = name}, where,
             "there is no part '" + name + "'" + (meant.empty() ? "" : "; is it " + meant + "?"));
    return std::nullopt;
  }

  void read_state(const std::string& name, const Json& json) {
    const std::string where = "states, " + name;
    known_names(json, where, {"up", "poses", "rests", "hinges"});
    SceneState state{.name = name, .up = Vector3d::UnitZ(), .poses = std::vector<PartPose>(scene().parts.size())};
    std::vector<Turn> turns(scene().parts.size());
    if (json.is_object() && json.contains("up")) state.up = direction(json["up"], where + ", up");
    for (const auto& [part_name, pose] : object(json, "poses", where).items()) {
      const std::string here = where + ", " + part_name;
      const auto part = part_named(part_name, here);
      known_names(pose, here, {"at", "axis", "deg", "quaternion"});
      if (!part || !pose.is_object()) continue;
      if (pose.contains("at")) state.poses[*part].translation_mm = point(pose["at"], here + ", at");
      turns[*part] = turn(pose, here);
      state.poses[*part].rotation = turns[*part].rotation;
    }
    if (json.is_object() && json.contains("rests")) state.rests = rests(json["rests"], where + ", rests");
    for (const Json& hinge : list(json, "hinges", where)) read_hinge(hinge, where + ", hinges", state);
    scene().states.push_back(std::move(state));
    turns_.push_back(std::move(turns));
  }

  void read_fluid(const Json& json) {
    if (!json.is_string()) {
      scene().fluid_g_cm3 = number(json, "fluid", 1e-3);
      return;
    }
    std::string names;
    for (const Fluid& fluid : fluids()) {
      if (json == fluid.name) scene().fluid_g_cm3 = fluid.density_g_cm3;
      if (json == fluid.name) return;
      names += std::string(names.empty() ? "" : ", ") + fluid.name;
    }
    complain({}, "fluid", "it takes a density in g/cm3 or one of " + names);
  }

  /// "stands", or { "kind": "hangs", "point": [0, 0, 50] }.
  Pose rests(const Json& json, const std::string& where) {
    static const std::map<std::string, Pose::Kind> kKinds = {
        {"stands", Pose::Kind::stands}, {"hangs", Pose::Kind::hangs}, {"floats", Pose::Kind::floats}};
    Pose pose;
    known_names(json, where, {"kind", "point", "waterline"});
    const Json kind = json.is_object() && json.contains("kind") ? json["kind"] : json;
    const auto found = kKinds.find(kind.is_string() ? kind.get<std::string>() : "");
    if (found == kKinds.end())
      complain({}, where, "it is stands, floats or hangs, or { \"kind\": \"hangs\", \"point\": [x, y, z] }");
    else
      pose.kind = found->second;
    if (!json.is_object()) {
      if (pose.kind == Pose::Kind::hangs)
        complain({}, where, "what hangs needs its point: { \"kind\": \"hangs\", \"point\": [x, y, z] }");
      return pose;
    }
    if (json.contains("point")) pose.point_mm = point(json["point"], where + ", point");
    if (json.contains("waterline")) pose.waterline_mm = number(json["waterline"], where + ", waterline", 0);
    return pose;
  }

  void read_hinge(const Json& json, const std::string& where, SceneState& state) {
    known_names(json, where, {"point", "axis", "parts"});
    HingeBalance hinge;
    if (!json.is_object() || !json.contains("point") || !json.contains("axis") || !json.contains("parts")) {
      complain({}, where, "it takes { \"point\": [x, y, z], \"axis\": \"x\", \"parts\": [\"lid\"] }");
      return;
    }
    hinge.point_mm = point(json["point"], where + ", point");
    hinge.axis = direction(json["axis"], where + ", axis");
    for (const Json& name : list(json, "parts", where))
      if (const auto part = part_named(name.is_string() ? name.get<std::string>() : name.dump(), where))
        hinge.parts.push_back(*part);
    if (!hinge.parts.empty()) state.hinges.push_back(std::move(hinge));
  }

  std::optional<std::size_t> state_of(const Json& json, const char* end, const std::string& where) {
    const std::string name = json.is_object() && json.contains(end) && json[end].is_string() ? json[end].get<std::string>() : "";
    std::vector<std::string> names;
    for (std::size_t n = 0; n < scene().states.size(); ++n) {
      if (scene().states[n].name == name) return n;
      names.push_back(scene().states[n].name);
    }
    const std::string meant = nearest_name(name, names);
    complain({.kind = name.empty() ? Kind::form : Kind::no_part}, where,
             name.empty() ? "\"" + std::string(end) + "\" has to name a state"
                          : "there is no state '" + name + "'" + (meant.empty() ? "" : "; is it " + meant + "?"));
    return std::nullopt;
  }

  void read_transition(const Json& json) {
    std::string where = "transitions, number " + std::to_string(++transitions_);
    if (json.is_object() && json.contains("name") && json["name"].is_string())
      where = "transitions, " + json["name"].get<std::string>();
    known_names(json, where, {"name", "from", "to", "motions"});
    const auto from = state_of(json, "from", where), to = state_of(json, "to", where);
    if (!from || !to) return;
    Transition transition{
        .name = scene().states[*from].name + " to " + scene().states[*to].name, .from = *from, .to = *to, .motions = {}};
    if (json.contains("name") && json["name"].is_string()) transition.name = json["name"].get<std::string>();
    static const Json kNone = Json::object();
    std::vector<const Json*> said(scene().parts.size(), &kNone);
    for (const auto& [name, motion] : object(json, "motions", where).items())
      if (const auto part = part_named(name, where + ", " + name); part && motion.is_object()) said[*part] = &motion;
    for (std::size_t p = 0; p < scene().parts.size(); ++p)
      transition.motions.push_back(motion(*said[p], p, transition, where + ", " + scene().parts[p].name));
    scene().transitions.push_back(std::move(transition));
  }

  /// Times of keys, in 0 to 1 and ascending.
  double time_of(const Json& key, double after, const std::string& where, std::size_t part) {
    if (!key.is_object() || !key.contains("time")) {
      complain({.part = scene().parts[part].name}, where, "every key has a \"time\", from 0 to 1");
      return after;
    }
    const double time = number(key["time"], where + ", time");
    SceneProblem problem{.kind = Kind::leaves, .part = scene().parts[part].name};
    if (!(time >= 0 && time <= 1))
      complain(problem, where, "the time " + shown(time) + " is not in the transition, which lasts from 0 to 1");
    else if (time < after || (time == after && time > 0))
      complain(problem, where, "times have to ascend: " + shown(time) + " comes after " + shown(after));
    return std::clamp(time, after, 1.0);
  }

  Motion motion(const Json& json, std::size_t part, const Transition& transition, const std::string& where) {
    known_names(json, where, {"translation", "rotation"});
    const PartPose& from = scene().states[transition.from].poses[part];
    const PartPose& to = scene().states[transition.to].poses[part];
    Motion motion;
    const Ends ends{transition.from, transition.to, part};
    read_translation(list(json, "translation", where), ends, where, motion);
    read_rotation(list(json, "rotation", where), ends, where, motion);
    const auto must_meet = [&](const PartPose& pose, const PartPose& state, std::size_t number) {
      const double apart = (pose.translation_mm - state.translation_mm).norm();
      const double turned = pose.rotation.angularDistance(state.rotation) / kDegree;
      if (apart <= 1e-6 * (1 + state.translation_mm.norm()) && turned <= 1e-4) return;
      complain({.kind = Kind::leaves, .part = scene().parts[part].name}, where,
               "its motion does not meet the state " + scene().states[number].name + ": it is " + shown(apart) + " mm and " +
                   shown(turned) + " degrees off. Leave the key there out: the state's own pose is then taken");
    };
    must_meet(motion.at(0), from, transition.from);
    must_meet(motion.at(1), to, transition.to);
    return motion;
  }

  /// States between which a part moves.
  struct Ends {
    std::size_t from, to, part;
  };
  void read_translation(const Json& keys, const Ends& ends, const std::string& where, Motion& motion) {
    struct Handles {
      std::optional<Vector3d> in, out;
    };
    std::vector<Handles> said;
    const Vector3d& begin_mm = scene().states[ends.from].poses[ends.part].translation_mm;
    const Vector3d& end_mm = scene().states[ends.to].poses[ends.part].translation_mm;
    double time = 0;
    std::size_t number = 0;
    for (const Json& key : keys) {
      const std::string here = where + ", translation " + std::to_string(++number);
      known_names(key, here, {"time", "at", "in", "out"});
      time = time_of(key, time, here, ends.part);
      if (!key.is_object()) continue;
      if (motion.translation.empty() && time > 0) {
        motion.translation.push_back({.time = 0, .at_mm = begin_mm});
        said.emplace_back();
      }
      motion.translation.push_back({.time = time});
      said.emplace_back();
      if (key.contains("at"))
        motion.translation.back().at_mm = point(key["at"], here + ", at");
      else
        complain({.part = scene().parts[ends.part].name}, here, "\"at\" says where it is then");
      if (key.contains("in")) said.back().in = point(key["in"], here + ", in");
      if (key.contains("out")) said.back().out = point(key["out"], here + ", out");
    }
    if (motion.translation.empty()) motion.translation.push_back({.time = 0, .at_mm = begin_mm});
    if (motion.translation.back().time < 1) motion.translation.push_back({.time = 1, .at_mm = end_mm});
    said.resize(motion.translation.size());
    straighten(motion);
    for (std::size_t n = 0; n < said.size(); ++n) {
      if (said[n].in) motion.translation[n].in_mm = *said[n].in;
      if (said[n].out) motion.translation[n].out_mm = *said[n].out;
    }
  }

  void read_rotation(const Json& keys, const Ends& ends, const std::string& where, Motion& motion) {
    Turn before = turns_[ends.from][ends.part];
    double time = 0;
    std::size_t number = 0;
    for (const Json& key : keys) {
      const std::string here = where + ", rotation " + std::to_string(++number);
      known_names(key, here, {"time", "axis", "deg", "quaternion"});
      time = time_of(key, time, here, ends.part);
      if (!key.is_object()) continue;
      const Turn next = turn(key, here);
      if (motion.rotation.empty()) motion.rotation.push_back({0, time > 0 ? before.rotation : next.rotation});
      if (time > 0) add_turn(motion.rotation, before, time, next);
      before = next;
    }
    if (motion.rotation.empty()) motion.rotation.push_back({0, before.rotation});
    if (motion.rotation.back().time < 1) add_turn(motion.rotation, before, 1, turns_[ends.to][ends.part]);
  }

  void read_pair(const Json& json) {
    const std::string where = "may_touch";
    known_names(json, where, {"parts", "clearance"});
    const Json& names = list(json, "parts", where);
    if (names.size() != 2 || !names[0].is_string() || !names[1].is_string()) {
      complain({}, where, "\"parts\" names two of them, [\"lid\", \"box\"]");
      return;
    }
    const auto first = part_named(names[0].get<std::string>(), where), second = part_named(names[1].get<std::string>(), where);
    if (!first || !second) return;
    ScenePair pair{*first, *second, {}};
    if (json.contains("clearance")) pair.clearance_mm = number(json["clearance"], where + ", clearance", 0);
    scene().pairs.push_back(pair);
  }

  void read_room(const Json& json) {
    if (!json.is_array() || json.size() != 2) {
      complain({}, "room", "it takes two opposite corners, [[x, y, z], [x, y, z]]");
      return;
    }
    Eigen::AlignedBox3d room(point(json[0], "room"));
    room.extend(point(json[1], "room"));
    scene().room = room;
  }

  std::filesystem::path path_;
  const Progress& progress_;
  SceneFile file_;
  std::map<std::pair<std::string, LengthUnit>, std::shared_ptr<const Mesh>> meshes_;
  std::vector<std::vector<Turn>> turns_;  ///< of each state and part, as they are written
  std::size_t transitions_ = 0;
};

// --------------------------------------------------------------------------------------------------------------------- writing

Json json_of(const Vector3d& p) { return {p.x(), p.y(), p.z()}; }

void add_rotation(Json& json, const Quaterniond& q) { json["quaternion"] = {q.w(), q.x(), q.y(), q.z()}; }

Json json_of(const Pose& pose) {
  Json json = {{"kind", pose.kind == Pose::Kind::hangs ? "hangs" : pose.kind == Pose::Kind::floats ? "floats" : "stands"}};
  if (pose.kind == Pose::Kind::hangs) json["point"] = json_of(pose.point_mm);
  if (pose.waterline_mm) json["waterline"] = *pose.waterline_mm;
  return json;
}

Json json_of(const ScenePart& part, const std::filesystem::path& folder) {
  std::error_code error;
  const std::filesystem::path relative = std::filesystem::relative(part.file, folder, error);
  Json json = {{"mesh", (error || relative.empty() ? part.file : relative).string()}, {"pivot", json_of(part.pivot_mm)}};
  json["printed"] = part.printed;
  json["density"] = part.print.density_g_cm3;
  json["wall"] = part.print.wall_mm;
  return json;
}

Json json_of(const Motion& motion) {
  Json json = {{"translation", Json::array()}, {"rotation", Json::array()}};
  for (const TranslationKey& k : motion.translation)
    json["translation"].push_back(
        {{"time", k.time}, {"at", json_of(k.at_mm)}, {"in", json_of(k.in_mm)}, {"out", json_of(k.out_mm)}});
  for (const RotationKey& k : motion.rotation) {
    Json key = {{"time", k.time}};
    add_rotation(key, k.rotation);
    json["rotation"].push_back(key);
  }
  return json;
}

}  // namespace

SceneFile read_scene(const std::filesystem::path& path, const Progress& progress) { return SceneReader(path, progress).read(); }

Mechanism mechanism_of(const Scene& scene) {
  Mechanism mechanism;
  mechanism.fluid_g_cm3 = scene.fluid_g_cm3;
  mechanism.least_tip_deg = scene.least_tip_deg;
  for (const ScenePart& part : scene.parts) mechanism.parts.push_back({part.name, *part.mesh, part.print, part.printed});
  for (const SceneState& state : scene.states) {
    if (!state.rests) continue;
    MechanismState wanted{state.name, {}, *state.rests, state.hinges};
    wanted.rests.up = state.up;
    for (std::size_t p = 0; p < scene.parts.size(); ++p) wanted.poses.emplace_back(state.poses[p].about(scene.parts[p].pivot_mm));
    mechanism.states.push_back(std::move(wanted));
  }
  if (mechanism.states.empty())
    throw Error(
        ErrorCode::usage,
        "No state of this scene says how it shall rest: give one \"rests\": \"stands\", \"floats\" or \"hangs\" (docs/scene.md).");
  return mechanism;
}

std::string scene_text(const Scene& scene, const std::filesystem::path& path) {
  const std::filesystem::path folder = path.has_parent_path() ? path.parent_path() : std::filesystem::path(".");
  Json json = {{"parts", Json::object()}, {"states", Json::object()}, {"transitions", Json::array()}};
  for (const ScenePart& part : scene.parts) json["parts"][part.name] = json_of(part, folder);
  for (const SceneState& state : scene.states) {
    Json poses = Json::object();
    for (std::size_t p = 0; p < scene.parts.size(); ++p) {
      Json pose = {{"at", json_of(state.poses[p].translation_mm)}};
      add_rotation(pose, state.poses[p].rotation);
      poses[scene.parts[p].name] = pose;
    }
    Json& written = json["states"][state.name];
    written = {{"up", json_of(state.up)}, {"poses", poses}};
    if (state.rests) written["rests"] = json_of(*state.rests);
    for (const HingeBalance& hinge : state.hinges) {
      Json names = Json::array();
      for (const std::size_t part : hinge.parts) names.push_back(scene.parts[part].name);
      written["hinges"].push_back({{"point", json_of(hinge.point_mm)}, {"axis", json_of(hinge.axis)}, {"parts", names}});
    }
  }
  for (const Transition& transition : scene.transitions) {
    Json motions = Json::object();
    for (std::size_t p = 0; p < scene.parts.size(); ++p) motions[scene.parts[p].name] = json_of(transition.motions[p]);
    json["transitions"].push_back({{"name", transition.name},
                                   {"from", scene.states[transition.from].name},
                                   {"to", scene.states[transition.to].name},
                                   {"motions", motions}});
  }
  for (const ScenePair& pair : scene.pairs) {
    Json touch = {{"parts", {scene.parts[pair.first].name, scene.parts[pair.second].name}}};
    if (pair.clearance_mm) touch["clearance"] = *pair.clearance_mm;
    json["may_touch"].push_back(touch);
  }
  if (scene.fluid_g_cm3 != 1.0) json["fluid"] = scene.fluid_g_cm3;
  if (scene.least_tip_deg) json["least_tip"] = *scene.least_tip_deg;
  if (scene.clearance_mm > 0) json["clearance"] = scene.clearance_mm;
  if (scene.room) json["room"] = {json_of(scene.room->min()), json_of(scene.room->max())};
  return json.dump(1, ' ', false, Json::error_handler_t::replace) + "\n";
}

void require_scene(const SceneFile& file, const std::string& name) {
  if (file.problems.empty()) return;
  std::string text = name + ": " + plural(file.problems.size(), "thing is wrong", "things are wrong") + ".";
  for (const SceneProblem& problem : file.problems) text += "\n  " + problem.message;
  throw Error(ErrorCode::input, text);
}

}  // namespace rayrep
