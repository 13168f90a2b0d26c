#pragma once

#include "rayrep/physics/moments.h"
#include "rayrep/rays/ray_rep.h"

namespace rayrep {

/// What of the rays lies where q.phi > 0, on the same grid: of each interval the stretches between roots of a quadratic in z.
/// theory.md (29)
RayRep positive_part(const RayRep& domain, const Moments& q);

}  // namespace rayrep
