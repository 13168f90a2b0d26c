#pragma once

#include <vector>

#include "rayrep/base/progress.h"
#include "rayrep/mesh/mesh.h"
#include "rayrep/physics/cut.h"

namespace rayrep::detail {

/// The holes for a pin: one in each side of a cut, as deep.
struct PinHole {
  double radius_mm = 1;
  double depth_mm = 5;
  double wall_mm = 1.2;  ///< of material all around
};

/// Where in a plane there is room for pins: up to three places, as far apart as there is, ascending in nothing.
/// @param mesh    closed, vertices merged
/// @param planes  of all cuts: of the others it stays clear
std::vector<Eigen::Vector3d> pin_places(const Mesh& mesh, const std::vector<Cut::Plane>& planes, std::size_t plane,
                                        const PinHole& hole, const Progress& progress);

/// What planes are looked for.
struct CutWishes {
  std::vector<Eigen::Vector3d> directions;  ///< that are natural to the body: its frame's, its up
  PinHole hole;
};

/// As few planes as open every cavity of a mesh, the best of those: theory.md (105), (106).
/// @param mesh  closed, vertices merged; what faces inward is a cavity
/// @throws Error{goal} where none of the planes that are looked at open what is there
std::vector<Cut::Plane> cut_planes(const Mesh& mesh, const CutWishes& wishes, const Progress& progress);

/// The same plane, moved by no more than 0.02 mm, such that it passes no vertex closely.
Cut::Plane clear_of_vertices(const Mesh& mesh, Cut::Plane plane);

}  // namespace rayrep::detail
