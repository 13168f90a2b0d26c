#pragma once

#include <string>
#include <vector>

#include "rayrep/shape/deform.h"

namespace rayrep::detail {

/// Of each vertex: 0 in any of the regions, 1 from `blend_mm` beside them on, smooth in between.
std::vector<double> freedom_beside(const std::vector<Region3>& fixed, const Mesh& mesh, double blend_mm);

}  // namespace rayrep::detail
