#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "rayrep/base/progress.h"

namespace rayrep {

/// A program to run without a shell.
struct ProgramCall {
  std::string program;  ///< looked for in PATH unless it names a folder
  std::vector<std::string> arguments;
  std::filesystem::path folder;  ///< it runs in; empty: the present one
  std::filesystem::path output;  ///< takes what it prints
  std::filesystem::path errors;  ///< takes what it says on standard error; empty: `output` does
};

/// How it ended.
struct Ended {
  enum class How { exited, killed_by_signal, took_too_long, not_found } how = How::exited;
  int code = 0;               ///< exit code or signal
  std::string said;           ///< the last lines of `errors`, or of `output`
  double cpu_s = 0;           ///< user and system time of it and of those it waited for
  double peak_memory_mb = 0;  ///< largest resident set
};

/// A program that runs beside this one, in a process group of its own, which does not outlive the object.
class ChildProcess {
public:
  /// @throws Error{internal} when no process can be made
  explicit ChildProcess(ProgramCall call);
  ~ChildProcess();
  ChildProcess(const ChildProcess&) = delete;
  ChildProcess& operator=(const ChildProcess&) = delete;

  bool has_ended();
  void stop();                                   ///< if it still runs: it took too long
  const Ended& ended() const { return ended_; }  ///< once it has

  /// Waits until one of these has ended, `most_s` at most.
  static void wait_for_any(const std::vector<ChildProcess*>& children, double most_s);

private:
  void kill();
  const std::filesystem::path& said_in() const { return call_.errors.empty() ? call_.output : call_.errors; }

  ProgramCall call_;
  int process_ = -1;     ///< none: it has been reaped, or never ran
  int descriptor_ = -1;  ///< readable once it has ended
  Ended ended_;
};

/// Runs a program to its end, until it has taken too long (by the number of waits: the library has no clock), or until `progress`
/// says so.
/// @throws Error{interrupted}; Error{internal} when no process can be made
Ended run_program(const ProgramCall& call, double time_limit_s, const Progress& progress);

}  // namespace rayrep
