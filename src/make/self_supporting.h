#pragma once

#include "make/plan.h"

namespace rayrep::detail {

/// As hollow, for a print that asks for self-supporting cavities: the inner domain is slimmed by carriers (make/carriers.h) and the
/// goal solved on what is left. Where the cut surface is a roof itself (spin, some targets) that is done over and over until its
/// roofs are carried, too. A spin whose print says no direction is also tried lying on its side, and made as it costs less.
/// theory.md (100)
/// @throws Error{usage} with infill, cores, balls or another solver; Error{goal} with figures when nothing is left that does it
HollowResult hollow_self_supporting(const Mesh& solid, const Spec& spec, const HollowOptions& options, const Progress& progress);

/// The plan of that alone. @throws likewise
Plan plan_self_supporting(const Mesh& solid, const Spec& spec, const HollowOptions& options, const Progress& progress);

}  // namespace rayrep::detail
