#pragma once

#include <algorithm>
#include <optional>
#include <vector>

#include "make/rod.h"
#include "rayrep/physics/moments.h"
#include "rays/kept_solid.h"

namespace rayrep::detail {

/// How roofs of cavities are carried.
struct Carrying {
  double angle_rad = 0;  ///< they rise at least so much from the horizontal
  double wall_mm = 1.2;
  double pillar_mm = 1.2;         ///< so thick are pillars at least
  double room_mm = 1.2;           ///< so much higher roofs that are not the inner domain's may come to lie yet
  double spacing_mm = 0.5;        ///< of the rays on which roofs are looked for
  std::optional<Moments> within;  ///< of the inner domain only where q.phi > 0; none: all of it
  std::vector<Rod> holes = {};    ///< that will be drilled: no pillar stands in their way

  /// Of pillars, with what chords of their mesh may cut off (1/60 of the wall).
  double radius_mm() const { return 0.5 * pillar_mm + wall_mm / 60; }
  /// Around their bones, which are not much thicker than a line where that may be: at most the wall.
  double clearance_mm() const { return std::min(radius_mm() / 1.05, wall_mm); }
};

/// What was found, and what is to be kept solid for it.
struct Carriers {
  std::vector<Mesh> bones;  ///< their clearance inside of their surface; closed, facing outward
  double roof_mm2 = 0;      ///< of roofs that nothing carries yet
  double surface_mm2 = 0;   ///< at least, of the cavity
};

/// Cones that stand on pillars, tip down, so that every roof that rises less than the angle lies in one of them: what is left of
/// the inner domain is self-supporting. Which ones is decided greedily, by the area that they carry over the volume that they take.
/// theory.md (98), (99)
/// @param solid  z is the direction of the print
/// @throws Error{interrupted}
Carriers carriers(const KeptSolid& solid, const Carrying& how, const Progress& progress);

}  // namespace rayrep::detail
