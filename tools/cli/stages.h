#pragma once

#include <chrono>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "options.h"

namespace rayrep::tool {

/// Notes how long each stage takes and tells it on standard error: on a terminal in one line that follows the work, with about how
/// long it will still take where that can be known; with --verbose each stage in a line of its own, everywhere.
class Stages {
public:
  explicit Stages(const Options& options);
  ~Stages() { clear_line(); }
  Stages(const Stages&) = delete;
  Stages& operator=(const Stages&) = delete;

  void begin(std::string_view name);

  /// While a stage goes on: the line on a terminal is drawn again, not more often than can be read.
  void tick();

  /// Stages and their seconds in order of first occurrence, then "total".
  std::vector<std::pair<std::string, double>> finish();

  /// About how long it will still take, where that can be known.
  std::optional<double> seconds_left() const;
  double seconds_so_far() const;

private:
  using Clock = std::chrono::steady_clock;

  void end();
  void show();
  void clear_line() const;
  std::string emphasised(const std::string& text) const;

  bool verbose_;
  bool live_;    ///< a terminal that can draw a line again
  bool colour_;  ///< and may be told in bold
  bool known_;   ///< of such runs it is known how their time is shared
  std::string current_;
  Clock::time_point born_ = Clock::now();
  Clock::time_point started_;
  Clock::time_point shown_;
  std::vector<std::pair<std::string, double>> spent_;
};

}  // namespace rayrep::tool
