#pragma once

#include <Eigen/Core>
#include <vector>

namespace rayrep {

/// Into pieces that are printed by themselves, lying on the cut, and joined by pins.
struct Cut {
  enum class Where {
    none,
    found,  ///< by a maker: as few planes as open every cavity
    given
  };
  /// The points p with normal . p = offset.
  struct Plane {
    Eigen::Vector3d normal = Eigen::Vector3d::UnitZ();  ///< in the frame of the mesh, a unit vector
    double offset_mm = 0;
  };
  Where where = Where::none;
  std::vector<Plane> planes = {};  ///< a maker fills in what it found
  double pin_diameter_mm = 1.75;   ///< of what is put into the holes on both sides: filament, a dowel
  double clearance_mm = 0.1;       ///< all around a pin in its hole

  bool wanted() const { return where != Where::none; }
};

/// What the halves of a yo-yo turn with, and the room of its string.
struct Axle {
  enum class Kind { none, m4, rod_8mm, bearing_608 };
  Kind kind = Kind::none;
  double gap_mm = 0;  ///< between the halves, for the string; 0: it is in one piece
};

}  // namespace rayrep
