#pragma once

#include "rayrep/judge/verify.h"
#include "rayrep/mesh/delivery.h"
#include "rayrep/mesh/surface_query.h"

namespace rayrep::verify_detail {

/// Whether what is put into a body has room in it: adds the criterion inserts_fit, what is assumed, and the figures `inserts`.
/// @param solid  the printed body, its sparse regions taken as empty
/// @param hull   its outside, closed
void judge_inserts(const Delivery& delivered, const Mesh& solid, const Mesh& hull, const Progress& progress, Verdict& verdict);

/// How far a corner of a mesh lies outside of a closed surface, mm; 0 where it touches it.
double deepest_outside(const Mesh& mesh, const SurfaceQuery& surface, const Progress& progress);

}  // namespace rayrep::verify_detail
