#pragma once

#include <cstddef>
#include <functional>
#include <vector>

#include "rayrep/base/progress.h"
#include "rayrep/mesh/mesh.h"

namespace rayrep {

struct DecimateOptions {
  double chord_error_mm = 0.02;
  /// What becomes of a mesh when it is delivered, triangle by triangle: no triangles may cross then. Empty: coordinates are rounded
  /// to float32.
  std::function<Mesh(const Mesh&)> as_delivered;
};

struct DecimatedMesh {
  Mesh mesh;
  std::vector<int> kept;     ///< of each vertex its number in the given mesh, ascending: it lies where it did
  std::size_t crossing = 0;  ///< triangles that meet another one, or have no area, as delivered; see below
};

/// A closed mesh with fewer triangles, by collapsing edges onto one of their ends, the flattest first. theory.md (81)-(83)
///
/// Within the chord error are: the distance of each vertex that is gone from one triangle of those that came of what was around it,
/// and the distance of the middle of each new edge from the given surface. What lies between is not checked; it follows where the
/// surface is smooth, at creases it was found within three times the chord error. Creases and corners stay, as leaving them costs
/// more than it. The surface stays closed, oriented and of the same genus; what is not an edge of two triangles stays as it is, and
/// all around it. Triangles turn by at most 60 degrees at a time, and become slender (smallest height below 1/20 of the longest
/// side) only where one was before.
///
/// Triangles that cross as delivered, or have no area then, are made anew with less of a chord error around them, at last with
/// none. What crosses for all that crosses triangles that did so in the given mesh.
/// @throws Error{interrupted}
DecimatedMesh decimated(const Mesh& mesh, const DecimateOptions& options = {}, const Progress& progress = {});

}  // namespace rayrep
