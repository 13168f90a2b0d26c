#pragma once

#include <filesystem>
#include <vector>

#include "record.h"

namespace rayrep::bench {

/// Writes folder/results.md and folder/results/*.svg from measurements; later runs win where two measured the same.
/// @param micro  JSON output of Google Benchmark; empty: none
/// @throws std::runtime_error when a file cannot be read or written
void write_results(const std::vector<Measurements>& runs, const std::filesystem::path& micro, const std::filesystem::path& folder);

}  // namespace rayrep::bench
