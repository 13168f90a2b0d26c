#pragma once

#include <Eigen/Core>
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

/// Where a hole comes out of the outside.
struct Mouth {
  Eigen::Vector3d centre_mm = Eigen::Vector3d::Zero();  ///< on the axis, where the outside was
  Eigen::Vector3d axis = Eigen::Vector3d::UnitZ();      ///< of the hole, outward
  double diameter_mm = 0;                               ///< of the circle around its rim, seen along the axis
};

/// The outer surface of a body with holes into its cavities, taken apart by the original. theory.md (104)
struct HoledOutside {
  std::vector<char> inside;   ///< of each triangle: it is of a hole, or of the cavity behind it
  std::vector<char> in_hole;  ///< of those, within the cylinder around a mouth's rim and joined to it
  std::size_t cavities = 0;   ///< that holes lead into
  std::vector<Mouth> mouths;  ///< in the order of their first vertices
  Mesh sealed;                ///< all that is not inside, its mouths closed
};

/// What is looked at, and what counts as a hole.
struct Holed {
  const Mesh& outer;                   ///< vertices merged
  const std::vector<char>& unchanged;  ///< of each of its triangles: it is one of the original's
  const Mesh& original;
  double widest_mm;    ///< with 1 % more for rounding: what opens wider is a change of the outside
  double rounding_mm;  ///< of coordinates
};

/// What is not on the original is inside where all its rims are those of holes.
HoledOutside holes_in(const Holed& what, const Progress& progress);

/// The pieces of triangles that lie in none of the mouths' cylinders of `widest_mm`, with 2 % more: cut in four until they are as
/// fine as that.
Mesh beside_mouths(const Mesh& mesh, const std::vector<Mouth>& mouths, double widest_mm);

}  // namespace rayrep::verify_detail
