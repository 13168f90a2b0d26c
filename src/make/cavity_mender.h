#pragma once

#include <cstddef>
#include <functional>
#include <vector>

#include "rayrep/make/cavity.h"
#include "rayrep/mesh/mesh.h"
#include "rayrep/mesh/surface_query.h"

namespace rayrep::detail {

/// Sees to it that the triangles between a cavity's vertices keep the wall too, and that none cross as delivered. theory.md (16f)
class CavityMender {
public:
  /// Keeps references to all.
  /// @param spacing_mm  of the grid on which the cavity was meshed
  CavityMender(const SurfaceQuery& surface, const CavityOptions& options, double spacing_mm)
      : surface_(surface), options_(options), spacing_mm_(spacing_mm) {}

  /// Moves vertices of a mesh where that is needed, as little as it takes.
  /// @param moved  for each vertex, whether anything is to be looked at around it
  /// @returns triangles of the whole mesh that cross others as delivered for all that, ascending
  std::vector<std::size_t> mend(Mesh& mesh, std::vector<char> moved) const;

private:
  void thicken(Mesh& mesh, std::vector<char>& moved) const;
  std::vector<std::size_t> crossing(const Mesh& mesh) const;
  std::vector<std::size_t> crossing_near(const Mesh& mesh, const std::vector<char>& moved) const;

  const SurfaceQuery& surface_;
  const CavityOptions& options_;
  double spacing_mm_;
};

}  // namespace rayrep::detail
