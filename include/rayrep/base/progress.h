#pragma once

#include <functional>
#include <string_view>

namespace rayrep {

/// How a long computation talks to its caller. Both functions may be empty. They are called from the thread that called
/// the library, never from a worker, several times a second while work goes on.
///
/// The library has no clock: a caller that wants timings notes the time whenever `stage` is called.
struct Progress {
  /// Called when a stage begins: "domain", "rays", "waterline", "solve", "mesh"; the command adds its own.
  /// A stage lasts until the next one begins and may come more than once.
  std::function<void(std::string_view name)> stage;

  /// Polled often; returning true makes the computation throw Error{ErrorCode::interrupted} within a second.
  std::function<bool()> cancelled;

  void begin(std::string_view name) const;  ///< calls `stage` if there is one, then `check`
  void check() const;                       ///< @throws Error{interrupted} if `cancelled` says so
};

}  // namespace rayrep
