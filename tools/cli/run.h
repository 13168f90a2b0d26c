#pragma once

#include "options.h"
#include "rayrep/base/progress.h"

namespace rayrep::tool {

/// Runs one command: reads, computes, writes, prints. Whatever does not end well is thrown.
void run(const Options& options, const std::function<bool()>& cancelled);

/// Looks for what would do where a hollowing was refused for its goal.
Advice advise(const Options& options, const std::function<bool()>& cancelled, const Search& search);

}  // namespace rayrep::tool
