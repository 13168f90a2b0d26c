#pragma once

#include <Eigen/Core>

#include "rayrep/base/progress.h"
#include "rayrep/mesh/mesh.h"

namespace rayrep {

/// Through which point a body shall spin. Along its up direction, unless that is searched too: SpinSpec::max_tilt_rad.
struct SpinAxis {
  enum class Through {
    lowest_point,    ///< the lowest point of the mesh: the middle of all points at that height
    centre_of_mass,  ///< of the solid; contact where the axis leaves the mesh below
    point,           ///< `point_mm`
    best             ///< searched: where a top spins best; contact where the axis leaves the mesh below
  };
  Through through = Through::lowest_point;
  /// In the frame of the mesh that was given: the contact point of a top, or any point of the axis with `leaves_below`.
  Eigen::Vector3d point_mm = Eigen::Vector3d::Zero();
  bool leaves_below = false;  ///< contact where the axis through `point_mm` leaves the mesh below
};

/// The contact point of a top, in the frame of `mesh`: the rule by which a top is made and judged. `lowest_point` and
/// `leaves_below` see the outside only; `centre_of_mass` is that of `mesh` as it is: give the solid, not what has been hollowed
/// (see outer_hull).
/// @param mesh  closed when `axis` goes through the centre of mass (not checked)
/// @param up    need not be a unit vector
/// @throws Error{usage} when the vertical through SpinAxis::point_mm does not meet the mesh; Error{interrupted}
Eigen::Vector3d contact_point(const Mesh& mesh, const SpinAxis& axis, const Eigen::Vector3d& up, const Progress& progress = {});

}  // namespace rayrep
