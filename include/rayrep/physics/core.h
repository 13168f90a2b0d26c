#pragma once

#include <optional>
#include <string>

#include "rayrep/mesh/delivery.h"
#include "rayrep/physics/moments.h"

namespace rayrep {

/// A heavy material that takes a part of the cavity (Spin-It, section 7): cast, cut or poured, not printed.
struct Core {
  double density_g_cm3 = 0;          ///< of what is poured: with the air in it; 0: there is none
  std::string material;              ///< its name; empty: a density was given
  std::optional<double> volume_cm3;  ///< of which there is no more
  /// Printed between the core and the rest of the cavity, which is void. 0: nothing, the core has to hold by itself. None: the wall
  /// for what is poured or scarce, else 0.
  std::optional<double> partition_mm;

  double clearance_mm = 0.1;  ///< of the wall to a core that is put into the cavity; what has a room of its own fills it

  bool wanted() const { return density_g_cm3 > 0; }
  bool poured() const;
  double partition(double wall_mm) const;
};

/// Heavy balls, put into pockets of the print.
struct Balls {
  int count = 0;
  double diameter_mm = 6;
  double density_g_cm3 = 7.85;
  double clearance_mm = 0.1;  ///< all around, in their pocket

  bool wanted() const { return count > 0; }
  double pocket_radius_mm() const { return 0.5 * diameter_mm + clearance_mm; }
};

/// A body inside that is not printed, and the room that is left for it.
struct FixedBody {
  Part part;       ///< its role is insert
  Mesh room = {};  ///< facing outward; none: the part's own mesh
};

/// Sum of the moments of what is put into the body, each times its density over `density_g_cm3`.
Moments insert_moments(const Delivery& delivery, double density_g_cm3);

}  // namespace rayrep
