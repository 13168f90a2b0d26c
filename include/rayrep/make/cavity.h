#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <functional>
#include <vector>

#include "rayrep/mesh/block_field.h"
#include "rayrep/mesh/mesh.h"
#include "rayrep/mesh/surface_query.h"
#include "rayrep/physics/moments.h"

namespace rayrep {

struct CavityOptions {
  double wall_mm = 1.2;
  double min_cavity_mm3 = 4.0;  ///< smaller cavities are left out: they cannot be printed
  double inset_mm = 0;          ///< at least so far from q.phi = 0, too
  bool sharp_ridges = false;    ///< of the surface at the wall's distance, see make/ridges.h
  double clearance_mm = 0;      ///< and so much farther from the surface than the wall; less than a step of the grid
  /// What becomes of a mesh when it is delivered (turned back, rounded to what the file stores): no triangles may cross then.
  /// Empty: nothing.
  std::function<Mesh(const Mesh&)> as_delivered;

  double least_distance_mm() const { return wall_mm + clearance_mm; }  ///< of the cavity from the surface
};

struct CavityMesh {
  Mesh mesh;  ///< closed shells facing into the cavity, away from the material
  std::size_t cavities = 0;
  std::size_t filled = 0;  ///< cavities left out because they were too small
  double filled_mm3 = 0;
  std::size_t closed_samples = 0;   ///< samples of the field closed because the surface folded there, see below
  std::size_t crossing = 0;         ///< triangles that meet another one as delivered for all that
  std::size_t removed_islands = 0;  ///< specks of material floating in a cavity, left out
  double removed_mm3 = 0;
};

/// The surface of the cavity { p : distance(p) >= wall and q.phi(p) > 0 }: the zero set of max(wall - distance,
/// -q.phi / |grad q.phi|), meshed on the grid of `field` and then moved onto the exact surfaces: vertices nearer to the offset
/// surface by exact closest points, the others along the gradient of the quadric. theory.md (16). Where the body is reentrant
/// vertices keep a little more than the wall, so that the triangles between them keep it too, to second order in the spacing:
/// theory.md (16c); what that leaves below 0.99 of the wall is measured and moved away, and vertices that rounding puts on each
/// other are parted: theory.md (16f). Where the surface crosses itself as delivered for all that (slits thinner than a cell) the
/// cavity is closed: the samples there are set to outside in `field`, and the mesh is made again, until it is free of
/// self-intersections or nothing is left to close. Whether the shells are closed is for a judge to say.
/// With an inset the cavity ends where |q.phi| = |grad q.phi| d + |H| d^2 / 2, H the Hessian, is d = inset: nowhere nearer to
/// q.phi = 0 than that.
/// @param field  wall - distance, see InnerDomain
/// @param q      switching function: material is where q.phi < 0
CavityMesh mesh_cavity(BlockField& field, const SurfaceQuery& surface, const Moments& q, const CavityOptions& options);

/// Moves the vertices of a cavity that was made for a slightly different q onto the surfaces of this one: what lies on the offset
/// surface stays, the rest follows the quadric. Much cheaper than meshing anew.
/// @returns false, and leaves the mesh as it is, when a vertex would have to move by more than half a cell
bool follow_quadric(CavityMesh& cavity, const BlockField& field, const SurfaceQuery& surface, const Moments& q,
                    const CavityOptions& options);

/// Triangles of a mesh that meet another one beyond a shared vertex or edge, or have all corners in common with it, ascending.
std::vector<std::size_t> crossing_triangles(const Mesh& mesh);

}  // namespace rayrep
