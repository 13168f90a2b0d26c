#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <vector>

#include "rayrep/base/progress.h"
#include "rayrep/mesh/mesh.h"

namespace rayrep {

/// What bounds nothing, and the mesh without it.
struct SheetsDropped {
  Mesh mesh;
  std::size_t strays = 0;  ///< flat sheets that hang on nothing
  std::size_t fins = 0;    ///< sheets that hang on edges of the surface
  std::size_t walls = 0;   ///< sheets inside the material
  std::size_t triangles = 0;
  double area = 0;
  Eigen::Vector3d first = Eigen::Vector3d::Zero();  ///< where the first of them was
  std::vector<Eigen::Vector3d> inside;              ///< of each wall a point: material has to be there in the end
};

struct SheetOptions {
  double flat = 0;          ///< what deviates less from a plane is flat
  bool all_strays = false;  ///< also of those that are no plane together
};

/// Drops sheets (patches of triangles joined over edges of two) without which the surface is balanced at all edges around them:
/// - inside the corner of material that the two others at an edge of three form, at most of its length: an internal wall;
/// - flat ones at edges of more than two triangles;
/// - flat ones that hang on nothing, unless several near each other are no plane together, or more than three make up more than a
///   tenth of the surface: then they may be what is left of a body.
/// Patches that go straight on across others count as one.
/// @param mesh  vertices merged, neighbours oriented
/// @throws Error{interrupted}
SheetsDropped without_sheets(const Mesh& mesh, const SheetOptions& options, const Progress& progress);

}  // namespace rayrep
