#pragma once

#include <string>

#include "rayrep/motion/scene.h"

namespace rayrep {

/// How long a transition of a scene takes in glTF, s.
inline constexpr double kGltfSeconds = 2;

/// A scene as binary glTF 2.0 (.glb), in m, +Y up: a node for each part, in its place in the first state, with its mesh about its
/// pivot, below one that turns the state's up to +Y; an animation for each transition. Motions are those of the scene, but for the
/// rounding of float32: a Bezier curve is a CUBICSPLINE, a slerp LINEAR (turns of more than 120 degrees in
/// two), theory.md (108).
/// @throws Error{write} for more than the 4 GB that such a file can hold
std::string to_glb(const Scene& scene);

}  // namespace rayrep
