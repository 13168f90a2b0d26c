#include "spec_file.h"

#include <algorithm>
#include <fstream>
#include <set>
#include <sstream>

#include "rayrep/base/error.h"

namespace rayrep::tool {
namespace {

using nlohmann::json;

[[noreturn]] void usage_error(const std::string& message) { throw Error(ErrorCode::usage, message); }

std::string text_in(const std::filesystem::path& path) {
  constexpr std::size_t most = 1 << 20;
  std::ifstream in(path, std::ios::binary);
  std::error_code ignored;
  if (!in.is_open() || std::filesystem::is_directory(path, ignored))
    throw Error(ErrorCode::input, "Cannot read '" + path.string() + "'.");
  std::string text(most + 1, '\0');
  in.read(text.data(), static_cast<std::streamsize>(text.size()));
  if (in.bad()) throw Error(ErrorCode::input, "Cannot read '" + path.string() + "'.");
  text.resize(static_cast<std::size_t>(in.gcount()));
  if (text.size() > most) throw Error(ErrorCode::input, "'" + path.string() + "' is too large for a file of settings.");
  return text;
}

/// What the parser says, without its own name: "line 3, column 5: ...".
std::string complaint(const std::string& what) {
  const std::size_t at = what.find("line ");
  return at == std::string::npos ? what : what.substr(at);
}

json object_in(const std::string& text, const std::string& name) {
  json object;
  try {
    object = json::parse(text);
  } catch (const json::exception& error) {
    usage_error(name + ", " + complaint(error.what()) + ".");
  }
  if (!object.is_object())
    usage_error(name + " is no object of settings, like { \"mesh\": \"bird.stl\", \"stand\": [\"z\", \"x\"] }.");
  return object;
}

/// The lines of the names of an object, in the order of the text. @param text  a valid one
std::vector<std::pair<std::string, int>> lines_of_names(const std::string& text) {
  std::vector<std::pair<std::string, int>> names;
  int line = 1;
  int depth = 0;
  bool name_follows = false;
  for (std::size_t n = 0; n < text.size(); ++n) {
    const char c = text[n];
    if (c == '\n') ++line;
    if (c == '{' || c == '[') name_follows = ++depth == 1;
    if (c == '}' || c == ']') --depth;
    if (c == ',') name_follows = depth == 1;
    if (c != '"') continue;
    const std::size_t begin = n;
    for (++n; text[n] != '"'; ++n)
      if (text[n] == '\\') ++n;
    if (name_follows) names.emplace_back(json::parse(text.substr(begin, n + 1 - begin)).get<std::string>(), line);
    name_follows = false;
  }
  return names;
}

std::optional<std::string> list_text(const json& value);

/// A number, text, or list of them as the command line has it; none for anything else.
std::optional<std::string> text_of(const json& value) {
  if (value.is_string()) return value.get<std::string>();
  if (value.is_number()) return value.dump();
  if (value.is_null()) return "-";
  return list_text(value);
}

/// "1,2,-" of [1, 2, null], "mass=14,ixx=3" of { "mass": 14, "ixx": 3 }.
std::optional<std::string> list_text(const json& value) {
  if (!value.is_structured() || value.empty()) return std::nullopt;
  std::string text;
  for (const auto& [key, part] : value.items()) {
    const std::optional<std::string> one = part.is_structured() ? std::nullopt : text_of(part);
    if (!one) return std::nullopt;
    text += (text.empty() ? "" : ",") + (value.is_object() ? key + "=" : std::string()) + *one;
  }
  return text;
}

/// What names a file that is read.
bool names_a_file(const std::string& name) {
  static const std::set<std::string> all = {"mesh", "original", "profile", "of", "as-sliced", "fixed", "keep-solid"};
  return all.contains(name);
}

/// "FILE" or "FILE=G_CM3" as it is from a folder.
std::string from_folder(const std::string& text, const std::filesystem::path& folder) {
  std::error_code error;
  const std::filesystem::path relative = std::filesystem::relative(text, folder, error);
  return error || relative.empty() ? std::filesystem::absolute(text).string() : relative.string();
}

}  // namespace

std::optional<std::vector<std::string>> setting_texts(const json& value, bool repeated) {
  const bool several =
      repeated && value.is_array() && !std::all_of(value.begin(), value.end(), [](const json& v) { return v.is_number(); });
  std::vector<std::string> texts;
  for (const json& one : several ? value : json::array({value})) {
    const std::optional<std::string> text = text_of(one);
    if (!text) return std::nullopt;
    texts.push_back(*text);
  }
  return texts;
}

nlohmann::ordered_json setting_json(const std::string& text) {
  if (text.empty()) return true;
  const json number = json::parse(text, nullptr, false);
  if (number.is_number() && number.dump() == text) return number;
  return text;
}

std::string spec_file_text(const std::map<std::string, std::vector<std::string>>& said, const std::filesystem::path& path) {
  const std::filesystem::path folder = path.has_parent_path() ? path.parent_path() : std::filesystem::path(".");
  nlohmann::ordered_json object = nlohmann::ordered_json::object();
  for (const auto& [name, texts] : said) {
    nlohmann::ordered_json values = nlohmann::ordered_json::array();
    for (const std::string& text : texts) values.push_back(setting_json(names_a_file(name) ? from_folder(text, folder) : text));
    object[name] = values.size() == 1 ? values[0] : values;
  }
  return object.dump(2) + "\n";
}

std::string SpecFile::place(const std::string& name) const {
  return path.string() + ", line " + std::to_string(entries.at(name).line) + ": ";
}

SpecFile read_spec_file(const std::filesystem::path& path, const Settings& known) {
  const std::string text = text_in(path);
  const json object = object_in(text, path.string());
  std::vector<std::string> names = {"mesh"};
  for (const Setting& s : known) names.push_back(s.name);
  SpecFile file{path, {}};
  for (const auto& [name, line] : lines_of_names(text)) {
    SpecFile::Entry entry;
    entry.line = line;
    if (!file.entries.emplace(name, entry).second) usage_error(file.place(name) + name + " is there twice.");
    const auto setting = std::find_if(known.begin(), known.end(), [&name = name](const Setting& s) { return s.name == name; });
    if (name != "mesh" && setting == known.end()) {
      const std::string meant = nearest_name(name, names);
      usage_error(file.place(name) + "there is no setting '" + name + "' of this command." +
                  (meant.empty() ? "" : " Did you mean " + meant + "?"));
    }
    const json& value = object.at(name);
    std::vector<std::string>& texts = file.entries.at(name).texts;
    if (value.is_null() || value == false) continue;
    if (name != "mesh" && setting->value.empty()) {
      if (value != true) usage_error(file.place(name) + name + " is a switch, true or false; it is " + value.dump() + ".");
      texts = {""};
      continue;
    }
    if (value == true && name != "mesh" && !setting->alone.empty()) {
      texts = {setting->alone};
      continue;
    }
    const auto found = setting_texts(value, name != "mesh" && setting->repeated);
    if (!found)
      usage_error(file.place(name) + name + " takes " + (name == "mesh" ? "FILE" : setting->value) +
                  ", as a number, a text or a list of them; it is " + value.dump() + ".");
    texts = *found;
    for (std::string& one : texts)
      if (names_a_file(name) && std::filesystem::path(one).is_relative()) one = (path.parent_path() / one).string();
  }
  std::erase_if(file.entries, [](const auto& entry) { return entry.second.texts.empty(); });
  return file;
}

}  // namespace rayrep::tool
