#pragma once

#include "rayrep/mesh/mesh.h"
#include "rayrep/mesh/surface_query.h"

namespace rayrep::detail {

/// Moves vertices of an offset surface that lie beside a ridge of it, where it folds outward, onto the ridge: contouring cuts those
/// off by a part of a cell, and what was a steep roof to both sides is flat there. A vertex goes where the planes of its neighbours
/// meet, if that is within a cell, at the wall's distance, and turns no triangle. theory.md (101)
/// @param mesh  facing outward; what of it is not at the wall's distance from the surface stays as it is
void sharpen_ridges(Mesh& mesh, const SurfaceQuery& surface, double wall_mm, double cell_mm);

}  // namespace rayrep::detail
