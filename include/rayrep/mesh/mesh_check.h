#pragma once

#include <Eigen/Core>
#include <optional>
#include <string>
#include <vector>

#include "rayrep/base/progress.h"
#include "rayrep/mesh/mesh.h"

namespace rayrep {

/// How often a kind of defect occurs and where it is first seen.
struct Defect {
  std::size_t count = 0;
  Eigen::Vector3d first_mm = Eigen::Vector3d::Zero();  ///< meaningful when count > 0; in the coordinates of the mesh that was given
  explicit operator bool() const { return count > 0; }
};

/// What check_mesh found. "Edge" is an undirected pair of vertices after merging.
struct MeshReport {
  std::size_t triangles_read = 0;     ///< before anything was dropped
  std::size_t vertices_merged = 0;    ///< vertices that had the coordinates of an earlier one, bit for bit (-0 = 0)
  Defect not_finite;                  ///< vertices with NaN or Inf
  Defect degenerate;                  ///< a repeated corner (dropped), or exactly zero area (dropped unless that opens an edge)
  Defect duplicate;                   ///< triangles with the same three corners as an earlier one; see check_mesh
  Defect open_edges;                  ///< edges of one triangle
  Defect non_manifold_edges;          ///< edges of more than two triangles
  Defect misoriented_edges;           ///< edges of two triangles that run the same way, before turning
  Defect unbalanced_edges;            ///< edges run more often one way than the other, after turning: the surface is not closed
  Defect self_intersections;          ///< pairs of triangles that meet beyond a shared vertex or edge (a warning)
  std::size_t components = 0;         ///< joined over edges
  std::size_t nested_components = 0;  ///< components that lie inside another one
  std::size_t cavities = 0;           ///< of these, inward-facing: existing cavities
  std::size_t components_turned = 0;  ///< inside-out components that were turned, because it was unambiguous
  std::size_t triangles_turned = 0;   ///< triangles turned, to agree with their neighbours or with their component
  std::vector<std::string> notes;     ///< one sentence for each thing that was changed or that deserves a warning
  bool usable = false;                ///< bounds a solid of positive volume
  std::string refusal;                ///< when not usable: the counts, the first location, what to do
};

struct CheckOptions {
  bool self_intersections = true;  ///< the costliest check; a warning only
};

struct CheckedMesh {
  Mesh mesh;  ///< vertices merged, degenerate triangles dropped, components turned outward
  MeshReport report;
};

/// Merges vertices exactly, drops degenerate triangles, turns what is unambiguously inside out, then counts and locates every
/// defect. Never throws for a bad mesh: `report.usable` and `report.refusal` say what is wrong.
///
/// Of duplicate triangles, copies that unbalance edges are dropped, and so are pairs facing opposite ways (walls without
/// thickness); others stay: coincident bodies are a union. Defects other than `unbalanced_edges` are counted before any of this.
///
/// A mesh is usable when every edge is run equally often both ways (then every point has a winding number, also where
/// components touch along non-manifold edges), all coordinates are finite and the volume is positive. Overlapping
/// closed components and self-intersections are allowed: the solid is where the winding number is positive.
/// @throws Error{interrupted}
CheckedMesh check_mesh(const Mesh& mesh, const CheckOptions& options = {}, const Progress& progress = {});

/// check_mesh, and @throws Error{input} with `report.refusal` (prefixed by `name`) when the mesh is not usable.
CheckedMesh require_solid(const Mesh& mesh, const std::string& name, const CheckOptions& options = {},
                          const Progress& progress = {});

/// The boundary of the region of positive winding number of a closed mesh, as triangles that need not share vertices: those
/// parts of the mesh's triangles that have winding number 1 on the inner and 0 on the outer side. Surface integrals over it are
/// exact for the union of overlapping components, theory.md (18). A mesh whose components neither cross nor nest
/// with the same orientation comes back as it is.
/// @throws Error{interrupted}
Mesh boundary_of_union(const Mesh& mesh, const Progress& progress = {});

}  // namespace rayrep
