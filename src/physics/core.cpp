#include "rayrep/physics/core.h"

#include "rayrep/physics/materials.h"

namespace rayrep {

bool Core::poured() const { return !material.empty() && core_material(material).poured; }

double Core::partition(double wall_mm) const { return partition_mm.value_or(poured() || volume_cm3 ? wall_mm : 0); }

Moments insert_moments(const Delivery& delivery, double density_g_cm3) {
  Moments s = Moments::Zero();
  for (const Part& part : delivery.parts)
    if (part.role == Part::Role::insert) s += part.density_g_cm3 / density_g_cm3 * mesh_moments(part.mesh);
  return s;
}

}  // namespace rayrep
