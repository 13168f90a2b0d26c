#pragma once

#include <vector>

#include "rayrep/mesh/mesh.h"

namespace rayrep {

/// One piece of what is written: a closed mesh of one density.
struct Part {
  enum class Role {
    body,      ///< what is printed of the material asked for
    insert,    ///< of another density, put into the body
    plug,      ///< closes an opening of the body
    modifier,  ///< not material: where a slicer prints otherwise
  };
  Mesh mesh;
  Role role = Role::body;
  double density_g_cm3 = 1.24;
};

/// What a maker gives out: what is written, and what a judge is told of.
struct Delivery {
  std::vector<Part> parts;

  /// All parts of that role in one mesh.
  Mesh mesh_of(Part::Role role) const;
  Mesh body() const { return mesh_of(Part::Role::body); }
};

}  // namespace rayrep
