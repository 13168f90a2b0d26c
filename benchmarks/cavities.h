#pragma once

#include <vector>

#include "record.h"
#include "tables.h"

namespace rayrep::bench {

/// How light and crisp cavities are: the examples and all closed meshes there are at 80 mm, at N = 100 and 200. Of what is
/// delivered: triangles, how far crease corners are from the exact curve, the smallest wall, crossing triangles of the cavity.
std::vector<Record> measure_cavities(const TableOptions& options);

}  // namespace rayrep::bench
