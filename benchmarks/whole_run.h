#pragma once

#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "record.h"

namespace rayrep::bench {

/// What came of one call of the rayrep command.
struct WholeRun {
  int exit_code = 0;
  std::string error;      ///< first sentence of what it said, when it failed
  nlohmann::json report;  ///< of --report; null when there is none
};

/// Runs `tool arguments... -o FILE --report FILE` in a process of its own, as a user would; the hollowed mesh is thrown away.
WholeRun whole_run(const std::filesystem::path& tool, const std::vector<std::string>& arguments);

/// Such runs as a record: seconds and peak memory of the whole command, stages as "stage NAME", criteria of the judge by name.
/// Repeated up to `repeats` times while it takes less than 5 s.
/// @param last  the last run, for what else its report tells
Record measure_whole(const std::filesystem::path& tool, const std::vector<std::string>& arguments, int repeats,
                     WholeRun* last = nullptr);

}  // namespace rayrep::bench
