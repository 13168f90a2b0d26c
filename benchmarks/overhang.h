#pragma once

#include <vector>

#include "record.h"
#include "tables.h"

namespace rayrep::bench {

/// Self-supporting cavities (45 degrees): ten bodies, each printed along z, y and (1, 0, 1), at N = 100. Of what is delivered: the
/// share of the cavities' surface that rises less than 43 degrees, what hangs in the air, the widest bridge, the thinnest pillar;
/// what it costs of the goal and of the room inside.
std::vector<Record> measure_overhang(const TableOptions& options);

}  // namespace rayrep::bench
