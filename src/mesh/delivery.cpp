#include "rayrep/mesh/delivery.h"

namespace rayrep {

Mesh Delivery::mesh_of(Part::Role role) const {
  Mesh mesh;
  for (const Part& part : parts)
    if (part.role == role) append(mesh, part.mesh);
  return mesh;
}

}  // namespace rayrep
