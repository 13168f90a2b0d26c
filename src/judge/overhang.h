#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <numbers>
#include <optional>

#include "rayrep/base/figure.h"
#include "rayrep/base/progress.h"
#include "rayrep/mesh/mesh.h"

namespace rayrep::verify_detail {

/// How a print grows.
struct PrintedUp {
  Eigen::Vector3d direction = Eigen::Vector3d::UnitZ();  ///< upward on the bed; need not be a unit vector
  double bed_mm = 0;                                     ///< of the lowest point, along the unit direction
  double layer_mm = 0.2;
  double angle_rad = std::numbers::pi / 4;  ///< roofs that rise less than this from the horizontal sag
};

/// What of cavities hangs in the air while they are printed. theory.md (96)
struct Overhang {
  double roof_mm2 = 0;      ///< of their surface, where material lies over it and it rises less than the angle
  double roof_share = 0;    ///< of all of their surface
  double bridge_mm = 0;     ///< twice the farthest that a layer reaches over the void below it, of such roofs; to 2 %
  std::size_t islands = 0;  ///< pieces of a layer that begin in mid-air
  double sealed_mm3 = 0;    ///< what the cavities enclose
  /// Of what stands in a cavity from its floor to its roof, through five layers or more: the largest circle that fits where it is
  /// thinnest; none: nothing does.
  std::optional<double> pillar_mm;
};

/// @param cavities  closed shells that face into the void, vertices merged
/// @throws Error{interrupted}
Overhang overhang(const Mesh& cavities, const PrintedUp& print, const Progress& progress = {});

Figures figures_of(const Overhang& overhang, const PrintedUp& print);

}  // namespace rayrep::verify_detail
