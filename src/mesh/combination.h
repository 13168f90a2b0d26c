#pragma once

#include "mesh/close_pairs.h"
#include "mesh/windings.h"
#include "rayrep/base/progress.h"
#include "rayrep/mesh/boolean.h"

namespace rayrep {

/// `combined` of boolean.h for triangles over merged vertices, as rounding leaves it.
/// @param close  close_pairs of the mesh
CombinedMesh combination(Operands all, const TrianglePairs& close, const BooleanOptions& options, const Progress& progress);

}  // namespace rayrep
