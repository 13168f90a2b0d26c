#pragma once

#include <vector>

#include "mesh/triangle_distance.h"
#include "rayrep/base/progress.h"
#include "rayrep/mesh/mesh.h"
#include "rayrep/mesh/surface_query.h"

// Distances between all of the triangles of a mesh and a surface, the middle of triangles too. theory.md (43)

namespace rayrep {

/// The smallest distance between any point of a mesh and any point of a surface, mm; 0 where they cross, infinite when one has no
/// triangles. What is returned is the distance of two triangles, and none are nearer by more than 1e-9 of it.
/// @throws Error{interrupted}
double smallest_gap(const Mesh& mesh, const SurfaceQuery& surface, const Progress& progress = {});

/// Where a triangle of a mesh comes too near to a surface.
struct Gap {
  int triangle = -1;
  NearestPair nearest;  ///< first on the mesh
};

/// The triangles of a mesh that are nearer to a surface than `limit_mm`, each with where it is nearest.
/// @param chosen  of the mesh's triangles; only these are looked at, and those found come in their order
std::vector<Gap> gaps_below(const Mesh& mesh, const std::vector<int>& chosen, const SurfaceQuery& surface, double limit_mm);

}  // namespace rayrep
