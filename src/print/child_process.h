#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "rayrep/base/progress.h"

namespace rayrep::detail {

/// A program to run without a shell.
struct Command {
  std::string program;  ///< looked for in PATH unless it names a folder
  std::vector<std::string> arguments;
  std::filesystem::path folder;  ///< it runs in; "output" in it takes what it prints
  double time_limit_s = 0;
};

/// How it ended.
struct Ended {
  enum class How { exited, killed_by_signal, took_too_long, not_found } how = How::exited;
  int code = 0;        ///< exit code or signal
  std::string output;  ///< the last lines of what it printed
};

/// Runs a program to its end, in a process group of its own, which is killed as a whole when it takes too long or `progress` says
/// so.
/// @throws Error{interrupted}; Error{internal} when no process can be made
Ended run_program(const Command& command, const Progress& progress);

}  // namespace rayrep::detail
