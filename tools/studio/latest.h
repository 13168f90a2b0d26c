#pragma once

#include <condition_variable>
#include <cstdint>
#include <mutex>

namespace rayrep::tool {

/// Lets one at a time work, and of those who only look the last one who came: those before it, waiting or at work, are superseded.
class Latest {
public:
  enum class Kind {
    looks,  ///< is superseded by who comes after it
    works,  ///< is waited for
  };

  /// A turn to work, until it is destroyed.
  class Turn {
  public:
    /// Waits for it.
    Turn(Latest& latest, Kind kind);
    ~Turn();
    Turn(const Turn&) = delete;
    Turn& operator=(const Turn&) = delete;

    /// Whether there is no point in going on, or in beginning.
    bool superseded() const;

  private:
    Latest& latest_;
    Kind kind_;
    std::uint64_t number_ = 0;
    bool has_it_ = false;
  };

  /// Everybody is superseded from now on.
  void end();

private:
  std::mutex mutex_;
  std::condition_variable changed_;
  std::uint64_t newest_ = 0;
  bool taken_ = false;
  bool ended_ = false;
};

}  // namespace rayrep::tool
