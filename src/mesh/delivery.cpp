#include "rayrep/mesh/delivery.h"

#include <algorithm>

#include "rayrep/mesh/assembly.h"

namespace rayrep {

Mesh Delivery::mesh_of(Part::Role role) const {
  Mesh mesh;
  for (const Part& part : parts)
    if (part.role == role) append(mesh, part.mesh);
  return role == Part::Role::body && in_pieces(*this) ? glued(mesh) : mesh;
}

std::size_t Delivery::triangles() const {
  std::size_t sum = 0;
  for (const Part& part : parts) sum += part.mesh.triangles.size();
  return sum;
}

bool Delivery::has_infill() const {
  return std::any_of(parts.begin(), parts.end(), [](const Part& part) { return part.infill.has_value(); });
}

bool Delivery::has_inserts() const {
  return std::any_of(parts.begin(), parts.end(), [](const Part& part) { return part.role == Part::Role::insert; });
}

Mesh Delivery::solid() const {
  Mesh mesh = body();
  for (const Part& part : parts)
    if (part.infill) {
      Mesh hole = part.mesh;
      flip(hole);
      append(mesh, hole);
    }
  return mesh;
}

}  // namespace rayrep
