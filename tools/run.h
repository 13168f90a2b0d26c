#pragma once

#include "options.h"
#include "rayrep/progress.h"

namespace rayrep::tool {

/// Runs one command: reads, computes, writes, prints. Returns the exit code; errors are thrown.
int run(const Options& options, const std::function<bool()>& cancelled);

}  // namespace rayrep::tool
