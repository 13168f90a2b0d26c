#pragma once

#include <Eigen/Core>
#include <cstddef>

#include "rayrep/base/progress.h"
#include "rayrep/mesh/surface_query.h"
#include "rayrep/rays/ray_rep.h"

namespace rayrep {

/// Which points of a mesh with overlapping components count.
enum class Region {
  solid,         ///< winding number positive: the union of the components
  single_layer,  ///< winding number exactly one: where a cavity shell makes a void in every slicer
};

struct CastReport {
  std::size_t rays = 0;
  std::size_t bad = 0;  ///< rays that did not close (the mesh is not closed there): left empty
  Eigen::Vector2d first_bad_mm = Eigen::Vector2d::Zero();
};

/// Ray-rep of a closed mesh: per ray the intervals of the asked region, found from signed crossings (theory.md (10), never by odd
/// and even); hits within 1e-9 of the mesh's diagonal of each other coincide. The winding number along a ray must stay >= 0 and end
/// at 0; a ray where it does not is counted as bad.
/// @throws Error{interrupted}
RayRep cast_rays(const SurfaceQuery& surface, const RayGrid& grid, Region region, CastReport* report = nullptr,
                 const Progress& progress = {});

/// The grid whose cells of size `spacing_mm` cover the box in x and y; rays run through points off the cell centres by an
/// irrational fraction, so that they do not run along the edges and diagonals of CAD models.
RayGrid covering_grid(const Eigen::AlignedBox3d& box, double spacing_mm);

}  // namespace rayrep
