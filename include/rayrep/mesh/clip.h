#pragma once

#include <Eigen/Core>

#include "rayrep/base/progress.h"
#include "rayrep/mesh/mesh.h"

namespace rayrep {

/// The points p with normal . p = offset; what is kept of a body lies where normal . p is larger.
struct ClipPlane {
  Eigen::Vector3d normal = Eigen::Vector3d::UnitZ();  ///< a unit vector
  double offset_mm = 0;
};

/// What of a closed mesh lies on the side of the plane to which its normal points, closed again by caps in the plane. The caps run
/// against the normal, along the polygons in which the surface crosses the plane, with their holes; no vertex is added to them, so
/// that neighbours stay closed. Triangles of the mesh that lie in the plane give way to the caps. A vertex in the plane counts as
/// above it. Vertices that are kept are so bit for bit, those on the cut depend on the edge alone, not on how it is run.
/// Takes time in the number of triangles.
/// @param mesh  closed, vertices merged. Where it crosses itself in the plane its caps overlap, as its inside does.
/// @return      without vertices that nothing uses; empty when nothing lies above
/// @throws Error{interrupted}
Mesh clipped(const Mesh& mesh, const ClipPlane& plane, const Progress& progress = {});

}  // namespace rayrep
