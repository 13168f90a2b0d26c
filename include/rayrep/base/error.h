#pragma once

#include <stdexcept>
#include <string>

namespace rayrep {

/// What kind of thing went wrong. The value is the exit code of the rayrep command.
enum class ErrorCode {
  internal = 1,      ///< a defect of rayrep itself
  usage = 2,         ///< an option or argument that makes no sense
  input = 3,         ///< a mesh that cannot be read or used
  goal = 4,          ///< a goal that physics or the wall thickness does not allow
  solver = 5,        ///< a solver stopped before it converged
  write = 6,         ///< an output that could not be written
  interrupted = 130  ///< cancelled through Progress::cancelled
};

/// The only exception rayrep throws on purpose. `what()` says what is wrong, where (with the measured numbers), and
/// what to do about it, in full sentences that can be shown to a user as they are.
class Error : public std::runtime_error {
public:
  Error(ErrorCode code, const std::string& message) : std::runtime_error(message), code_(code) {}
  ErrorCode code() const noexcept { return code_; }

private:
  ErrorCode code_;
};

}  // namespace rayrep
