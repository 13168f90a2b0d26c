#include "whole_run.h"

#include <fcntl.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cstdio>
#include <fstream>
#include <sstream>
#include <stdexcept>

#include "problem.h"

namespace rayrep::bench {
namespace {

using Json = nlohmann::json;
namespace fs = std::filesystem;

double number(const Json& json, const char* name) {
  const auto found = json.find(name);
  return found != json.end() && found->is_number() ? found->get<double>() : kUnknown;
}

std::string first_sentence(const fs::path& file) {
  std::ifstream stream(file);
  std::ostringstream text;
  text << stream.rdbuf();
  std::string all = text.str();
  if (all.rfind("rayrep: ", 0) == 0) all.erase(0, 8);
  for (char& c : all)
    if (c == '\n') c = ' ';
  return all.substr(0, all.find(". "));
}

}  // namespace

WholeRun whole_run(const fs::path& tool, const std::vector<std::string>& arguments) {
  const std::string base = (fs::temp_directory_path() / ("rayrep_bench_" + std::to_string(getpid()))).string();
  const std::string mesh = base + ".stl";
  const std::string report = base + ".json";
  const std::string said = base + ".txt";
  std::vector<std::string> all = {tool.string()};
  all.insert(all.end(), arguments.begin(), arguments.end());
  all.insert(all.end(), {"-o", mesh, "--report", report, "--quiet"});
  std::vector<char*> argv;
  for (std::string& a : all) argv.push_back(a.data());
  argv.push_back(nullptr);

  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  posix_spawn_file_actions_addopen(&actions, STDERR_FILENO, said.c_str(), O_CREAT | O_TRUNC | O_WRONLY, 0600);
  pid_t child = 0;
  const int failed = posix_spawn(&child, tool.c_str(), &actions, nullptr, argv.data(), environ);
  posix_spawn_file_actions_destroy(&actions);
  if (failed) throw std::runtime_error("Cannot run '" + tool.string() + "'.");
  int status = 0;
  if (waitpid(child, &status, 0) != child) throw std::runtime_error("Lost '" + tool.string() + "'.");

  WholeRun run;
  run.exit_code = WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
  if (run.exit_code != 0) run.error = first_sentence(said);
  if (std::ifstream file(report); file) run.report = Json::parse(file);
  for (const std::string& file : {mesh, report, said}) {
    std::error_code ignored;
    fs::remove(file, ignored);
  }
  return run;
}

Record measure_whole(const fs::path& tool, const std::vector<std::string>& arguments, int repeats, WholeRun* last) {
  Record record;
  record.solver = "whole run";
  std::vector<double> seconds;
  WholeRun run;
  do {
    const double begin = now_s();
    run = whole_run(tool, arguments);
    seconds.push_back(now_s() - begin);
  } while (run.exit_code == 0 && static_cast<int>(seconds.size()) < repeats && seconds.front() < 5);
  record.seconds = spread(seconds);
  record.status = run.exit_code == 0 ? "converged" : run.report.is_null() ? "refused" : "not verified";
  record.note = run.error;
  if (!run.report.is_null()) {
    record.peak_memory_mb = number(run.report, "peak_memory_mb");
    for (const auto& [stage, value] : run.report.at("timings_s").items()) record.more["stage " + stage] = value;
    for (const Json& c : run.report.at("criteria")) record.more[c.at("name")] = number(c, "value");
    const Json& solver = run.report.at("solver");
    record.variables = solver.at("variables");
    record.iterations = solver.at("iterations");
    record.objective = number(solver, "objective");
    record.gap = number(solver, "duality_gap");
    record.more["passes"] = number(solver, "passes");
  }
  if (last) *last = std::move(run);
  return record;
}

}  // namespace rayrep::bench
