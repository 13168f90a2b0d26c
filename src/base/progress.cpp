#include "rayrep/base/progress.h"

#include "rayrep/base/error.h"

namespace rayrep {

void Progress::begin(std::string_view name) const {
  if (stage) stage(name);
  check();
}

void Progress::check() const {
  if (cancelled && cancelled()) throw Error(ErrorCode::interrupted, "Interrupted; nothing was written.");
}

}  // namespace rayrep
