#pragma once

#include <functional>

#include "options.h"

namespace rayrep::tool {

/// Serves the studio until `cancelled`, then ends the process.
/// @throws Error when it cannot begin: a mesh that cannot be read, a port that is taken
void run_studio(const Options& options, const std::function<bool()>& cancelled);

}  // namespace rayrep::tool
