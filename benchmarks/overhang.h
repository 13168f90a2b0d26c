#pragma once

#include <vector>

#include "record.h"
#include "tables.h"

namespace rayrep::bench {

/// Self-supporting cavities (45 degrees): ten bodies, each printed along z, y and (1, 0, 1), at N = 100. Of what is delivered: the
/// share of the cavities' surface that rises less than 43 degrees, what hangs in the air, the widest bridge, the thinnest pillar;
/// what it costs of the goal and of the room inside.
std::vector<Record> measure_overhang(const TableOptions& options);

/// The same ten bodies and all closed ones of options.meshes (float, 80 mm long), without and with self-supporting cavities, at
/// N = 100: roofs flatter than 45 degrees, widest bridge, islands, triangles, seconds, and the figure that the goal is about. Both
/// are judged along the direction in which the self-supporting one is printed.
std::vector<Record> measure_roofs(const TableOptions& options);

}  // namespace rayrep::bench
