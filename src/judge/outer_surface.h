#pragma once

#include <cstddef>
#include <vector>

#include "rayrep/base/progress.h"
#include "rayrep/mesh/mesh.h"

namespace rayrep::verify_detail {

/// Which triangles of two meshes are the same, corners in any order.
struct Match {
  std::vector<bool> delivered;  ///< is one of the original's
  std::vector<int> missing;     ///< of the original, ascending
};

/// @param as_float  coordinates are compared as float32, which is what STL keeps of the original's; otherwise they must be equal
Match match(const Mesh& delivered, const Mesh& original, bool as_float);

/// The outer surface before and after, and of each what is not there unchanged in the other.
struct OuterSurfaces {
  const Mesh& original;
  const Mesh& delivered;
  const Mesh& gone;   ///< triangles of the original
  const Mesh& added;  ///< triangles of the delivered one
};

/// The two-sided Hausdorff distance of what was changed, theory.md (41): the larger of the largest distance of a point of `gone`
/// from the delivered surface and of a point of `added` from the original; mm. 0 when nothing was changed. The error is below 1e-3
/// of the value or 2^-30 of the diagonal, whichever is larger; less than 2^-40 of the diagonal counts as
/// nothing.
double outer_deviation(const OuterSurfaces& surfaces, const Progress& progress);

}  // namespace rayrep::verify_detail
