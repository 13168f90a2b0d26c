#pragma once

#include <Eigen/Core>
#include <vector>

namespace rayrep {

/// A convex body by its faces, each a flat polygon.
struct ConvexPolytope {
  struct Face {
    Eigen::Vector3d normal;    ///< outward, a unit vector
    std::vector<int> corners;  ///< counter-clockwise seen from outside; some may lie on a straight line
  };
  std::vector<Eigen::Vector3d> vertices;  ///< those that are corners of faces
  std::vector<Face> faces;
  /// Between each two of its corners: the side from `from` to `to` of the face `left`, and the other way round of `right`.
  struct Edge {
    int from, to;
    int left, right;
  };
  std::vector<Edge> edges;
};

/// The convex hull of points by Barber's, Dobkin's and Huhdanpaa's quickhull (1996) with exact signs: convex without exception.
/// Points that are no farther than `tolerance` outside of the hull of others are left out, and triangles whose corners lie within
/// it of a plane are one face.
/// @throws Error{input} for points that lie in a plane, or nearly
ConvexPolytope convex_hull(const std::vector<Eigen::Vector3d>& points, double tolerance_mm);

}  // namespace rayrep
