#pragma once

#include "io/mesh_io_detail.h"
#include "rayrep/io/printed.h"

namespace rayrep::detail {

/// What the bytes of a G-code file lay down, see read_printed. @throws Error{input}
Printed read_gcode(const FileBytes& file, const PrintedOptions& options);

}  // namespace rayrep::detail
