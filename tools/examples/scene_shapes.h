#pragma once

#include <string>
#include <vector>

#include "rayrep/mesh/mesh.h"

namespace rayrep {

/// A part of one of the scenes of examples/scenes, in mm.
struct SceneShape {
  std::string name;  ///< file name without ".stl": that of the scene, then its own
  Mesh mesh;         ///< closed, facing outward
};

/// Of bench and table, folding boat, burr puzzle, lined cabinet and giraffe: boxes, prisms and cylinders, put together by the
/// boolean. The same bytes on every run.
std::vector<SceneShape> scene_shapes();

}  // namespace rayrep
