#pragma once

#include <limits>

#include "rayrep/rays/inner_domain.h"

namespace rayrep::detail {

/// A solid in which regions stay solid: the triangles of `surface` from `kept_from` on are closed surfaces around those, facing
/// outward, which may cross each other and reach out of it. What is said of distances from the surface holds for both.
struct KeptSolid {
  const SurfaceQuery& surface;
  int kept_from = std::numeric_limits<int>::max();
};

/// As rayrep::cast_rays with Region::single_layer, without what is kept.
RayRep cast_rays(const KeptSolid& solid, const RayGrid& grid, CastReport* report, const Progress& progress);

/// As rayrep::inner_domain: points in no region that stays solid, and at least the wall from all of them, too. theory.md (97)
InnerDomain inner_domain(const KeptSolid& solid, const InnerDomainOptions& options, const Progress& progress = {});

}  // namespace rayrep::detail
