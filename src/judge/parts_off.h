#pragma once

// What a thing of several parts does when each print comes out a little heavier or lighter than its mesh.

#include <Eigen/Core>
#include <string>
#include <vector>

#include "judge/verify_detail.h"
#include "rayrep/physics/mechanism.h"

namespace rayrep::verify_detail {

/// A part where it is in a state.
struct PlacedPart {
  std::string name;
  double mass_g = 0;
  Eigen::Vector3d centre_mm = Eigen::Vector3d::Zero();
  bool printed = true;  ///< else it weighs what is said
};

/// What every part has of a fraction: how much of the numerator and of the denominator, and by how much both may be off, relative.
struct Share {
  double numerator = 0, denominator = 0, off = 0;
};

/// The largest of sum (1 + e_j) numerator_j over sum (1 + e_j) denominator_j with |e_j| <= off_j, and the e_j: theory.md (127). The
/// denominator has to be positive for all of these.
struct Largest {
  double value = 0;
  std::vector<double> e;
};
Largest largest_fraction(const std::vector<Share>& shares);

/// A state that was judged.
struct PlacedState {
  const std::vector<PlacedPart>& parts;
  const PrintInHull& print;
  const MechanismState& state;
  const Limits& limits;
};

/// Tells what the state comes to with every printed part up to Limits::too_heavy[0] heavier or lighter, as it is worst: in the last
/// sentence of the meaning, a note where it does not rest then, and the figure "with_parts_off". Of one part alone, which changes
/// no centre, and of a state that does not rest in any case, nothing.
void judge_parts_off(const PlacedState& placed, PoseVerdict& verdict);

/// How far the centre of mass of what turns on a hinge comes beside the upright plane through it, mm, as far as that changes.
double hinge_off_mm(const PlacedState& placed, const HingeBalance& hinge);

}  // namespace rayrep::verify_detail
