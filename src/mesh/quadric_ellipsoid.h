#pragma once

#include "rayrep/mesh/mesh.h"
#include "rayrep/mesh/quadric.h"

namespace rayrep {

/// Whether f = 0 is an ellipsoid with a point inside of a closed mesh: all of it lies there if it does not meet the mesh.
bool holds_ellipsoid(const Mesh& mesh, const Quadric& f);

/// Appends the ellipsoid f = 0, as triangles between points of it, which are nowhere farther from it than the error and face the
/// side where f is negative.
void append_ellipsoid(const Quadric& f, double error_mm, Mesh& mesh);

}  // namespace rayrep
