#pragma once

#include <vector>

#include "rayrep/mesh/mesh.h"

namespace rayrep {

/// Some triangles of a mesh, with the vertices that they use, in the order of those.
Mesh part(const Mesh& mesh, const std::vector<int>& triangles);

}  // namespace rayrep
