#pragma once

#include <string>

#include "rayrep/mesh/delivery.h"
#include "rayrep/report/report.h"

namespace rayrep {

/// A page of one file that needs nothing else, no network either: the verdict, all that to_json and to_text tell, and the bodies to
/// turn and to cut in 3D. The same bytes for the same report.
///
/// Coordinates are rounded to 1/65535 of the box around all bodies along each axis. What is shown is coarser where cavities, sparse
/// regions and what is put in have more than 300,000 triangles, and where the outer surface has more than 2,000,000. The page says
/// both.
/// @param delivered  what was judged: bodies with their cavities, modifiers, inserts
std::string to_html(const RunReport& report, const Delivery& delivered);

/// The same of a mesh that was looked at.
std::string to_html(const Inspection& inspection, const Delivery& inspected);

}  // namespace rayrep
