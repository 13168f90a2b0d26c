#pragma once

#include <Eigen/Geometry>
#include <cstddef>
#include <string>

#include "rayrep/mesh/mesh.h"

// Meshes as a page holds them: small, rounded, the same triangles.

namespace rayrep::report_detail {

/// Steps of a coordinate along each side of the box.
inline constexpr double kSteps = 65535;

/// By how much a coordinate is rounded at most, mm: half a step of the longest side.
double rounding_mm(const Eigen::AlignedBox3d& box);

/// The triangles of a mesh, in another order and each from another of its corners, over vertices rounded to kSteps of `box`. A
/// stream of unsigned numbers, LEB128 (seven bits a byte, low ones first, the high bit set but in the last); z(n) is a number with
/// its sign, 2 n or -2 n - 1:
///
///     triangles, vertices;
///     as long as there are triangles:
///       three corners of a first one, each 0 and a new vertex, or 1 + its number;
///       with a stack of edges, onto which those of each triangle go, (c, a) first: as long as it is not empty, take the last edge
///       a -> b of a triangle a, b, c. Nothing if there was a triangle with b -> a; else
///         0 and a new vertex d, 1 if there is no triangle, or 2 + z(number of d - that of the last d that was named so, at first
///         0): the triangle b, a, d, of which the edges (d, b), (a, d) go onto the stack
///     a new vertex gets the next number, and is z(x), z(y), z(z) of what it is more than a + b - c, or of a corner of a first
///     triangle, more than the last new vertex, at first 0.
///
/// Vertices of no triangle are left out.
std::string packed(const Mesh& mesh, const Eigen::AlignedBox3d& box);

/// As text: RFC 4648, section 4.
std::string base64(const std::string& bytes);

/// Whether every edge is run equally often both ways; vertices merged.
bool is_closed(const Mesh& mesh);

/// A mesh with at most so many triangles, or itself: the vertices in each cell of a grid, as fine as that allows, become one, at
/// their mean. Every edge that was run equally often both ways is still.
Mesh coarsened(const Mesh& mesh, std::size_t most_triangles);

}  // namespace rayrep::report_detail
