#pragma once

#include <optional>
#include <vector>

#include "rayrep/physics/moments.h"
#include "rays/kept_solid.h"

namespace rayrep::detail {

/// How roofs of cavities are carried.
struct Carrying {
  double angle_rad = 0;           ///< they rise at least so much from the horizontal
  double wall_mm = 1.2;           ///< pillars are a little thicker than twice that
  double spacing_mm = 0.5;        ///< of the rays on which roofs are looked for
  std::optional<Moments> within;  ///< of the inner domain only where q.phi > 0; none: all of it
};

/// What was found, and what is to be kept solid for it.
struct Carriers {
  std::vector<Mesh> bones;  ///< that far inside of their surface as the wall is thick; closed, facing outward
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
