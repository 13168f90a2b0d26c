#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <limits>
#include <mutex>
#include <optional>
#include <vector>

#include "mesh/mesh_edges.h"
#include "rayrep/mesh/mesh.h"

namespace rayrep {

/// u, v, n right-handed and orthonormal.
struct Frame {
  Eigen::Vector3d u;
  Eigen::Vector3d v;
  Eigen::Vector3d n;
};
Frame frame_of(const Eigen::Vector3d& normal);

/// Never dry: what the sea reaches from below.
inline constexpr double kSea = -std::numeric_limits<double>::infinity();

/// At which height of the water the space beside each point and each triangle of a hull is joined to the sea: a cockpit at its
/// lowest rim. With the water at `offset`, what of a triangle lies below it is dry iff offset <= its height here.
struct FloodHeights {
  std::vector<double> of_triangle;  ///< of the part beside its lowest corner; empty when nothing is dry at any height
  std::vector<double> of_point;     ///< points as HullSurface numbers them; empty as well
  bool empty() const { return of_triangle.empty(); }
  bool dry(std::size_t triangle, double offset) const { return !empty() && of_triangle[triangle] >= offset; }
};

/// Vertices at which more than one sheet meets, or a sheet does not close around them.
std::vector<char> pinched_vertices(const std::vector<Eigen::Vector3i>& triangles, std::size_t vertices);

/// Whether a vertex lower than `below` has no lower neighbour and a triangle beside it that faces up: a cheap test that every hull
/// with a pocket below that height meets, and some others. Lower neighbours of a pinched vertex may be those of another sheet.
/// @param heights    of the vertices
/// @param projected  horizontal area of each triangle, negative where it faces down
bool may_have_pockets(const std::vector<Eigen::Vector3i>& triangles, const std::vector<double>& heights,
                      const std::vector<double>& projected, const std::vector<char>& pinched, double below);

/// The surface of a hull, prepared for finding its pockets with the water from any side. Its points are the vertices, those with
/// equal coordinates as one, but one for each sheet that passes through a vertex without an edge in common with the others on the
/// fluid's side: where two bodies or two rims touch, water does not leak.
class HullSurface {
public:
  HullSurface(const std::vector<Eigen::Vector3d>& vertices, const std::vector<Eigen::Vector3i>& triangles);

  std::size_t points() const { return vertex_.size(); }
  int vertex(std::size_t point) const { return vertex_[point]; }  ///< one of those at the point

  /// Lets the water rise from below and follows where the spaces that it has not reached are joined. theory.md (9d).
  /// @param heights  of the vertices, along frame.n
  /// @param wet      points that the sea has reached before: a pocket with such a point below the water is not dry. Empty: none
  /// @param highest  where the water stops: spaces not joined to the sea below get infinity
  FloodHeights flood_heights(const Frame& frame, const std::vector<double>& heights, const std::vector<char>& wet,
                             double highest = std::numeric_limits<double>::infinity()) const;

private:
  void connect_open_sides(const Mesh& mesh, const std::vector<EdgeUse>& open);
  int point(int corner) const { return point_of_corner_[corner]; }

  std::vector<Eigen::Vector3d> vertices_;
  std::vector<Eigen::Vector3i> triangles_;
  std::vector<int> point_of_corner_;  // corner k of triangle t is 3 t + k
  std::vector<int> vertex_;
  std::vector<int> first_;  // the corners at point p are corners_[first_[p]] to corners_[first_[p + 1] - 1]
  std::vector<int> corners_;
  std::vector<Eigen::Vector3d> normal_;  // of each point, its triangles weighted by their angles
  // Of a hull whose triangles do not meet edge to edge (see boundary_of_union): points where some side of a triangle has no
  // counterpart, and by point those at the ends of sides that lie on such a side.
  std::vector<char> open_;
  std::vector<std::vector<int>> beside_;
  double tolerance_mm_ = 0;
};

/// A HullSurface that is built when it is first asked for, once for all who share it, from any thread.
class LazyHullSurface {
public:
  /// The arguments must be the same every time.
  const HullSurface& get(const std::vector<Eigen::Vector3d>& vertices, const std::vector<Eigen::Vector3i>& triangles) {
    std::call_once(once_, [&] { surface_.emplace(vertices, triangles); });
    return *surface_;
  }

private:
  std::once_flag once_;
  std::optional<HullSurface> surface_;
};

}  // namespace rayrep
