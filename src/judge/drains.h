#pragma once

#include "judge/verify_detail.h"
#include "rayrep/mesh/delivery.h"

namespace rayrep::verify_detail {

/// What is judged of holes and plugs.
struct Drained {
  const Delivery& delivered;
  const Surface& surface;  ///< of what is solid, closed, with its holes
  const Mesh& original;
  const Spec& spec;
};

/// What holes and plugs do: adds the figures `holes`, `trapped_mm3`, `trapped_share`, `sealed_cavities`, `plugs` and
/// `plug_clearance_mm` and the criteria
///   drains          only where holes were to be found: share of the room of all cavities whose content stays when the body is held
///                   as it is printed (Print::direction): 0.01. theory.md (102)
///   trapped_resin   g, of a Print with a liquid that is not drained: what stays; 0.01 of what the cavities hold
///   plugged         holes without a plug, of a body that is to have them: 0
///   plug_clearance  smallest distance between plugs and body, over Drains::clearance_mm: 0.9
///   plugs_flush     mm by which a plug stands out of the outside: 0.1
void judge_drains(const Drained& what, const Progress& progress, Verdict& verdict);

/// What touches water and ground: with plugs, which are flush, the original's surface, if that was found there.
const Mesh& outside_with_plugs(const Drained& what, const Verdict& verdict);

/// Moments of plugs and of resin that stays, unit density of the print.
Moments closed_in(const Drained& what);

}  // namespace rayrep::verify_detail
