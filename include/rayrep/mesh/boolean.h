#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "rayrep/base/progress.h"
#include "rayrep/mesh/mesh.h"

namespace rayrep {

enum class BooleanOperation {
  unite,      ///< in at least one of them
  intersect,  ///< in all of them
  subtract    ///< in the first and in no other
};

struct BooleanOptions {
  BooleanOperation operation = BooleanOperation::unite;
  bool float32 = false;  ///< vertices are rounded to float32, as a file that stores no others (STL) would do later, unchecked
};

/// A mesh made of others.
struct CombinedMesh {
  Mesh mesh;  ///< vertices merged; without those that nothing uses
  /// Where a triangle comes from: it is that one or a part of it, turned round where something was taken away.
  struct Source {
    int operand = -1;
    int triangle = -1;
    bool whole = false;  ///< it is that triangle, with its corners bit for bit where they were not rounded to float32
  };
  std::vector<Source> sources;  ///< of each triangle
  /// What rounding the vertices to doubles (or float32) has left after repair. Both are 0 but where parts lie on each other within
  /// some ten times that rounding.
  std::size_t crossings = 0;  ///< pairs of triangles that meet beyond shared corners and sides
  std::size_t flat = 0;       ///< triangles of no area
};

/// The union, intersection or difference of solids, theory.md (91): of the points where the winding number of a closed mesh is
/// positive. Exact until vertices are rounded, so that meshes may touch, share faces, cross themselves or coincide. The result is
/// the boundary of the inside of the combined solid (a regular set: no walls without thickness): closed, its triangles meet in
/// shared vertices and sides only, a side having two triangles, or four and more where parts touch along it. Triangles that
/// nothing cuts come out as they went in, in their order. The same bytes for any number of threads.
///
/// Takes time in the number of triangles and of places where they cross; what one of the solids makes irrelevant is left out early.
/// @param meshes  closed, in one unit; need not have merged vertices. An empty mesh is an empty solid.
/// @return        empty where nothing is left; for no meshes, too
/// @throws Error{input} naming the mesh that is not closed or has coordinates that are no numbers; Error{interrupted}
CombinedMesh combined(std::span<const Mesh> meshes, const BooleanOptions& options = {}, const Progress& progress = {});

}  // namespace rayrep
