#pragma once

#include "rayrep/base/progress.h"
#include "rayrep/mesh/mesh.h"
#include "rayrep/mesh/surface_query.h"

namespace rayrep {

/// How exact largest_distance is to be.
struct DistanceTolerance {
  double relative = 1e-3;
  double absolute_mm = 0;
};

/// The one-sided Hausdorff distance from a mesh to a surface, theory.md (41): the largest distance from the surface that any point
/// of the mesh has, in the middle of its triangles too; mm. Where that is less than `known_mm`, `known_mm` is returned; otherwise
/// what is returned is the distance of a point that was found, and no point is farther by more than the larger of the tolerances.
/// (Should that take a million pieces and eight for each triangle, a proven upper bound is returned.) 0 for a mesh without
/// triangles, infinite for a surface without.
/// @throws Error{interrupted}
double largest_distance(const Mesh& mesh, const SurfaceQuery& surface, double known_mm, const DistanceTolerance& tolerance,
                        const Progress& progress);

}  // namespace rayrep
