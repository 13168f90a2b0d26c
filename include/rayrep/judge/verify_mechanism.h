#pragma once

#include <vector>

#include "rayrep/base/progress.h"
#include "rayrep/judge/verify.h"
#include "rayrep/physics/mechanism.h"

namespace rayrep {

/// What the bodies of a mechanism were found to be: each by itself as a print, and all together in each state.
struct MechanismVerdict {
  std::vector<Verdict> parts;       ///< of each part that is printed, in order
  std::vector<PoseVerdict> states;  ///< in order
  double mass_g = 0;                ///< of all parts
  bool pass() const;                ///< every criterion of each
};

/// Judges parts as they are delivered. Of each that is printed its surface: closed, outer_unchanged, no_islands, no_crossings, wall
/// and trapped_resin, as of every goal. Of each state, where all parts are closed, what PoseVerdict says of its one pose, with the
/// outside of all parts in their places as the hull, and the sum of their masses: bodies are taken to hold together there. Of each
/// HingeBalance "hinge_balance": centre of mass of what turns on it beside the plane through its axis, over the diagonal of its
/// box. Parts that overlap in a state count once for what they displace and twice for what they weigh; whether they do is for
/// check_motion to say.
/// @param mechanism  with the meshes as delivered
/// @param originals  of each part the surface it was made of (checked); null: "outer surface unchanged" is not judged
/// @throws Error{usage} as check(mechanism); Error{input} for a mesh without volume; Error{interrupted}
MechanismVerdict verify(const Mechanism& mechanism, const std::vector<const Mesh*>& originals, const Limits& limits = {},
                        const Progress& progress = {});

}  // namespace rayrep
