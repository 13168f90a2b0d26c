#pragma once

#include <filesystem>

#include "rayrep/base/progress.h"
#include "rayrep/motion/scene.h"

// Robots as URDF describes them, as scenes (docs/scene.md).

namespace rayrep {

struct UrdfOptions {
  bool visual = false;  ///< links are their visual shapes, where they have any, not those for collisions
};

/// How far keys may let a part be from where its joints have it, between two of them, theory.md (125).
inline constexpr double kUrdfDeviation_mm = 1e-3;

/// Reads a robot's description (URDF, in m and rad) and its meshes. Parts are links with a shape, those that fixed joints hold
/// together as one, in the coordinates of the whole robot at rest: all joints at 0, or at the limit next to it. Each has its pivot
/// on the axis of the joint that carries it, and is in `mesh`, without a file. States are that rest and, for each joint that moves,
/// its lower and its upper limit; transitions lead from rest to each of these, and once round for a joint without limits, theory.md
/// (124). Parts that a joint connects may touch. Joints that mimic another move with it. What is not taken is in `notes`, with how
/// far the shapes and motions of the scene are from those described.
/// @throws Error{input} with all that is wrong: no URDF, no tree of links, a mesh that cannot be read or is no solid;
/// Error{interrupted}
SceneFile import_urdf(const std::filesystem::path& path, const UrdfOptions& options = {}, const Progress& progress = {});

}  // namespace rayrep
