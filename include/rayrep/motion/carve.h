#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "rayrep/base/progress.h"
#include "rayrep/mesh/mesh.h"
#include "rayrep/motion/scene.h"

namespace rayrep {

struct CarveOptions {
  double clearance_mm = 0.3;  ///< that shall be between what is left and the other part, wherever that comes
  double tolerance_mm =
      0.2;               ///< how much further away what is taken away may reach, about; time and triangles grow with its square
  bool float32 = false;  ///< what is left will be stored as float32 (STL)
};

/// A part with room for another one's way through it, in the coordinates of its mesh.
struct Carving {
  Mesh left;   ///< of the part
  Mesh taken;  ///< closed: the room, cut off beyond the part's box
  /// Nothing that is left is nearer to where the other part comes, proven; at least CarveOptions::clearance_mm.
  double at_least_mm = 0;
  double at_most_mm = 0;  ///< nothing was taken away that is further from there, proven
  double removed_mm3 = 0;
  std::size_t bodies = 0;  ///< that are left; 0: nothing
};

/// The part less the offset of what the other one sweeps, seen from the part: in all transitions and states of the scene (Eq. 4 of
/// the Reconfigurables paper), theory.md (113), (114). The rest of the part's surface stays as it is.
/// @throws Error{usage} for sizes that make no sense or a part and itself; Error{goal} where the clearance or tolerance would take
/// more than 2e9 samples; Error{interrupted}
Carving carve(const Scene& scene, std::size_t part, std::size_t by, const CarveOptions& options = {},
              const Progress& progress = {});

}  // namespace rayrep
