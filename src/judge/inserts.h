#pragma once

#include "rayrep/judge/verify.h"
#include "rayrep/mesh/delivery.h"

namespace rayrep::verify_detail {

/// Whether what is put into a body has room in it: adds the criterion inserts_fit, what is assumed, and the figures `inserts`.
/// @param solid  the printed body, its sparse regions taken as empty
/// @param hull   its outside, closed
void judge_inserts(const Delivery& delivered, const Mesh& solid, const Mesh& hull, const Progress& progress, Verdict& verdict);

}  // namespace rayrep::verify_detail
