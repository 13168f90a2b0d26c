#pragma once

#include "rayrep/base/progress.h"
#include "rayrep/mesh/mesh.h"

namespace rayrep {

/// The bodies of a closed mesh with merged vertices: components that cross, touch or lie in one another are one body, as in the
/// boundary of their union. Exact where triangles meet. What lies in a sealed cavity counts as of the body around it.
/// @throws Error{interrupted}
Components bodies_of(const Mesh& mesh, const Progress& progress = {});

}  // namespace rayrep
