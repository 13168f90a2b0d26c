#pragma once

#include <vector>

#include "rayrep/mesh/mesh.h"
#include "rayrep/physics/bead.h"

namespace rayrep {

/// The bars that beads are taken to be (see Bead), each closed and facing outward; where they overlap the surface winds more than
/// once. Beads of no length in plan are squares. Twelve triangles each.
Mesh bead_bars(const std::vector<Bead>& beads);

}  // namespace rayrep
