#pragma once

#include <filesystem>
#include <vector>

// SIGINT, SIGTERM and SIGHUP: the computation is asked to stop, and where it does not within a second the process is ended, with
// nothing left behind.

namespace rayrep::tool {

void handle_signals();

/// Whether a signal has asked the computation to stop.
bool is_interrupted();

/// 128 and the signal's number, as a shell has it: 130 for SIGINT, 143 for SIGTERM, 129 for SIGHUP.
int interrupted_exit_code();

/// Beside which outputs there may be unfinished files when the process is ended.
void clean_up_beside(const std::vector<std::filesystem::path>& outputs);

/// What is there for the time of the process only.
void clean_up_folder(const std::filesystem::path& folder);

/// What is known already when the process is ended from now on: its exit code, and that it is told.
void interrupted_with(int exit_code);

/// While there is one the process is not ended: a result is put in place.
class Uninterrupted {
public:
  /// @param last  nor afterwards: what is left to be done is to tell of it
  explicit Uninterrupted(bool last);
  ~Uninterrupted();
  Uninterrupted(const Uninterrupted&) = delete;
  Uninterrupted& operator=(const Uninterrupted&) = delete;

private:
  bool last_;
};

}  // namespace rayrep::tool
