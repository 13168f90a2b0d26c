#pragma once

#include <string>
#include <utility>
#include <vector>

#include "rayrep/io/mesh_io.h"
#include "rayrep/judge/verify.h"
#include "rayrep/make/hollow.h"
#include "rayrep/mesh/mesh_check.h"

namespace rayrep {

/// What a report says of a mesh that was read.
struct InputSummary {
  std::string path;
  std::string format;
  double mm_per_unit = 1;  ///< of the file
  double scale = 1;        ///< applied after that (--size)
  Eigen::Vector3d size_mm = Eigen::Vector3d::Zero();
  std::size_t vertices = 0;   ///< after merging
  std::size_t triangles = 0;  ///< after dropping degenerate ones
  MeshReport check;
  std::vector<std::string> notes;  ///< of the reader
};

/// What every run of a command tells, for `--report` and the terminal.
struct RunReport {
  std::string command;  ///< "float", "spin", "stand", "target" or "verify"
  InputSummary input;
  std::string output;                                        ///< path; empty when nothing was written
  std::vector<std::pair<std::string, std::string>> options;  ///< as they were in force, by name
  std::size_t delivered_triangles = 0;
  bool hollowed = false;                                  ///< `result` of the goal's report is meaningful; false for a verify run
  std::vector<std::pair<std::string, double>> timings_s;  ///< stage and seconds, in order of first occurrence, then total
  double peak_memory_mb = 0;
};

struct FloatReport : RunReport {
  FloatGoalSpec goal;
  FloatLimits limits;
  FloatState before;   ///< the solid; of a verify run: the same as after
  FloatVerdict after;  ///< judged from the file re-read from disk
  FloatResult result;
};

struct SpinReport : RunReport {
  SpinGoalSpec goal;
  SpinLimits limits;
  SpinState before;   ///< the solid; of a verify run: the same as after
  SpinVerdict after;  ///< judged from the file re-read from disk
  SpinResult result;
};

struct StandReport : RunReport {
  StandGoalSpec goal;
  StandLimits limits;
  StandState before;   ///< the solid; of a verify run: the same as after
  StandVerdict after;  ///< judged from the file re-read from disk
  StandResult result;
};

struct TargetReport : RunReport {
  TargetGoalSpec goal;
  TargetLimits limits;
  TargetState before;   ///< the solid; of a verify run: the same as after
  TargetVerdict after;  ///< judged from the file re-read from disk
  TargetResult result;
};

/// JSON text, schema version 1: numbers with all their digits, lengths in mm, masses in g, angles in rad; infinite and undefined
/// numbers are null.
std::string to_json(const FloatReport& report);
std::string to_json(const SpinReport& report);
std::string to_json(const StandReport& report);
std::string to_json(const TargetReport& report);

/// JSON text of `rayrep inspect`. `mass` is null for a mesh that is not usable.
std::string to_json(const InputSummary& input, double density_g_cm3, double area_mm2, const MassProperties* mass);

/// The version of the library, e.g. "0.1.0".
std::string version();

}  // namespace rayrep
