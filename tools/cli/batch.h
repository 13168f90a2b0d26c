#pragma once

#include "options.h"
#include "rayrep/base/progress.h"

namespace rayrep::tool {

/// Runs the jobs of a file, each as a process of its own, several at once. Of each the folder gets what it writes, its report
/// (ID.json) and, last and by renaming, its line (lines/ID.json): whatever ends a batch, a later one goes on where it was.
/// @throws Error{usage} for a job that makes no sense, before anything is run; Error{interrupted}
void run_batch(const Options& options, const Progress& progress);

/// Writes the jobs of a parameter study.
void run_sweep(const Options& options);

}  // namespace rayrep::tool
