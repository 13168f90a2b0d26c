#pragma once

#include "options.h"
#include "rayrep/base/progress.h"

namespace rayrep::tool {

/// Runs one command: reads, computes, writes, prints. Whatever does not end well is thrown.
void run(const Options& options, const std::function<bool()>& cancelled);

}  // namespace rayrep::tool
