#pragma once

#include <span>
#include <vector>

#include "rayrep/mesh/mesh.h"

namespace rayrep {

/// Appends a polygon as n - 2 triangles of the same orientation that use each of its edges once: a fan where its
/// projection along the Newell normal is strictly convex, ears otherwise. Polygons that cross themselves or have no
/// area come out with n - 2 triangles all the same. One that is not flat does not depend on the corner it starts with: a quad
/// is split along its shorter diagonal inside, a larger one from its corner of smallest coordinates on.
/// @return how far its corners lie from a plane, relative to its size
double append_triangulated(std::span<const int> polygon, Mesh& mesh);

}  // namespace rayrep
