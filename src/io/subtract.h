#pragma once

#include <optional>

#include "rayrep/mesh/mesh.h"

/// Private to src/io and its tests.
namespace rayrep::detail {

/// The closed surface of all points inside `material` but outside `negative`, both in mm. `parts` is how many bodies of `material`
/// may overlap in one point. Whichever way the surfaces face, what they enclose counts.
///
/// The boundary of {w_material - parts w_negative > 0} by boundary_of_union, whose pieces are joined where their corners are within
/// 1e-9 of the size and whose sides are split where corners of others lie on them.
/// @return nothing if either is not closed, nothing is left, or the result is not closed or has another volume than its pieces
std::optional<Mesh> without(const Mesh& material, std::size_t parts, const Mesh& negative);

}  // namespace rayrep::detail
