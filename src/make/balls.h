#pragma once

#include "rayrep/make/hollow.h"

namespace rayrep::detail {

/// Places the balls of the spec one after the other where they do most, exchanges them as long as that helps, and hollows the body
/// with them fixed in it. theory.md (50)
HollowResult hollow_with_balls(const Mesh& solid, const Spec& spec, const HollowOptions& options, const Progress& progress);

}  // namespace rayrep::detail
