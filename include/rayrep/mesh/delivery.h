#pragma once

#include <Eigen/Geometry>
#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "rayrep/mesh/mesh.h"

namespace rayrep {

/// What a slicer is told of the room inside a modifier, and what comes of it.
struct SparseInfill {
  double percent = 0;   ///< as the slicer calls it
  std::string pattern;  ///< in PrusaSlicer's words: "gyroid"; empty: that of the user's profile
  double share = 0;     ///< of the room that material takes, 0 to 1
};

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
  std::optional<SparseInfill> infill = {};  ///< of a modifier
  std::string name = {};                    ///< of a piece of the body that is printed by itself; empty: it is all in one piece
  /// Of such a piece: from where it is in the whole to how it lies on the bed, the lowest point at z = 0.
  Eigen::Affine3d to_bed = Eigen::Affine3d::Identity();
};

/// What a maker gives out: what is written, and what a judge is told of.
struct Delivery {
  std::vector<Part> parts;
  /// Heights above the bed at which the print is paused to put something in, ascending.
  std::vector<double> pauses_mm = {};
  /// A picture of it for viewers of files, which 3MF holds; empty: none.
  std::string thumbnail_png = {};

  /// All parts of that role in one mesh.
  Mesh mesh_of(Part::Role role) const;
  Mesh body() const { return mesh_of(Part::Role::body); }
  std::size_t triangles() const;  ///< of all parts
  /// Parts of the body are filled sparsely.
  bool has_infill() const;
  /// Something is put into the body that is not printed.
  bool has_inserts() const;
  /// What is solid: the body without what is filled sparsely, whose surface is turned inward.
  Mesh solid() const;
};

}  // namespace rayrep
