#pragma once

#include "make/plan.h"

namespace rayrep::detail {

/// The plan of poses one of which spins: of all insides that let the others rest, the one that is the best top. theory.md (74),
/// (75)
/// @throws Error{goal} with figures, and with what each pose costs, when they contradict each other
Plan plan_top(const Mesh& solid, const PoseSpec& spec, const HollowOptions& options, const Progress& progress);

}  // namespace rayrep::detail
