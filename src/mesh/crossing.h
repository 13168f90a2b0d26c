#pragma once

#include <cstddef>
#include <vector>

#include "mesh/close_pairs.h"
#include "rayrep/mesh/mesh.h"

namespace rayrep {

/// Unordered pairs (i < j) of triangles that meet beyond the corners and edges they share (by index), or share all corners; sorted.
/// Exact. Triangles of zero area are left out: what they cross their neighbours cross or touch.
/// @param close  close_pairs of the mesh
TrianglePairs crossing_pairs(const Mesh& mesh, TrianglePairs close);

/// Those in any pair, ascending.
std::vector<std::size_t> triangles_of(const TrianglePairs& pairs);

/// Triangles that cross others, ascending, of those in the box around all that have a marked corner.
/// @param marked  of each vertex
std::vector<std::size_t> crossing_near(Mesh mesh, const std::vector<char>& marked);

}  // namespace rayrep
