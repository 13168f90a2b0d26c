#pragma once

#include <functional>
#include <optional>
#include <vector>

#include "rayrep/mesh/mesh.h"
#include "rayrep/mesh/quadric.h"

namespace rayrep {

/// The surface that a mesh stands for, near a point.
struct LevelAt {
  double height_mm = 0;                               ///< the point's distance from it, positive outside; of first order
  Eigen::Vector3d normal = Eigen::Vector3d::UnitZ();  ///< of the surface, outward
};
/// None: out of reach.
using LevelSurface = std::function<std::optional<LevelAt>(const Eigen::Vector3d&)>;

struct QuadricClipOptions {
  double error_mm = 0.02;  ///< of chords: as far as edges and triangles may be from the curve and from f = 0
  LevelSurface surface;    ///< vertices on the cut are put on it, too; empty: they stay on the mesh
  /// Vertices at which f is 0 count as above it. Who cuts by f and by -f wants that of one of them, so that the parts are one
  /// another's complement, corner by corner.
  bool zero_is_above = false;
  /// Whether chords of the curve may not become longer where points become one, if that leaves no point without a place.
  bool keeps_chords = true;

  bool is_above(double f) const { return f > 0 || (f == 0 && zero_is_above); }
};

struct QuadricClipped {
  enum class On : char { surface, crease, cap };
  Mesh mesh;                 ///< closed
  std::vector<On> on;        ///< of each vertex; points of the cut that found no place on both surfaces are of the cap
  double off_mm = 0;         ///< how far from the surface these are at most
  std::vector<char> is_new;  ///< of each vertex: whether it is none of the mesh that was cut, or was moved
};

/// What of a closed mesh lies where f > 0, closed by caps on f = 0. theory.md (87)
///
/// Which triangles are cut is told by the signs of f at the vertices alone, so that the cut closes whatever the numbers are; edges
/// and triangles in which f changes its sign twice, by more than the error, are split before. The points where edges cross f = 0
/// are moved onto both surfaces, those close to a vertex are that vertex. Vertices that are not cut stay as they are, bit by bit.
/// Takes time in the number of triangles, and a logarithm more of those that are cut.
/// @param mesh  closed, every edge in two triangles, facing outward; not crossing itself
/// @return      none where the curves on f = 0 do not bound parts of it that can be triangulated, as where they come nearer to each
///              other than the error; all or nothing of the mesh where f = 0 does not meet it, but for an ellipsoid that lies
///              wholly within it, which becomes a shell. Of f and -f the caps are the same triangles.
std::optional<QuadricClipped> clip_by_quadric(const Mesh& mesh, const Quadric& f, const QuadricClipOptions& options);

/// The same triangles for a slightly different f: vertices of caps move along its gradient, those of creases along both surfaces.
/// What it does is smooth in f.
/// @param carry  what is near to creases goes along with them, on the surface as far from it as it was: creases may pass where
///               vertices were. theory.md (140)
/// @returns false where a triangle thicker than the error turned by more than 60 degrees
bool follow(QuadricClipped& clipped, const Quadric& f, const QuadricClipOptions& options, bool carry = false);

}  // namespace rayrep
