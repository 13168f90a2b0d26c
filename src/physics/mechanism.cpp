#include "rayrep/physics/mechanism.h"

#include <algorithm>
#include <cmath>

#include "rayrep/base/error.h"

namespace rayrep {
namespace {

[[noreturn]] void usage_error(const std::string& message) { throw Error(ErrorCode::usage, message); }

bool is_rigid(const Eigen::Affine3d& pose) {
  const Eigen::Matrix3d R = pose.linear();
  return pose.matrix().allFinite() && (R.transpose() * R - Eigen::Matrix3d::Identity()).norm() < 1e-9 && R.determinant() > 0;
}

}  // namespace

PoseSpec spec_of(const Mechanism& mechanism, const MechanismState& state) {
  PoseSpec spec;
  spec.poses = {state.rests};
  spec.poses.front().state = state.name;
  spec.up = state.rests.up_or(spec.up);
  spec.fluid_g_cm3 = mechanism.fluid_g_cm3;
  spec.contact_tolerance_mm = mechanism.contact_tolerance_mm;
  return spec;
}

std::string state_words(const Mechanism& mechanism, const MechanismState& state) {
  return mechanism.states.size() > 1 ? " in the state '" + state.name + "'" : std::string();
}

void check(const Mechanism& mechanism) {
  if (mechanism.parts.empty()) usage_error("There are no parts to balance.");
  if (std::none_of(mechanism.parts.begin(), mechanism.parts.end(), [](const MechanismPart& p) { return p.printed; }))
    usage_error("None of the parts is printed: there is no inside to choose.");
  if (mechanism.states.empty()) usage_error("There is no state in which it shall rest.");
  for (const MechanismState& state : mechanism.states) {
    const std::string where = "The state '" + state.name + "' ";
    if (state.poses.size() != mechanism.parts.size()) usage_error(where + "does not say where each part is.");
    if (!std::all_of(state.poses.begin(), state.poses.end(), is_rigid))
      usage_error(where + "holds a pose that is no rigid motion.");
    const Pose::Kind kind = state.rests.kind;
    if (kind != Pose::Kind::stands && kind != Pose::Kind::hangs && kind != Pose::Kind::floats)
      usage_error(where + "must stand, hang or float.");
    const Eigen::Vector3d up = state.rests.up_or(Eigen::Vector3d::UnitZ());
    for (const HingeBalance& hinge : state.hinges) {
      if (hinge.parts.empty() || *std::max_element(hinge.parts.begin(), hinge.parts.end()) >= mechanism.parts.size())
        usage_error(where + "holds a hinge on which no part turns, or one that there is not.");
      if (!(hinge.axis.cross(up).norm() > 1e-6 * hinge.axis.norm() * up.norm()))
        usage_error(where + "holds an upright hinge: what turns on it stays anyway.");
    }
  }
}

}  // namespace rayrep
