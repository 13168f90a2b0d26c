#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <vector>

#include "mesh/rims.h"
#include "rayrep/base/progress.h"
#include "rayrep/mesh/mesh.h"

namespace rayrep {

/// A closed loop of rim edges.
struct Hole {
  std::vector<int> loop;  ///< vertices in the way in which a cap runs, from that of the smallest coordinates on; none twice
  double length = 0;      ///< around it
  Eigen::Vector3d middle = Eigen::Vector3d::Zero();
  Eigen::Vector3d normal = Eigen::Vector3d::Zero();  ///< of a cap; 0 where that has no area
  double size = 0;                                   ///< diagonal of its box
  double bulge = 0;                                  ///< largest distance of a vertex from the plane through the middle
};

/// The rims taken apart into loops. Depends on coordinates alone, not on numbers.
std::vector<Hole> holes_of(const Mesh& mesh, const Rims& rims);

/// Appends caps of flat holes: those in a plane inside another one that face the other way are left open in it, as in the end of a
/// tube.
void close_flat(const std::vector<Hole>& holes, double tolerance, Mesh& mesh, const Progress& progress);

/// Appends a cap of small area: the smallest of all triangulations of the loop where it has up to 200 vertices, else one that is
/// made of such parts.
void close_bent(const Hole& hole, Mesh& mesh);

}  // namespace rayrep
