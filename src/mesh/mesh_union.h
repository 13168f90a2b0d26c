#pragma once

#include "mesh/close_pairs.h"
#include "rayrep/base/progress.h"
#include "rayrep/mesh/mesh.h"

namespace rayrep {

/// boundary_of_union of mesh_check.h for a mesh whose close_pairs are known.
Mesh boundary_of_union(const Mesh& mesh, const TrianglePairs& close, const Progress& progress);

}  // namespace rayrep
