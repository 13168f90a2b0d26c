#pragma once

#include <vector>

#include "rayrep/mesh/mesh.h"

namespace rayrep::detail {

/// How two meshes of the same triangles differ.
struct Change {
  double rms_mm = 0;  ///< over the surface of the first
  double largest_mm = 0;
  double normals_rad = 0;  ///< root mean square over the surface of the first
};
Change change_between(const Mesh& before, const Mesh& after);

}  // namespace rayrep::detail
