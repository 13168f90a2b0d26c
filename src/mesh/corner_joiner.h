#pragma once

#include <vector>

#include "mesh/close_pairs.h"
#include "rayrep/mesh/boolean.h"

namespace rayrep {

/// What rounding has done to a mesh.
struct Flaws {
  TrianglePairs crossings;  ///< that meet beyond what they share
  std::vector<int> flat;    ///< of no area

  std::size_t size() const { return crossings.size() + flat.size(); }
  std::vector<int> triangles() const {
    std::vector<int> found = flat;
    for (const auto& [s, t] : crossings) found.insert(found.end(), {s, t});
    return found;
  }
};

struct Joining {
  double reach_mm = 0;
  bool at_crossings = false;  ///< sides of triangles that cross, too, which pass each other within reach: a new corner for both
};

/// Joins corners of triangles with flaws that are within reach of each other, to the first of them, and splits sides of such
/// triangles at corners within reach of them. A closed surface stays so, and may cross itself more than before: theory.md (91).
CombinedMesh with_joined_corners(const CombinedMesh& given, const Flaws& flaws, const Joining& joining);

}  // namespace rayrep
