#pragma once

#include "options.h"
#include "stages.h"

// What takes a scene: parts that move.

namespace rayrep::tool {

/// @throws Error{input} when something is wrong with it
void run_scene(const Options& options, Stages& stages, const Progress& progress);

/// @throws Error{goal} when parts get into each other; Error{input} for a scene that cannot be used
void run_motion(const Options& options, Stages& stages, const Progress& progress);

/// Writes what is left of the part. @throws Error{goal} when nothing is; Error{input} for a scene that cannot be used
void run_carve(const Options& options, Stages& stages, const Progress& progress);

}  // namespace rayrep::tool
