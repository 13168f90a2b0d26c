#pragma once

#include <Eigen/Core>
#include <vector>

namespace rayrep {

/// Holes through the wall, by which a cavity gives up what a printer leaves in it.
struct Drains {
  enum class Where {
    none,
    found,  ///< by a maker: one for each cavity where it drains, and what lets air in
    given   ///< nearest to `points_mm`
  };
  Where where = Where::none;
  std::vector<Eigen::Vector3d> points_mm = {};  ///< in the frame of the mesh
  double diameter_mm = 4;
  bool plugged = false;       ///< flush, by a plug that is printed beside
  double clearance_mm = 0.1;  ///< all around a plug

  bool wanted() const { return where != Where::none; }
};

}  // namespace rayrep
