#pragma once

#include <vector>

#include "rayrep/mesh/mesh_check.h"

namespace rayrep {

/// How the triangles of a surface hang together.
struct Orientation {
  std::vector<int> patch;  ///< of each triangle: joined over edges of two triangles
  int patches = 0;
  std::vector<int> of_triangle;  ///< shells: patches that can be turned on their own without opening an edge; by first appearance
  int count = 0;                 ///< of these
  std::vector<bool> turned;      ///< triangles turned to agree with their neighbours
  Defect one_sided;              ///< patches like a Moebius strip: no orientation makes the neighbours agree
};

/// Turns triangles so that the two of every manifold edge agree, keeping the orientation of the majority in each patch, and joins
/// patches that balance each other over non-manifold edges.
/// @param mesh  vertices merged
Orientation orient_neighbours(Mesh& mesh);

}  // namespace rayrep
