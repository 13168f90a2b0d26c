#pragma once

#include <array>
#include <optional>
#include <string>
#include <vector>

#include "rayrep/physics/moments.h"

namespace rayrep {

/// Numbers wanted of a rigid body, in the axes of its mesh; those absent are free. Indexed by MomentIndex:
///   M1               mass, g
///   MX, MY, MZ       centre of mass, mm
///   MXX, MYY, MZZ    moments of inertia Ixx, Iyy, Izz about the centre of mass, g mm^2
///   MXY, MYZ, MXZ    entries Ixy, Iyz, Ixz of that tensor, g mm^2: the negative products of inertia, as in URDF and MJCF
using InertialTargets = std::array<std::optional<double>, 10>;

/// "mass", "com_x", ... "ixx", ... "ixz".
const char* inertial_name(MomentIndex number);

/// The same ten numbers of a body.
double inertial_number(const MassProperties& body, MomentIndex number);

/// One of the ten numbers, to be made as small as it goes, or as large.
struct InertialWish {
  MomentIndex number = M1;
  bool largest = false;
};

/// The coordinates of the centre of mass without which an entry of the inertia tensor is not linear in the moments: for Ixx y and
/// z, for Ixy x or y; in words. Empty when those that are wanted will do.
std::string missing_for(MomentIndex number, const InertialTargets& targets);

/// One wanted number beside what a body has.
struct InertialDeviation {
  MomentIndex number = M1;
  double wanted = 0;  ///< unit of InertialTargets
  double found = 0;
  /// |found - wanted| relative to: the wanted one (mass, moments of inertia); `length_mm` (centre of mass); the geometric mean of
  /// the body's own moments of inertia about the two axes (products)
  double relative = 0;
};

/// Every number that is wanted, in the order of MomentIndex.
/// @param length_mm  the size of the body, such as the diagonal of its bounding box
std::vector<InertialDeviation> inertial_deviations(const InertialTargets& wanted, const MassProperties& body, double length_mm);

/// Whether some body has this inertia tensor: positive definite, and no principal moment larger than the sum of the others
/// (to 1e-12 of the largest).
bool is_physical(const Eigen::Matrix3d& inertia);

/// What a simulator for robots or games wants to know of a body, as one XML element without a prolog: kg, m and kg m^2, tensor
/// about the centre of mass in the axes of the mesh, numbers with all their digits.
///   URDF: <inertial> with <origin>, <mass> and <inertia>, wiki.ros.org/urdf/XML/link
///   MJCF: <inertial pos mass fullinertia>, mujoco.readthedocs.io/en/stable/XMLreference.html#body-inertial
/// @throws Error{input} for mass properties that no body has, see is_physical
std::string urdf_inertial(const MassProperties& body);
std::string mjcf_inertial(const MassProperties& body);

}  // namespace rayrep
