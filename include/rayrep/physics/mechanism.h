#pragma once

#include <Eigen/Geometry>
#include <optional>
#include <string>
#include <vector>

#include "rayrep/mesh/mesh.h"
#include "rayrep/physics/spec.h"

namespace rayrep {

/// One of several bodies that make up a thing.
struct MechanismPart {
  std::string name;
  Mesh mesh;  ///< closed, facing outward, in a frame of its own
  Print print;
  bool printed = true;  ///< its inside may be chosen; else it is solid, of Print::density_g_cm3
};

/// What turns on a hinge and shall stay where it is left: the centre of mass of these parts lies in the vertical plane through the
/// axis.
struct HingeBalance {
  Eigen::Vector3d point_mm = Eigen::Vector3d::Zero();  ///< of the axis, in the frame of the state
  Eigen::Vector3d axis = Eigen::Vector3d::UnitX();     ///< need not be a unit vector; not upright
  std::vector<std::size_t> parts;                      ///< that turn together
};

/// A state in which the thing can be left.
struct MechanismState {
  std::string name;
  std::vector<Eigen::Affine3d> poses;  ///< of each part: from its frame to that of the state; rigid motions
  /// How it rests, in the frame of the state: stands, hangs or floats, all of it together.
  Pose rests = {.up = Eigen::Vector3d::UnitZ()};
  std::vector<HingeBalance> hinges = {};
};

/// A thing of several bodies that shall rest in every state it can be left in. Bodies touch or are joined (a hinge, a lock): in a
/// state they move as one.
struct Mechanism {
  std::vector<MechanismPart> parts;
  std::vector<MechanismState> states;
  double fluid_g_cm3 = 1.0;
  std::optional<double> contact_tolerance_mm;  ///< as in StandSpec
  /// Of a maker: it stands at least so safely, and is as light as that allows; none: as safely as it can, or where it floats in
  /// some state PoseSpec::kUsualTip_deg.
  std::optional<double> least_tip_deg;
};

/// A state as it is judged: all bodies together, as one that rests so.
PoseSpec spec_of(const Mechanism& mechanism, const MechanismState& state);

/// " in the state 'open'", or nothing where there is only one.
std::string state_words(const Mechanism& mechanism, const MechanismState& state);

/// @throws Error{usage} for no parts, none that is printed, no states, a state without a pose for each part or with one that is no
///         rigid motion, or a state that neither stands, hangs nor floats
void check(const Mechanism& mechanism);

}  // namespace rayrep
