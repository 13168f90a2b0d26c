#include "record.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <fstream>
#include <nlohmann/json.hpp>
#include <stdexcept>
#include <thread>

namespace rayrep::bench {
namespace {

using Json = nlohmann::ordered_json;

Json number(double value) { return std::isfinite(value) ? Json(value) : Json(nullptr); }
double number(const Json& json) { return json.is_number() ? json.get<double>() : kUnknown; }

Json record_json(const Record& r) {
  Json json = {{"table", r.table},
               {"mesh", r.mesh},
               {"goal", r.goal},
               {"solver", r.solver},
               {"resolution", r.resolution},
               {"status", r.status},
               {"intervals", r.intervals},
               {"variables", r.variables},
               {"iterations", r.iterations},
               {"seconds",
                {{"median", number(r.seconds.median)},
                 {"smallest", number(r.seconds.smallest)},
                 {"largest", number(r.seconds.largest)},
                 {"repeats", r.seconds.repeats}}},
               {"objective", number(r.objective)},
               {"gap", number(r.gap)},
               {"residual", number(r.residual)},
               {"residual_meshed", number(r.residual_meshed)},
               {"peak_memory_mb", number(r.peak_memory_mb)}};
  Json more = Json::object();
  for (const auto& [name, value] : r.more) more[name] = number(value);
  json["more"] = more;
  json["note"] = r.note;
  return json;
}

Record record_of(const Json& json) {
  Record r;
  r.table = json.at("table");
  r.mesh = json.at("mesh");
  r.goal = json.at("goal");
  r.solver = json.at("solver");
  r.resolution = json.at("resolution");
  r.status = json.at("status");
  r.intervals = json.at("intervals");
  r.variables = json.at("variables");
  r.iterations = json.at("iterations");
  const Json& seconds = json.at("seconds");
  r.seconds = {number(seconds.at("median")), number(seconds.at("smallest")), number(seconds.at("largest")), seconds.at("repeats")};
  r.objective = number(json.at("objective"));
  r.gap = number(json.at("gap"));
  r.residual = number(json.at("residual"));
  r.residual_meshed = number(json.at("residual_meshed"));
  r.peak_memory_mb = number(json.at("peak_memory_mb"));
  for (const auto& [name, value] : json.at("more").items()) r.more[name] = number(value);
  r.note = json.at("note");
  return r;
}

std::string processor() {
  std::ifstream info("/proc/cpuinfo");
  for (std::string line; std::getline(info, line);)
    if (line.rfind("model name", 0) == 0) return line.substr(line.find(':') + 2);
  return "unknown";
}

std::string key(const Record& r) {
  return r.table + ", " + r.mesh + ", " + r.goal + ", " + r.solver + ", N = " + std::to_string(r.resolution);
}

}  // namespace

double Record::extra(const std::string& name) const {
  const auto found = more.find(name);
  return found == more.end() ? kUnknown : found->second;
}

void refused(const Error& error, Record& record) {
  record.status = "refused";
  record.note = error.what();
  record.note.erase(std::min(record.note.find(". "), record.note.size()));
}

Measurements describe_machine(const std::string& commit) {
  Measurements run;
  run.commit = commit;
  run.version = RAYREP_VERSION;
  run.compiler = "g++ " __VERSION__;
#ifdef NDEBUG
  run.build = "Release";
#else
  run.build = "with assertions";
#endif
  run.processor = processor();
  run.threads = static_cast<int>(std::thread::hardware_concurrency());
  double load[1] = {0};
  if (getloadavg(load, 1) == 1) run.load_average = load[0];
  return run;
}

std::string to_json(const Measurements& run) {
  Json json = {{"schema", 1},        {"commit", run.commit},       {"version", run.version}, {"compiler", run.compiler},
               {"build", run.build}, {"processor", run.processor}, {"threads", run.threads}, {"load_average", run.load_average},
               {"quick", run.quick}, {"cap_s", run.cap_s}};
  Json records = Json::array();
  for (const Record& record : run.records) records.push_back(record_json(record));
  json["records"] = records;
  return json.dump(1) + "\n";
}

Measurements read_run(const std::filesystem::path& path) {
  std::ifstream file(path);
  if (!file) throw std::runtime_error("Cannot read '" + path.string() + "'.");
  try {
    const Json json = Json::parse(file);
    if (json.at("schema") != 1) throw std::runtime_error("schema 1 is expected");
    Measurements run;
    run.commit = json.at("commit");
    run.version = json.at("version");
    run.compiler = json.at("compiler");
    run.build = json.at("build");
    run.processor = json.at("processor");
    run.threads = json.at("threads");
    run.load_average = json.at("load_average");
    run.quick = json.at("quick");
    run.cap_s = json.at("cap_s");
    for (const Json& record : json.at("records")) run.records.push_back(record_of(record));
    return run;
  } catch (const std::exception& error) {
    throw std::runtime_error("'" + path.string() + "' is not a file of rayrep_bench tables: " + error.what());
  }
}

std::vector<std::string> regressions(const Measurements& before, const Measurements& after, int* matched) {
  std::map<std::string, const Record*> known;
  for (const Record& r : before.records) known[key(r)] = &r;
  std::vector<std::string> lines;
  int both = 0;
  for (const Record& r : after.records) {
    const auto found = known.find(key(r));
    if (found == known.end()) continue;
    const Record& old = *found->second;
    ++both;
    if (old.converged() && !r.converged()) {
      lines.push_back(key(r) + ": was converged, now " + r.status);
      continue;
    }
    if (!old.converged()) continue;
    if (slower(old.seconds.median, r.seconds.median))
      lines.push_back(key(r) + ": " + significant(old.seconds.median, 3) + " s -> " + significant(r.seconds.median, 3) + " s (" +
                      significant(100 * (r.seconds.median / old.seconds.median - 1), 2) + " % slower)");
    if (r.objective > old.objective + 0.005 * std::abs(old.objective))
      lines.push_back(key(r) + ": objective " + significant(old.objective, 6) + " -> " + significant(r.objective, 6));
  }
  if (matched) *matched = both;
  return lines;
}

}  // namespace rayrep::bench
