#pragma once

#include <atomic>
#include <filesystem>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "options.h"

namespace rayrep::tool {

/// Of an exit code, for the page: "usage", "input", "goal", "solver", "write", else "internal".
std::string kind_of(int exit_code);

/// A run of the command as a process of its own: what crashes it, or takes all memory, does not end the studio, and it can be ended
/// at any time. It is the command line that the page tells, so what comes of it is what that gives.
class ChildRun {
public:
  enum class State { running, done, failed, cancelled };
  struct Status {
    State state = State::running;
    std::string stage = {};
    std::optional<double> share = {};  ///< done of it, 0 to 1, where that can be known
    std::optional<double> left_s = {};
    std::string kind = {};     ///< of what failed
    std::string message = {};  ///< what the command says
  };

  /// @param folder   where it runs
  /// @param words    behind the program's name
  /// @param options  as parsed from these
  ChildRun(std::filesystem::path folder, std::vector<std::string> words, const Options& options);
  ~ChildRun();
  ChildRun(const ChildRun&) = delete;
  ChildRun& operator=(const ChildRun&) = delete;

  void cancel() { cancelled_ = true; }
  /// Until it has ended.
  void wait();
  Status status() const;

private:
  void follow(const std::vector<std::string>& words, const Options& options);
  void set(const Status& status);

  std::filesystem::path folder_;
  std::atomic<bool> cancelled_ = false;
  mutable std::mutex mutex_;
  Status status_;
  std::thread thread_;  ///< last: it uses the others
};

}  // namespace rayrep::tool
