#pragma once

#include <vector>

#include "rayrep/mesh/mesh.h"
#include "rayrep/mesh/quadric.h"

namespace rayrep {

/// Appends the part of f = 0 that loops bound, as triangles that face the side where f is negative. The quadric is mapped to the
/// plane, where the loops are triangulated and points added until no triangle is farther from it than the error allows; they are
/// put on f = 0. Of f and -f they are the same triangles. theory.md (87)
/// @param loops  vertices of `mesh` on f = 0, in the way in which the caps run
/// @param[out] tangled  where loops cross, the ends of their sides that do, and loops that run the wrong way round: in the map in
///                      which these are fewest
/// @returns false, and leaves the mesh as it is, where no map of the quadric holds them: loops that cross, or leave an end open
bool append_caps(const Quadric& f, const std::vector<std::vector<int>>& loops, double error_mm, Mesh& mesh,
                 std::vector<int>& tangled);

/// Of f and -f one, by the sign of the first of its numbers that is not 0.
bool comes_first(const Quadric& f);

}  // namespace rayrep
