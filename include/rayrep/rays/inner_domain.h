#pragma once

#include <Eigen/Core>
#include <cstddef>

#include "rayrep/base/progress.h"
#include "rayrep/mesh/block_field.h"
#include "rayrep/mesh/surface_query.h"
#include "rayrep/rays/ray_cast.h"
#include "rayrep/rays/ray_rep.h"

namespace rayrep {

struct InnerDomainOptions {
  double wall_mm = 1.2;
  double ray_spacing_mm = 0.5;
  double field_spacing_mm = 0.5;  ///< grid on which the cavity is meshed
  double min_component_mm3 = 0;   ///< connected pieces of the inner domain smaller than this stay solid
};

/// All points of a solid at least `wall` from its surface, twice: as a ray-rep for the solver, with ends that lie on the offset
/// surface, and as samples of wall - distance for meshing. Rays run along z: bring the mesh into that frame first.
struct InnerDomain {
  RayRep rays;
  BlockField field;  ///< wall - distance, mm: negative inside the inner domain
  CastReport cast;   ///< of `rays` and of the columns of `field` together
  std::size_t dropped_components = 0;
  double dropped_mm3 = 0;  ///< volume of the pieces that were too small
};

/// Distances come from closest-point queries where the offset surface passes, found by descending from blocks of 8^3 samples with
/// the fact that distance is 1-Lipschitz: cost grows with the area of the offset surface over the spacing squared. An end of a ray
/// is bracketed by the samples and refined by Newton steps on exact distances. theory.md (11)-(12).
///
/// Only points with winding number exactly one are inside: where components overlap the solid stays, since a cavity shell there
/// would leave winding number one and be printed solid. A domain with nothing inside is a result (rays.intervals empty), not an
/// error.
/// @throws Error{interrupted}
InnerDomain inner_domain(const SurfaceQuery& surface, const InnerDomainOptions& options, const Progress& progress = {});

/// The point of the solid farthest from its surface (centre of the largest ball inside) and that distance: branch and bound with
/// the 1-Lipschitz distance over at most 20000 samples, then a search along the axes. Zero for a mesh without inside. Not
/// guaranteed: a body with very many equally deep places may have one a little deeper.
/// @throws Error{interrupted}
ClosestPoint deepest_point(const SurfaceQuery& surface, const Progress& progress = {});

}  // namespace rayrep
