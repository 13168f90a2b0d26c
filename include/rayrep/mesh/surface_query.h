#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <limits>
#include <memory>
#include <vector>

#include "rayrep/mesh/mesh.h"

namespace rayrep {

/// The point of a surface nearest to a query.
struct ClosestPoint {
  double distance_mm = 0;  ///< infinite when nothing lies within the search radius
  Eigen::Vector3d point_mm = Eigen::Vector3d::Zero();
  int triangle = -1;  ///< -1 when nothing was found
};

/// A hit of a vertical line with a triangle. `sign` is +1 where the line, going up, enters the material, -1 where it leaves.
struct LineHit {
  double z_mm = 0;
  int triangle = -1;
  int sign = 0;
};

/// A bounding-volume hierarchy over a triangle mesh (Embree) that finds candidates, with the numbers recomputed in double.
/// Immutable after construction; every const member may be called from many threads at once.
class SurfaceQuery {
public:
  /// Triangles that `closest` takes to be farther away than they are: those from `from` on, by `by_mm`.
  struct Farther {
    int from = std::numeric_limits<int>::max();
    double by_mm = 0;
    double of(int triangle) const { return triangle >= from ? by_mm : 0; }
  };
  /// Keeps a copy of the triangles. An empty mesh is allowed.
  explicit SurfaceQuery(const Mesh& mesh);
  SurfaceQuery(const Mesh& mesh, const Farther& farther);
  ~SurfaceQuery();
  SurfaceQuery(SurfaceQuery&&) noexcept;
  SurfaceQuery& operator=(SurfaceQuery&&) noexcept;

  const Mesh& mesh() const;
  const Farther& farther() const;

  /// Nearest point of the surface within `radius_mm` of p, in double precision (error below 1e-6 of the mesh's diagonal in which
  /// triangle is nearest, exact for the triangle chosen). Of one that is taken to be farther away the point is as much farther, on
  /// the same line; distances stay 1-Lipschitz.
  /// @param hint  a triangle expected to be near (e.g. the answer for a neighbouring point), or -1: only speeds the search up
  ClosestPoint closest(const Eigen::Vector3d& p, double radius_mm, int hint = -1) const;

  /// All triangles that come within `radius_mm` of p, and some others, each once, in no order that means anything.
  void triangles_near(const Eigen::Vector3d& p, double radius_mm, std::vector<int>& found) const;

  /// All crossings of the line x, y = const with the mesh, ascending in z, entering ones first where they coincide. Whether the
  /// line passes through a triangle, its depth and its sign are decided in double with the half-open rule of theory.md (10), by
  /// which a closed mesh is crossed as often up as down even through shared edges and vertices. Embree finds the triangles by their
  /// boxes, which have room for its rounding, so that none is missed.
  void line_hits(const Eigen::Vector2d& xy, std::vector<LineHit>& hits) const;

private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

/// The same as SurfaceQuery::line_hits by a test of every triangle.
void line_hits_brute_force(const Mesh& mesh, const Eigen::Vector2d& xy, std::vector<LineHit>& hits);

/// Whether a line leaves the mesh as often as it enters it.
bool line_closes(const std::vector<LineHit>& hits);

/// Winding number at height z on a line that comes from outside: its hits below z, those that enter less those that leave.
int winding_below(const std::vector<LineHit>& hits, double z_mm);

/// SurfaceQuery::line_hits. @returns line_closes of them: true of every line where the mesh is closed
bool closed_line_hits(const SurfaceQuery& surface, const Eigen::Vector2d& xy, std::vector<LineHit>& hits);

/// Winding number of a closed surface at p, by the line below it.
int winding_at(const SurfaceQuery& surface, const Eigen::Vector3d& p);

/// Whether p lies inside of a closed surface: where its winding number is positive.
bool is_inside(const SurfaceQuery& surface, const Eigen::Vector3d& p);

/// Distance from p to the closed triangle (a, b, c) and the nearest point, in double. Exact for degenerate triangles too.
double point_triangle_distance(const Eigen::Vector3d& p, const Eigen::Vector3d& a, const Eigen::Vector3d& b,
                               const Eigen::Vector3d& c, Eigen::Vector3d* nearest = nullptr);

}  // namespace rayrep
