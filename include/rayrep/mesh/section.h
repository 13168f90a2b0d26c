#pragma once

#include <Eigen/Core>
#include <vector>

#include "rayrep/mesh/mesh.h"

namespace rayrep {

/// A closed polygon in the plane of a section; the last point is joined to the first.
using SectionLoop = std::vector<Eigen::Vector2d>;

/// Where a closed mesh crosses the plane z = `height_mm`: loops with material to their left, so that outlines run
/// counter-clockwise and holes clockwise. A vertex in the plane counts as above it, so that loops close whatever lies in the plane.
/// A mesh that is not closed gives the loops it has; open chains are left out.
/// Takes time in the number of triangles; MeshSections takes many heights at once.
std::vector<SectionLoop> section(const Mesh& mesh, double height_mm);

/// Area (mm^2, positive for a counter-clockwise loop) and its centroid times the area (mm^3).
struct LoopMoments {
  double area_mm2 = 0;
  Eigen::Vector2d moment_mm3 = Eigen::Vector2d::Zero();
};
LoopMoments loop_moments(const SectionLoop& loop);

/// Whether a point lies inside a polygon, by crossings of a ray.
bool contains(const SectionLoop& loop, const Eigen::Vector2d& p);

/// The loops that lie in no other, largest first: the outline without its holes. Loops that cross count as they lie by their first
/// points. @return places in `loops`
std::vector<std::size_t> outermost(const std::vector<SectionLoop>& loops);

/// Sections of one mesh at many heights: each looks only at the triangles that reach there.
class MeshSections {
public:
  /// @param mesh  vertices merged; kept by reference
  explicit MeshSections(const Mesh& mesh);
  std::vector<SectionLoop> at(double height_mm) const;

private:
  const Mesh& mesh_;
  std::vector<int> by_bottom_;     ///< triangles, by their lowest vertex
  std::vector<double> bottom_mm_;  ///< of by_bottom_
  double tallest_mm_ = 0;          ///< height of the tallest triangle
};

}  // namespace rayrep
