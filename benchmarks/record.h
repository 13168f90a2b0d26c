#pragma once

#include <filesystem>
#include <limits>
#include <map>
#include <string>
#include <vector>

#include "rayrep/base/error.h"
#include "statistics.h"

namespace rayrep::bench {

constexpr double kUnknown = std::numeric_limits<double>::quiet_NaN();

/// One measurement: what was solved, how long it took and how good the answer is. A time without its quality does not count.
struct Record {
  std::string table;  ///< one of table_names()
  std::string mesh;   ///< file name
  std::string goal;   ///< "float", "spin", "yo-yo", "stand"
  std::string solver;
  int resolution = 0;  ///< rays along the longest side
  std::string status;  ///< "converged", "capped" (stopped by the time cap), "skipped" (not tried, see note), or the solver's
  long long intervals = 0;
  long long variables = 0;
  int iterations = 0;
  Spread seconds;
  double objective = kUnknown;
  double gap = kUnknown;       ///< relative to the exact optimum on the same rays; of it: to its proven bound, if there is one
  double residual = kUnknown;  ///< largest constraint of the goal, as the solver sees the body
  double residual_meshed = kUnknown;  ///< the same of the mesh made from this answer, without as-built passes
  double peak_memory_mb = kUnknown;
  std::map<std::string, double> more;
  std::string note;

  bool converged() const { return status == "converged"; }
  double extra(const std::string& name) const;  ///< from `more`; kUnknown without it
};

/// That it was refused, and why in one sentence.
void refused(const Error& error, Record& record);

/// Records and the machine they come from.
struct Measurements {
  std::string commit;
  std::string version;
  std::string compiler;
  std::string build;  ///< "Release" or "with assertions"
  std::string processor;
  int threads = 0;
  double load_average = 0;  ///< of the minute before: other work on the machine
  bool quick = false;
  double cap_s = 0;
  std::vector<Record> records;
};

/// Where this programme runs; no records.
Measurements describe_machine(const std::string& commit);

std::string to_json(const Measurements& run);
/// @throws std::exception with the file's name
Measurements read_run(const std::filesystem::path& path);

/// One line for each record of `after` that is slower than in `before` (see slower()), no longer converges, or whose objective is
/// more than 0.5 % higher. Records are matched by table, mesh, goal, solver and resolution.
/// @param matched  how many were found in both
std::vector<std::string> regressions(const Measurements& before, const Measurements& after, int* matched = nullptr);

}  // namespace rayrep::bench
