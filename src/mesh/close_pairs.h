#pragma once

#include <utility>
#include <vector>

#include "rayrep/base/progress.h"
#include "rayrep/mesh/mesh.h"

namespace rayrep {

using TrianglePairs = std::vector<std::pair<int, int>>;

/// Unordered pairs (i < j) of triangles that may meet elsewhere than in shared vertices (by index), each once, sorted. Left out are
/// pairs that a plane keeps apart but for what they share, by more than 1e-9 of the mesh's diagonal (upright on an axis, across the
/// line between their middles, through one of the two, or upright on it along a side), and neighbours around a vertex that is seen
/// to be surrounded once, or of a large fan of triangles. @throws Error{interrupted}
TrianglePairs close_pairs(const Mesh& mesh, const Progress& progress = {});

}  // namespace rayrep
