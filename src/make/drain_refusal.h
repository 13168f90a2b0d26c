#pragma once

#include "make/plan.h"
#include "rayrep/base/error.h"
#include "rayrep/base/progress.h"

namespace rayrep::detail {

/// A body with cones that its holes cannot drain.
struct Undrained {
  const Mesh& solid;
  const Spec& spec;              ///< as asked for
  const HollowOptions& options;  ///< as given
  const Plan& plan;              ///< with its cones
  const HollowOptions& with_cones;
};

/// What is told of it: it is made with either alone and with plugs, and what came of that is said. Takes as
/// long as up to three more bodies. theory.md (155)
/// @param why  it was refused
Error drain_refusal(const Undrained& body, const Error& why, const Progress& progress);

}  // namespace rayrep::detail
