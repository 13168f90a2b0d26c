#pragma once

#include <cstddef>
#include <string>

#include "rayrep/base/progress.h"
#include "rayrep/mesh/mesh.h"

namespace rayrep {

/// What became of closed bodies that overlap.
struct UnitedBodies {
  std::size_t bodies = 0;  ///< that overlap others; 0: none do
  std::string left;        ///< why they were left as they are, as part of a sentence; empty: they were made one
  Mesh mesh;               ///< then: the boundary of their union
};

/// Makes one of closed bodies that overlap: facing outward, with volume in common. A body that is there twice overlaps itself.
/// theory.md (146)
/// @param mesh  closed, vertices merged, components turned outward: what check_mesh gives
/// @param twice  triangles of it may be there more than once
/// @throws Error{interrupted}
UnitedBodies united_bodies(const Mesh& mesh, bool twice, const Progress& progress);

}  // namespace rayrep
