#pragma once

#include <optional>
#include <string>
#include <vector>

#include "rayrep/io/printed.h"
#include "rayrep/mesh/mesh.h"

namespace rayrep {

struct PlacePrintOptions {
  Eigen::Vector3d print_direction = Eigen::Vector3d::UnitZ();  ///< of the mesh, which is upward on the bed
  double turned_rad = 0;                                       ///< about that, on the bed, counter-clockwise
  /// Where on the bed the middle of the mesh's bounding box lies, as it was told to the slicer; none: found by the outlines.
  std::optional<Eigen::Vector2d> centre_mm = {};
  /// Holes may lead from the outside into it, which `mesh` does not have: layers that a hole opens, whose outlines go in through
  /// it, are told by enclosing less while they are as wide and deep, and are not compared; at most half of the print. theory.md
  /// (143)
  bool has_holes = false;
};

/// Where a mesh lies in the printer's coordinates, and how well its outlines fit there.
struct PrintPlacement {
  Eigen::Affine3d to_mesh = Eigen::Affine3d::Identity();  ///< from the printer's coordinates
  Moments s = Moments::Zero();  ///< of the body as it is laid down: unit density, in the frame of the mesh (mm^3, mm^4, mm^5)
  std::size_t layers = 0;       ///< that were compared
  std::size_t opened = 0;       ///< that were not, as holes open them
  double area_error = 0;        ///< sum of the layers' differences of area over the sum of the mesh's areas
  double size_error_mm = 0;     ///< median difference of the layers' widths and depths
  double centre_error_mm = 0;   ///< of three quarters of the layers at most: distance of their centroids, once placed
  std::vector<std::string> notes;
};

/// Finds out where in a print the mesh is that was sliced: its lowest point on the print's lowest layer, and in plan where the
/// centroids of the layers' outlines (outermost loops, filled) lie over those of the mesh's sections: by the median of all layers
/// but the first, weighted with their areas. theory.md (44)
/// @param mesh  what was sliced or has the same outside; closed
/// @throws Error{input} with figures when the outlines are not those of the mesh (turned: by how much, if that can be seen; scaled;
///         another one), or when the print has no outlines and no centre is given
PrintPlacement place_print(const Printed& printed, const Mesh& mesh, const PlacePrintOptions& options = {});

}  // namespace rayrep
