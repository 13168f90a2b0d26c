#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <vector>

#include "mesh/half_edges.h"

namespace rayrep {

/// A triangle by one corner, the sides to the other two, and their cross product.
struct Facet {
  Eigen::Vector3d corner, side, other_side, normal;

  Facet(const Eigen::Vector3d& a, const Eigen::Vector3d& b, const Eigen::Vector3d& c)
      : corner(a), side(b - a), other_side(c - a), normal(side.cross(other_side)) {}
};

/// What may become of triangles.
struct CollapseLimits {
  double least_cos_of_turn = 0;
  double least_slenderness = 0;  ///< smallest height over longest side (sqrt(3)/2 at most), unless one around was as slender before
};

/// Collapses of edges of a mesh, one at a time, in which a vertex goes onto a neighbour.
class EdgeCollapse {
public:
  /// Keeps references to both.
  EdgeCollapse(HalfEdges& surface, const std::vector<Eigen::Vector3d>& vertices, const CollapseLimits& limits = {})
      : limits_(limits), vertices_(vertices), surface_(surface) {}

  /// Turns to a regular vertex that is still there.
  void look_at(int vertex);
  int vertex() const { return vertex_; }
  /// The half-edges from it, counter-clockwise, where they end, and what they run along.
  const std::vector<int>& half_edges() const { return half_edges_; }
  const std::vector<int>& neighbours() const { return neighbours_; }
  const std::vector<Eigen::Vector3d>& spokes() const { return spokes_; }
  /// Of the triangles between each of these and the next: twice their area along the normal.
  const std::vector<Eigen::Vector3d>& normals() const { return normals_; }

  /// Prepares to collapse the n-th of these edges.
  /// @returns false where the surface would not stay of the same kind, or a triangle become what it may not
  bool prepare(std::size_t n);
  /// What becomes of the triangles around the vertex, but for two that vanish, and their numbers.
  const std::vector<Facet>& facets() const { return facets_; }
  const std::vector<int>& facet_numbers() const { return facet_numbers_; }
  /// The vertex at the end of the k-th facet's other side, which it has in common with the next one.
  int facet_end(std::size_t k) const { return facet_ends_[k]; }
  void collapse() { surface_.collapse(half_edges_, prepared_); }

private:
  std::size_t after(std::size_t n) const { return n + 1 < half_edges_.size() ? n + 1 : 0; }

  CollapseLimits limits_;
  const std::vector<Eigen::Vector3d>& vertices_;
  HalfEdges& surface_;
  int vertex_ = -1;
  std::vector<int> half_edges_, neighbours_;
  std::vector<Eigen::Vector3d> spokes_;
  std::vector<Eigen::Vector3d> normals_;
  std::size_t prepared_ = 0;
  std::vector<Facet> facets_;
  std::vector<int> facet_numbers_, facet_ends_;
};

/// Joins the ends of edges that are shorter than `length_mm`, one onto the other, where the surface stays of the same kind and no
/// triangle turns over. Vertices stay where they are or are gone; those that are `fixed` stay, and so do those whose triangles do
/// not go round them once.
/// @param fixed  for each vertex; empty: none
/// @returns of each vertex that is left its number before
std::vector<int> collapse_short_edges(Mesh& mesh, double length_mm, const std::vector<char>& fixed = {});

}  // namespace rayrep
