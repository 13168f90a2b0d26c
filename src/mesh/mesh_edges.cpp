#include "mesh/mesh_edges.h"

namespace rayrep {

VertexCorners::VertexCorners(const Mesh& mesh) : first(mesh.vertices.size() + 1), corners(3 * mesh.triangles.size()) {
  // Counting sort: `first` holds the ends of the runs, and is brought down to their beginnings as these are filled from behind.
  for (const auto& t : mesh.triangles)
    for (int k = 0; k < 3; ++k) ++first[t[k]];
  int end = 0;
  for (int& n : first) n = end += n;
  for (std::size_t t = mesh.triangles.size(); t-- > 0;)
    for (int k = 3; k-- > 0;) corners[--first[mesh.triangles[t][k]]] = static_cast<int>(3 * t) + k;
}

}  // namespace rayrep
