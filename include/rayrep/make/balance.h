#pragma once

#include <optional>
#include <string>
#include <vector>

#include "rayrep/base/figure.h"
#include "rayrep/base/progress.h"
#include "rayrep/make/hollow.h"
#include "rayrep/mesh/delivery.h"
#include "rayrep/physics/mechanism.h"

namespace rayrep {

/// A printed part of a mechanism, hollowed.
struct BalancedPart {
  std::size_t part = 0;  ///< of the mechanism
  Delivery delivery;     ///< in the part's frame
  std::size_t cavities = 0;
  Moments q = Moments::Zero();  ///< in the frame `to_working` leads to: material is where q.phi < 0
  Eigen::Affine3d to_working = Eigen::Affine3d::Identity();
};

/// The insides of a mechanism, and how they came about.
struct BalanceResult {
  std::vector<BalancedPart> parts;  ///< that are printed, in order
  double mass_g = 0;                ///< of all parts
  std::vector<double>
      tipping_angles_rad;  ///< of each state: the smallest, of the meshes as they are; infinite where it does not stand
  std::optional<double> least_tip_rad;  ///< of the states that stand: what was asked for or found
  std::optional<double> tip_bound_rad;  ///< proven: no insides on these rays stand more safely in all states; of a search for it
  double duality_gap = 0;               ///< of the last pass: (g.s - bound) over its size
  int passes = 0;
  double as_built_error = 0;  ///< largest miss of what the states ask for, over mass and diagonal
  std::vector<std::string> proof;
};

/// Chooses the insides of all printed parts at once, so that the thing rests in each of its states. Every state asks for what is
/// linear in the moments of the parts (theory.md (117)), so that solve_parts finds the insides: a plane for each part. Of things
/// that stand the smallest tipping angle of all states is made as large as it can be, then the mass as small as that allows; of
/// those that float the mass is searched for the largest of the smallest metacentric heights.
/// @param options  as of hollow; of them resolution, passes, as_stored and min_cavity_mm3 count
/// @throws Error{usage} as check(mechanism); Error{goal} that names the state that cannot be met, or those that stand against each
/// other;
///         Error{interrupted}
/// A result is not yet a success: that is for verify to say.
BalanceResult balance(const Mechanism& mechanism, const HollowOptions& options = {}, const Progress& progress = {});

}  // namespace rayrep
