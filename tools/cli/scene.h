#pragma once

#include "options.h"
#include "stages.h"

// What takes a scene: parts that move.

namespace rayrep::tool {

/// Checks, imports, or exports. @throws Error{input} when something is wrong with the scene, or with the robot
void run_scene(const Options& options, Stages& stages, const Progress& progress);

/// @throws Error{goal} when parts get into each other; Error{input} for a scene that cannot be used
void run_motion(const Options& options, Stages& stages, const Progress& progress);

/// Writes what is left of the part. @throws Error{goal} when nothing is; Error{input} for a scene that cannot be used
void run_carve(const Options& options, Stages& stages, const Progress& progress);

/// Writes the parts and the scene that names them, once they are judged. @throws Error{goal} when the thing does not rest in one of
/// its states; Error{input} for a scene that cannot be used
void run_balance(const Options& options, Stages& stages, const Progress& progress);

}  // namespace rayrep::tool
