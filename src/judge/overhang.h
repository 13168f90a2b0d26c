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
  static constexpr int kMostLayers = 2000;
  Eigen::Vector3d direction = Eigen::Vector3d::UnitZ();  ///< upward on the bed; need not be a unit vector
  double bed_mm = 0;                                     ///< of the lowest point, along the unit direction
  double layer_mm = 0.2;                                 ///< at least: of tall bodies there are kMostLayers
  double angle_rad = std::numbers::pi / 4;               ///< roofs that rise less than this from the horizontal sag
};

/// What of cavities hangs in the air while they are printed. theory.md (96)
struct Overhang {
  double layer_mm = 0;      ///< of the layers that were looked at
  double surface_mm2 = 0;   ///< of the cavities
  double roof_mm2 = 0;      ///< of it, where material lies over it and it rises less than the angle
  double bridge_mm = 0;     ///< twice the farthest that a layer reaches over the void below it, of such roofs; to 2 %
  std::size_t islands = 0;  ///< pieces of a layer that begin in mid-air
  double sealed_mm3 = 0;    ///< what the cavities enclose
  /// Of what stands in a cavity from its floor to its roof, through five layers or more: the largest circle that fits where it is
  /// thinnest; none: nothing does.
  std::optional<double> pillar_mm;

  double roof_share() const;  ///< of all of their surface
  /// Of two prints together: sums, the thickest layer, the widest bridge, the thinnest pillar.
  Overhang& operator+=(const Overhang& other);
};

/// @param cavities  closed shells that face into the void, vertices merged
/// @throws Error{interrupted}
Overhang overhang(const Mesh& cavities, const PrintedUp& print, const Progress& progress = {});

/// The same of one piece of a body whose rooms were opened when it was cut: of what of its surface lies on them, theory.md (147) to
/// (149). Sealed is what its own shells enclose; of pillars nothing is said.
/// @param piece  closed, vertices merged
/// @param rooms  of the whole, facing into the void; what of them is not of this piece does not matter
/// @throws Error{interrupted}
Overhang overhang_in_piece(const Mesh& piece, const Mesh& rooms, const PrintedUp& print, const Progress& progress = {});

/// All but in which direction it is printed.
Figures roof_figures(const Overhang& overhang, const PrintedUp& print = {});
Figures figures_of(const Overhang& overhang, const PrintedUp& print);

}  // namespace rayrep::verify_detail
