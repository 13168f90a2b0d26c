#pragma once

#include "mesh/close_pairs.h"
#include "rayrep/mesh/mesh.h"

namespace rayrep {

/// Unordered pairs (i < j) of triangles that meet beyond the corners and edges they share (by index), or share all corners; sorted.
/// Exact. Triangles of zero area are left out: what they cross their neighbours cross or touch.
/// @param close  close_pairs of the mesh
TrianglePairs crossing_pairs(const Mesh& mesh, TrianglePairs close);

}  // namespace rayrep
