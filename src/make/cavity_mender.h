#pragma once

#include <cstddef>
#include <vector>

#include "rayrep/make/cavity.h"
#include "rayrep/mesh/mesh.h"
#include "rayrep/mesh/surface_query.h"

namespace rayrep::detail {

/// Sees to it that the triangles between a cavity's vertices keep the wall too, and that none cross as delivered. theory.md (16f)
class CavityMender {
public:
  /// Keeps references to both.
  CavityMender(const SurfaceQuery& surface, const CavityOptions& options) : surface_(surface), options_(options) {}

  /// Moves vertices of a mesh where that is needed, as little as it takes.
  /// @param moved  for each vertex, whether it is new: triangles without such a corner are taken to be sound
  /// @param within  for each vertex, whether walls are seen to at it: what is around may be left for later; empty: everywhere
  /// @returns triangles that cross others as delivered for all that, ascending
  std::vector<std::size_t> mend(Mesh& mesh, std::vector<char> moved, const std::vector<char>& within = {}) const;

  /// Triangles that cross others as delivered, in the box around all triangles with a corner that was moved; ascending.
  std::vector<std::size_t> crossing(const Mesh& mesh, const std::vector<char>& moved) const;

private:
  /// How triangles that cross are relaxed.
  struct Parting {
    int rings;    ///< of vertices around theirs
    double most;  ///< how far a vertex goes: at most as many times as it is to its nearest neighbour
  };

  std::vector<std::size_t> part(Mesh& mesh, const std::vector<std::size_t>& crosses, const Parting& how,
                                const std::vector<char>& within) const;
  void part_by_little(Mesh& mesh, std::vector<std::size_t>& crosses) const;
  /// Marks as moved what it moves.
  void thicken(Mesh& mesh, std::vector<char>& moved, const std::vector<char>& within) const;
  void take_back(Mesh& mesh, const std::vector<char>& moved, const std::vector<Eigen::Vector3d>& before,
                 std::vector<std::size_t>& crosses) const;

  const SurfaceQuery& surface_;
  const CavityOptions& options_;
};

}  // namespace rayrep::detail
