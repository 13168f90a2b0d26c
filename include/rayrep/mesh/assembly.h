#pragma once

#include "rayrep/base/progress.h"
#include "rayrep/mesh/clip.h"
#include "rayrep/mesh/delivery.h"
#include "rayrep/mesh/mesh.h"

// A body in pieces, and what they are together.

namespace rayrep {

/// Whether its body is printed in several pieces: parts of it have names.
bool in_pieces(const Delivery& delivery);

/// Without the triangles that lie on each other face to face, corner on corner: the boundary of what pieces are together that
/// touch in the same triangles. The volume it encloses is the sum of theirs, and so are all of its moments.
/// @return  vertices merged; without those that nothing uses
Mesh glued(const Mesh& mesh);

/// The two sides of a cut: closed, with the same triangles in the plane, turned round. `glued` makes the mesh of them again.
struct Halves {
  Mesh above;  ///< to which the normal points
  Mesh below;
};

/// A closed mesh cut in two as `clipped` cuts it, both sides at the same points. Where a triangle of one mesh is one of another's,
/// turned round, the pieces of it are so, too: of pieces that touch, all may be cut, and still do.
/// @param mesh  closed, vertices merged
/// @return      one of them is empty where the plane does not meet the mesh
/// @throws Error{interrupted}
Halves halves(const Mesh& mesh, const ClipPlane& plane, const Progress& progress = {});

}  // namespace rayrep
