#include "jobs.h"

#include <algorithm>
#include <cctype>
#include <fstream>
#include <nlohmann/json.hpp>
#include <set>
#include <sstream>

#include "rayrep/base/error.h"
#include "rayrep/base/setting.h"
#include "spec_file.h"

namespace rayrep::tool {
namespace {

using Json = nlohmann::ordered_json;

constexpr std::size_t kLongestId = 100;

bool is_plain(unsigned char c) { return std::isalnum(c) || c == '-' || c == '_' || c == '.'; }

/// What can be part of a file's name.
std::string as_id(const std::string& text) {
  std::string id;
  for (const char c : text) id += is_plain(static_cast<unsigned char>(c)) ? c : '_';
  if (id.empty() || id[0] == '.') id.insert(0, 1, '_');
  return id.substr(0, kLongestId);
}

/// An id that is not yet among these.
std::string new_id(const std::string& wanted, std::set<std::string>& known) {
  std::string id = wanted;
  for (int n = 2; !known.insert(id).second; ++n) id = wanted + "-" + std::to_string(n);
  return id;
}

/// As in a file of settings, see setting_texts.
void add_option(Job& job, const std::string& name, const Json& value) {
  if (value.is_boolean()) {
    if (value.get<bool>()) job.options.emplace_back(name, "");
    return;
  }
  const auto texts = setting_texts(value, true);
  if (!texts || value.is_null())
    throw Error(ErrorCode::input, "the option \"" + name + "\" takes a text, a number, true, or a list of these");
  for (const std::string& text : *texts) job.options.emplace_back(name, text);
}

std::string text_member(const Json& line, const char* name) {
  if (!line.contains(name)) return {};
  if (!line[name].is_string()) throw Error(ErrorCode::input, "\"" + std::string(name) + "\" is no text");
  return line[name].get<std::string>();
}

Job parse_job(const std::string& text) {
  const Json line = Json::parse(text);
  if (!line.is_object()) throw Error(ErrorCode::input, "a job is an object, {...}");
  static const std::vector<std::string> known = {"id", "command", "mesh", "options"};
  for (const auto& [name, value] : line.items()) {
    if (std::find(known.begin(), known.end(), name) != known.end()) continue;
    const std::string meant = nearest_name(name, known);
    throw Error(ErrorCode::input, "\"" + name + "\" is no part of a job" +
                                      (meant.empty() ? "" : "; did you mean \"" + meant + "\"?") +
                                      " It has \"command\", \"mesh\", \"options\" and \"id\"");
  }
  Job job{text_member(line, "id"), text_member(line, "command"), text_member(line, "mesh"), {}};
  for (const char* name : {"command", "mesh"})
    if (text_member(line, name).empty()) throw Error(ErrorCode::input, "\"" + std::string(name) + "\" is missing");
  if (!job.id.empty() && job.id != as_id(job.id))
    throw Error(
        ErrorCode::input,
        "the id \"" + job.id + "\" names files: letters, digits, dashes, underscores and dots, not a dot first, 100 at most");
  if (!line.contains("options")) return job;
  if (!line["options"].is_object()) throw Error(ErrorCode::input, "\"options\" is an object, {\"wall\": 0.8}");
  for (const auto& [name, value] : line["options"].items()) add_option(job, name, value);
  return job;
}

std::string stem_of(const std::string& mesh) { return std::filesystem::path(mesh).stem().string(); }

[[noreturn]] void refuse_varied(const std::string& text) {
  throw Error(ErrorCode::usage,
              "--vary takes an option and its values: wall=0.8,1.2, size=60..100/5 (five, evenly), or, where "
              "values hold commas, up=0,1,1|z; it is '" +
                  text + "'.");
}

/// "LO..HI/N"
std::vector<std::string> evenly(const std::string& name, const std::string& text, std::size_t dots) {
  const std::size_t slash = text.find('/', dots);
  if (slash == std::string::npos) refuse_varied(name + "=" + text);
  const double lo = parse_number("vary", text.substr(0, dots));
  const double hi = parse_number("vary", text.substr(dots + 2, slash - dots - 2));
  const double count = parse_number("vary", text.substr(slash + 1));
  if (!(count >= 2 && count <= 10000) || count != static_cast<int>(count)) refuse_varied(name + "=" + text);
  std::vector<std::string> values;
  for (int n = 0; n < static_cast<int>(count); ++n) {
    double value = lo + (hi - lo) * n / (count - 1);
    values.push_back(shown(Setting{.name = "", .value = "", .words = "", .details = "", .place = &value}));
  }
  return values;
}

}  // namespace

std::vector<std::string> Job::words() const {
  std::vector<std::string> all{command, mesh};
  for (const auto& [name, value] : options) all.push_back("--" + name + (value.empty() ? "" : "=" + value));
  return all;
}

std::string to_line(const Job& job) {
  Json options = Json::object();
  for (const auto& [name, value] : job.options) {
    const Json one = setting_json(value);
    if (!options.contains(name))
      options[name] = one;
    else if (options[name].is_array())
      options[name].push_back(one);
    else
      options[name] = Json::array({options[name], one});
  }
  return Json{{"id", job.id}, {"command", job.command}, {"mesh", job.mesh}, {"options", options}}.dump();
}

std::vector<Job> read_jobs(const std::filesystem::path& path) {
  std::ifstream in(path, std::ios::binary);
  if (!in || std::filesystem::is_directory(path)) throw Error(ErrorCode::input, "Cannot read the jobs in '" + path.string() + "'.");
  std::vector<Job> jobs;
  std::set<std::string> ids;
  std::size_t number = 0;
  for (std::string text; std::getline(in, text);) {
    ++number;
    if (text.find_first_not_of(" \t\r") == std::string::npos) continue;
    const std::string place = path.string() + ", line " + std::to_string(number) + ": ";
    try {
      Job job = parse_job(text);
      if (job.id.empty())
        job.id = new_id(as_id(stem_of(job.mesh) + "-" + std::to_string(number)), ids);
      else if (!ids.insert(job.id).second)
        throw Error(ErrorCode::input, "there is a job \"" + job.id + "\" before: its files would be the same");
      jobs.push_back(std::move(job));
    } catch (const nlohmann::json::exception& error) {
      throw Error(ErrorCode::input, place + "it is no JSON (" + error.what() + ").");
    } catch (const Error& error) {
      throw Error(ErrorCode::input, place + error.what() + ".");
    }
  }
  if (jobs.empty()) throw Error(ErrorCode::input, "There is no job in '" + path.string() + "'.");
  return jobs;
}

Varied parse_varied(const std::string& text) {
  const std::size_t equals = text.find('=');
  if (equals == 0 || equals == std::string::npos || equals + 1 == text.size()) refuse_varied(text);
  Varied varied{text.substr(0, equals), {}};
  const std::string values = text.substr(equals + 1);
  const std::size_t dots = values.find("..");
  if (dots != std::string::npos) {
    varied.values = evenly(varied.name, values, dots);
    return varied;
  }
  const char separator = values.find('|') == std::string::npos ? ',' : '|';
  std::istringstream in(values);
  for (std::string value; std::getline(in, value, separator);) {
    if (value.empty()) refuse_varied(text);
    varied.values.push_back(value);
  }
  return varied;
}

std::vector<Job> sweep(const Job& first, const std::vector<std::string>& meshes, const std::vector<Varied>& varied) {
  std::vector<Job> jobs;
  for (const std::string& mesh : meshes) {
    jobs.push_back(first);
    jobs.back().mesh = mesh;
    jobs.back().id = stem_of(mesh);
  }
  for (const Varied& one : varied) {
    std::vector<Job> more;
    for (const Job& job : jobs)
      for (const std::string& value : one.values) {
        more.push_back(job);
        more.back().options.emplace_back(one.name, value);
        more.back().id += "-" + one.name + value;
      }
    jobs = std::move(more);
  }
  std::set<std::string> ids;
  for (Job& job : jobs) job.id = new_id(as_id(job.id), ids);
  return jobs;
}

}  // namespace rayrep::tool
