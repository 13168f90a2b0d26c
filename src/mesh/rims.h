#pragma once

#include <cstddef>
#include <utility>
#include <vector>

#include "rayrep/base/progress.h"
#include "rayrep/mesh/mesh.h"

// Where a surface is not closed, and how its rims are brought together where they lie on each other.

namespace rayrep {

/// The edges of a mesh that are not run equally often both ways.
struct Rims {
  struct Edge {
    int from, to;  ///< the way in which a triangle is missing
    int times;     ///< how often
  };
  std::vector<Edge> edges;    ///< by their lower vertex, then by their higher one
  std::vector<int> vertices;  ///< of them, ascending
  double length = 0;          ///< of them all

  bool closed() const { return edges.empty(); }
};
Rims rims_of(const Mesh& mesh);

/// A mesh after a step, and how often the step was taken.
struct Stepped {
  Mesh mesh;
  std::size_t count = 0;
};

/// Vertices of rims that lie within the tolerance of each other become the one of them with the smallest coordinates; triangles
/// that lose a corner by it go. Chains of vertices are not drawn together over more than three tolerances.
/// @throws Error{interrupted}
Stepped with_welded_rims(const Mesh& mesh, const Rims& rims, double tolerance, const Progress& progress);

/// Triangles at rims are split at the vertices of rims that lie within the tolerance of their sides: T-junctions.
/// @throws Error{interrupted}
Stepped with_split_rims(const Mesh& mesh, const Rims& rims, double tolerance, const Progress& progress);

}  // namespace rayrep
