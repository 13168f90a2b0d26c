#pragma once

#include <vector>

#include "mesh/mesh_edges.h"
#include "rayrep/mesh/mesh.h"

namespace rayrep {

/// The triangles of a mesh joined over their edges, such that edges can be collapsed. Half-edge 3 t + k runs along triangle t from
/// its corner k to the next one; its twin runs along the same edge the other way. Collapses of edges whose beginnings have no
/// neighbours in common may go on at once: each changes nothing but between the neighbours of the vertex that is gone, and looks at
/// nothing that another one changes.
class HalfEdges {
public:
  HalfEdges(const Mesh& mesh, const VertexCorners& at);

  static int next(int h) { return h % 3 == 2 ? h - 2 : h + 1; }
  static int last(int h) { return h % 3 == 0 ? h + 2 : h - 1; }

  int vertices() const { return static_cast<int>(out_.size()); }
  int size() const { return static_cast<int>(sides_.size()); }
  int from(int h) const { return sides_[h].from; }
  int to(int h) const { return sides_[next(h)].from; }
  int twin(int h) const { return sides_[h].twin; }  ///< -1 where an edge is not of two triangles that run it opposite ways

  /// True where the triangles at a vertex go round it once. Others stay for ever, with all edges to them.
  bool regular(int vertex) const { return regular_[vertex] != 0; }
  bool removed(int vertex) const { return out_[vertex] < 0; }

  /// The half-edges from a regular vertex, counter-clockwise.
  void around(int vertex, std::vector<int>& half_edges) const;

  /// True when the surface stays of the same kind, every edge between two triangles, if the edge of half_edges[n] is collapsed: its
  /// ends are regular and have no neighbours in common but the corners opposite to it, and these four are no tetrahedron.
  /// @param half_edges, ends  those around the edge's beginning, and where each ends
  bool can_collapse(const std::vector<int>& half_edges, const std::vector<int>& ends, std::size_t n) const;

  /// Joins the beginning of the edge of half_edges[n] with its end; the two triangles at it are gone.
  void collapse(const std::vector<int>& half_edges, std::size_t n);

  /// Numbers of the triangles that are left, ascending.
  std::vector<int> remaining_triangles() const;
  /// These, in that order, without vertices that none of them uses.
  /// @param[out] kept  of each vertex its number before
  Mesh remaining(const std::vector<Eigen::Vector3d>& vertices, std::vector<int>& kept) const;

private:
  struct Side {
    int from;  ///< -1: its triangle is gone
    int twin = -1;
  };
  void remove(int h);

  std::vector<Side> sides_;
  std::vector<int> out_;  ///< a half-edge from each vertex, -1: none
  std::vector<char> regular_;
};

}  // namespace rayrep
