#pragma once

#include <Eigen/Geometry>
#include <vector>

#include "motion/solid_body.h"
#include "rayrep/motion/scene.h"

namespace rayrep {

/// What a body sweeps in all transitions and states of a scene, seen from a part, as a distance. theory.md (113)
class Sweep {
public:
  /// @param seen_in      the points that will be asked for, in the coordinates of the part's mesh
  /// @param accuracy_mm  of distances, either way
  Sweep(const Scene& scene, std::size_t part, std::size_t by, const Eigen::AlignedBox3d& seen_in, double accuracy_mm);

  double accuracy_mm() const { return accuracy_mm_; }

  /// Distance of p from the sweep, in it minus how deep it is in the body at some time; where it is below `enough_mm` no more than
  /// that, where it is above `cap_mm` that.
  /// @param hint  a piece of the way that is likely to be near; becomes the nearest one
  double distance_mm(const Eigen::Vector3d& p, double enough_mm, double cap_mm, std::size_t& hint) const;

private:
  /// Part of the way, on which points of the part move straight in the body's frame within the accuracy.
  struct Piece {
    Eigen::Isometry3d from, to;  ///< of the part in the body's frame
  };

  void add_transition(const Scene& scene, const Transition& transition, std::size_t part, std::size_t by);
  double piece_distance(const Piece& piece, const Eigen::Vector3d& p, double cap_mm, double deep_mm) const;

  SolidBody body_;
  Eigen::AlignedBox3d seen_in_;
  double accuracy_mm_;
  std::vector<Piece> pieces_;
};

}  // namespace rayrep
