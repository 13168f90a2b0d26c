#pragma once

#include "rayrep/physics/moments.h"

namespace rayrep {

/// What a printer lays down in one straight move: a bar from the nozzle's path downward. Its plan is the rectangle of width w about
/// the path; its material is spread evenly.
struct Bead {
  Eigen::Vector3d from_mm = Eigen::Vector3d::Zero();  ///< of the nozzle, which runs along the top of the bead
  Eigen::Vector3d to_mm = Eigen::Vector3d::Zero();
  double volume_mm3 = 0;
  double width_mm = 0;
  double height_mm = 0;
};

/// Moments (mm^3, mm^4, mm^5) of a bead about the world origin, unit density: with d = to - from, n the unit normal of d in plan
/// and c = (from + to) / 2 - (0, 0, h / 2),
///   volume (1, c, c c^T + d d^T / 12 + n n^T w^2 / 12 + z z^T h^2 / 12).
/// A bead of no length in plan is a square column of that width. theory.md (44).
Moments bead_moments(const Bead& bead);

/// What is laid down along an arc about a vertical axis: its plan is the sector of an annulus of width w.
struct ArcBead {
  Eigen::Vector2d centre_mm = Eigen::Vector2d::Zero();
  double radius_mm = 0;
  double from_rad = 0;   ///< angle of the start, from +x towards +y
  double sweep_rad = 0;  ///< positive: counter-clockwise; not 0
  double from_z_mm = 0;  ///< of the nozzle
  double to_z_mm = 0;
  double volume_mm3 = 0;
  double width_mm = 0;  ///< at most twice the radius counts
  double height_mm = 0;
};

/// The same of an arc, in closed form: material is spread evenly over the annular sector, so that concentric beads of matching
/// widths make a disc; in a helix its height follows the angle. theory.md (44).
Moments bead_moments(const ArcBead& bead);

}  // namespace rayrep
