#pragma once

#include <Eigen/Core>

#include "rayrep/base/progress.h"
#include "rayrep/mesh/mesh.h"
#include "rayrep/mesh/quadric.h"

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

struct QuadricCutOptions {
  double error_mm = 0.02;  ///< of chords: as far as edges and triangles may be from the curves of the cut and from f = 0
};

/// What of a closed mesh lies where f > 0, closed again by caps on f = 0: outside of Quadric::cylinder it is drilled, inside of -f
/// what the drill takes out. Planes are as above. Points of the cut lie on edges and triangles of the mesh and on f = 0; those of
/// caps on f = 0. Curves and caps are made of chords with `error_mm`; where f = 0 enters and leaves by less than it, it may be
/// overlooked. Vertices that are kept are so bit for bit. The parts of f and of -f are one another's complement: their caps are the
/// same triangles. Where f = 0 runs through corners of the mesh such that no closed curves come of it, it is moved by some
/// thousandths of the error. Takes time in the number of triangles, and a logarithm more of those that are cut. theory.md (87),
/// (93)
/// @param mesh  closed, every edge in two triangles, vertices merged, not crossing itself
/// @return      without vertices that nothing uses; empty when nothing lies there
/// @throws Error{input} where curves of the cut come nearer to each other than the error, so that no caps can be made
/// @throws Error{interrupted}
Mesh clipped(const Mesh& mesh, const Quadric& f, const QuadricCutOptions& options = {}, const Progress& progress = {});

}  // namespace rayrep
