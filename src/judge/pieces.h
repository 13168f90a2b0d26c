#pragma once

#include "rayrep/judge/verify.h"
#include "rayrep/mesh/delivery.h"
#include "rayrep/mesh/mesh.h"

// A body that is printed in pieces.

namespace rayrep::verify_detail {

/// The spec with what it leaves open of pieces filled in: the axle of a yo-yo, as the steel in it tells; the centre of a yo-yo with
/// an axle, which the gap could move, from the original; and that cavities are drained, where none is sealed in a piece.
Spec judged_in_pieces(const Delivery& delivered, const Mesh* original, Spec spec);

/// What a yo-yo with an axle may lose of its outside: all of AxleFit::taken; empty for anything else.
std::vector<Mesh> allowed_to_be_taken(const Spec& spec, const Mesh& body);

/// The hull with the room in which an axle may lie.
Mesh hull_with_axle(const Mesh& hull, const Spec& spec, const Progress& progress);

/// What is asked of the pieces themselves. Adds the criteria
///   pieces_closed     edges of pieces that are open or face the wrong way: 0
///   pieces_add_up     largest difference of their ten moments, added, from those of the whole, over moment_units: 1e-9
///   pieces_on_bed     how far the lowest point of a piece is from the bed, mm: 1e-6 of the diagonal
///   pieces_lie_flat   smallest area with which a piece lies on the bed, mm2: 1
///   pieces_apart      smallest gap between the boxes of pieces on the bed, mm: above 0
///   cavities_opened   cavities that are sealed in a piece: 0, where Print::cut was to find the planes; else a note tells
///   wall_at_pins      only with pins: thinnest wall between their holes and cavities, over the wall asked for
/// the figures `pieces`, and what it comes to.
/// @param printed  with the moments of what the pieces enclose together
void judge_pieces(const PrintedDelivery& printed, const Spec& spec, const Limits& limits, const Progress& progress,
                  Verdict& verdict);

}  // namespace rayrep::verify_detail
