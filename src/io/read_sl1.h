#pragma once

#include "io/mesh_io_detail.h"
#include "rayrep/io/printed.h"

namespace rayrep::detail {

/// What the bytes of an SL1 archive cure, see read_printed. @throws Error{input}
Printed read_sl1(const FileBytes& file, const PrintedOptions& options);

}  // namespace rayrep::detail
