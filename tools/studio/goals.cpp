#include "goals.h"

#include <algorithm>
#include <cctype>
#include <cmath>
#include <map>
#include <set>

#include "rayrep/base/error.h"
#include "spec_file.h"

namespace rayrep::tool {
namespace {

using Json = nlohmann::ordered_json;

[[noreturn]] void usage_error(const std::string& message) { throw Error(ErrorCode::usage, message); }

const Syntax& syntax_of_goal(const std::string& goal) {
  std::string known;
  for (const Syntax& syntax : commands()) {
    if (syntax.command != Command::hollow) continue;
    if (syntax.word == goal) return syntax;
    known += (known.empty() ? "" : ", ") + syntax.word;
  }
  usage_error("There is no goal '" + goal + "'. Known: " + known + ".");
}

/// Neither a program to run nor a file of this computer to read is for a page to name, and where files go is for the browser to
/// say.
std::vector<Group> groups_of_studio(const Syntax& syntax, Options& options) {
  static const std::set<std::string> kNotHere = {"memory", "each", "fixed", "keep-solid", "deform-fixed"};
  std::vector<Group> groups = groups_of(syntax, options);
  std::erase_if(groups, [](const Group& group) { return group.heading == "The slicer" || group.heading == "Files"; });
  for (Group& group : groups) std::erase_if(group.settings, [](const Setting& s) { return kNotHere.contains(s.name); });
  return groups;
}

/// The ends of its range, where there are such.
void add_range(const Range& range, Json& row) {
  row["lo"] = std::isfinite(range.lo) ? Json(range.lo) : Json(nullptr);
  row["hi"] = std::isfinite(range.hi) ? Json(range.hi) : Json(nullptr);
}

Json row_json(const Setting& setting, const std::string& group) {
  const auto* text = std::get_if<TextPlace>(&setting.place);
  const bool is_switch = setting.value.empty();
  const std::vector<std::string> choices = text ? text->choices : std::vector<std::string>{};
  Json row = {{"name", setting.name}, {"value", setting.value}, {"words", setting.words},      {"details", setting.details},
              {"group", group},       {"rare", setting.rare},   {"repeated", setting.repeated}};
  row["default"] = is_switch ? "" : shown(setting);
  row["kind"] = is_switch ? "flag" : !text ? "number" : choices.empty() ? "text" : "choice";
  if (!choices.empty()) row["choices"] = choices;
  add_range(setting.range, row);
  if (!setting.also.empty()) row["also"] = setting.also;
  return row;
}

const Setting* named(const std::vector<Group>& groups, const std::string& name) {
  for (const Group& group : groups)
    for (const Setting& s : group.settings)
      if (s.name == name) return &s;
  return nullptr;
}

void take_setting(const std::string& name, const Json& value, const std::vector<Group>& groups, Wanted& wanted) {
  const Setting* setting = named(groups, name);
  if (!setting) usage_error("The studio has no setting '" + name + "' of " + wanted.goal + ".");
  if (value.is_null() || value == false || (value == "" && !setting->value.empty())) return;
  if (setting->value.empty()) {
    if (value != true && value != "") usage_error("--" + name + " is a switch, true or false.");
    wanted.settings.emplace_back(name, "");
    return;
  }
  if (value == true && !setting->alone.empty()) return void(wanted.settings.emplace_back(name, setting->alone));
  const auto texts = setting_texts(value, setting->repeated);
  if (!texts) usage_error("--" + name + " takes " + setting->value + ", as a number, a text or a list of them.");
  for (const std::string& text : *texts) wanted.settings.emplace_back(name, text);
}

}  // namespace

Wanted wanted_from(const std::string& json) {
  const Json object = Json::parse(json, nullptr, false);
  if (!object.is_object() || !object.contains("goal") || !object["goal"].is_string())
    usage_error("This is no object like {\"goal\": \"float\", \"settings\": {\"waterline\": 22}}.");
  Wanted wanted;
  wanted.goal = object["goal"];
  const Syntax& syntax = syntax_of_goal(wanted.goal);
  Options options = defaults_of(syntax);
  const std::vector<Group> groups = groups_of_studio(syntax, options);
  if (object.contains("sequence") && object["sequence"].is_number_unsigned()) wanted.sequence = object["sequence"];
  if (!object.contains("settings")) return wanted;
  if (!object["settings"].is_object()) usage_error("The settings are no object of names and values.");
  for (const auto& [name, value] : object["settings"].items()) take_setting(name, value, groups, wanted);
  return wanted;
}

std::vector<std::string> words_of(const Wanted& wanted, const std::string& mesh) {
  std::vector<std::string> words = {wanted.goal, mesh};
  // In one word, so that a text that begins with dashes is a value.
  for (const auto& [name, text] : wanted.settings) words.push_back("--" + name + (text.empty() ? "" : "=" + text));
  return words;
}

Options options_of(const Wanted& wanted, const std::string& mesh) {
  std::vector<const char*> arguments = {"rayrep"};
  const std::vector<std::string> words = words_of(wanted, mesh);
  for (const std::string& word : words) arguments.push_back(word.c_str());
  return parse_command_line(static_cast<int>(arguments.size()), arguments.data());
}

std::string command_line(const Wanted& wanted, const std::string& mesh) {
  std::vector<std::string> words = {"rayrep", wanted.goal, mesh};
  for (const auto& [name, text] : wanted.settings) {
    words.push_back("--" + name);
    if (!text.empty()) words.push_back(text);
  }
  return shell_line(words);
}

Json config_of(const Wanted& wanted, const std::string& mesh) {
  std::map<std::string, std::vector<std::string>> said;
  for (const auto& [name, text] : wanted.settings) said[name].push_back(text);
  Json config = {{"mesh", mesh}};  // beside it, wherever that will be
  config.update(Json::parse(spec_file_text(said, "config.json")));
  return config;
}

namespace {

/// "hollow MESH so that it floats upright" in a few words: "Floats upright".
std::string short_words(const Spec& spec) {
  std::string words = std::visit([](const auto& s) { return std::string(s.kMakes); }, spec);
  for (const std::string start : {"hollow MESH ", "so that it ", "to a ", "for "})
    if (words.starts_with(start)) words.erase(0, start.size());
  words[0] = static_cast<char>(std::toupper(static_cast<unsigned char>(words[0])));
  return words;
}

}  // namespace

Json goals_json() {
  Json goals = Json::array();
  for (const Syntax& syntax : commands()) {
    if (syntax.command != Command::hollow) continue;
    Options options = defaults_of(syntax);
    Json rows = Json::array();
    for (const Group& group : groups_of_studio(syntax, options))
      for (const Setting& s : group.settings) rows.push_back(row_json(s, group.heading));
    goals.push_back({{"name", syntax.word}, {"words", short_words(options.spec)}, {"settings", std::move(rows)}});
  }
  return goals;
}

Json values_json(const Options& options) {
  Options copy = options;
  Json values = Json::object();
  for (const Group& group : groups_of_studio(syntax_of_goal(options.goal), copy))
    for (const Setting& s : group.settings) values[s.name] = shown(s);
  return values;
}

}  // namespace rayrep::tool
