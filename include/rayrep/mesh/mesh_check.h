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

/// What first aid did to a surface that was not closed, or whose bodies overlap; see check_mesh. Lengths are in the mesh's unit.
struct FirstAidReport {
  std::size_t corners_joined = 0;
  double joined_within = 0;        ///< corners were at most so far apart
  std::size_t sides_split = 0;     ///< of triangles, at corners of others that lie on them (T-junctions)
  std::size_t sheets_dropped = 0;  ///< stray triangles, fins and internal walls: sheets that bound nothing
  std::size_t triangles_dropped = 0;
  std::size_t holes_closed = 0;
  std::size_t triangles_added = 0;  ///< that closed them
  double surface_change = 0;        ///< area that was added and dropped, over that of the result
  double volume_change = 0;  ///< by closing holes, over that of the result: before, they count as closed from the middle of the box
  bool repaired = false;     ///< holes were closed that are neither flat nor small: CheckOptions::repair
  std::size_t bodies_united = 0;  ///< closed bodies that overlap others: the faces inside were left out
  explicit operator bool() const {
    return corners_joined + sides_split + sheets_dropped + triangles_dropped + holes_closed + bodies_united > 0;
  }
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
  FirstAidReport first_aid;           ///< all 0: it was not needed, or could not help
  std::vector<std::string> notes;     ///< one sentence for each thing that was changed or that deserves a warning
  bool usable = false;                ///< bounds a solid of positive volume
  bool repairable = false;            ///< when not usable: CheckOptions::repair would make it so
  std::string refusal;                ///< when not usable: the counts, the first location, what to do
};

struct CheckOptions {
  bool self_intersections = true;  ///< the costliest check; a warning only
  bool first_aid = true;           ///< of surfaces that are not closed
  bool repair = false;             ///< first aid closes all holes, also where their shape has to be guessed
  bool unite = true;               ///< first aid makes one body of those that overlap
};

struct CheckedMesh {
  Mesh mesh;  ///< vertices merged, degenerate triangles dropped, components turned outward
  MeshReport report;
};

/// Merges vertices exactly, drops degenerate triangles, turns what is unambiguously inside out, and counts and locates every
/// defect. Never throws for a bad mesh: `report.usable` and `report.refusal` say what is wrong.
///
/// Of duplicate triangles, copies that unbalance edges are dropped, pairs facing opposite ways (without thickness), and copies
/// of the whole mesh; others stay: coincident bodies are a union. Defects but `unbalanced_edges` are counted before any of this.
///
/// A mesh is usable when every edge is run equally often both ways (then every point has a winding number, also where
/// components touch along non-manifold edges), all coordinates are finite and the volume is positive. Overlapping
/// closed components and self-intersections are allowed: the solid is where the winding number is positive.
///
/// Closed components that face outward and overlap are made one by `combined`, theory.md (146): the outside is the same, the faces
/// inside are gone, and vertices are float32 values if they all were. They are left as they are, and `notes` says so, where that
/// leaves triangles that cross or another solid. What only touches is left, too, and a component that crosses itself alone.
///
/// Any other surface that is closed is left as it is. One that is not gets first aid, theory.md (42), which guesses nothing:
/// corners of open edges within 1e-5 of the diagonal are joined (within as little as helps; 1e-4 if no triangle is lost), triangles
/// split at corners that lie on their open sides; sheets that bound nothing dropped; holes closed that are flat (to 1e-3 of their
/// size) or small (2 % of the diagonal), with `repair` all. If that does not close the surface the mesh is left as it was, and
/// `refusal` says what is missing. The result does not depend on the order of the triangles.
/// @throws Error{interrupted}
CheckedMesh check_mesh(const Mesh& mesh, const CheckOptions& options = {}, const Progress& progress = {});

/// check_mesh, and @throws Error{input} with `report.refusal` (prefixed by `name`) when the mesh is not usable.
CheckedMesh require_solid(const Mesh& mesh, const std::string& name, const CheckOptions& options = {},
                          const Progress& progress = {});

/// Longest sides of bodies that are hollowed or judged: outside, a unit is wrong.
inline constexpr double kSmallestBody_mm = 1e-3;
inline constexpr double kLargestBody_mm = 1e6;

/// @throws Error{input} for a mesh in mm that is smaller or larger, or further than 1e12 mm from the origin; `name` comes first
void require_size(const Mesh& mesh, const std::string& name = "");

/// The boundary of the region of positive winding number of a closed mesh, in triangles that meet in shared vertices and sides:
/// those parts of the mesh's triangles that have winding number 1 on the inner and 0 on the outer side, exact until corners are
/// rounded to doubles. Surface integrals over it are exact for the union of overlapping components, theory.md (18). A mesh whose
/// components neither cross nor nest with the same orientation comes back as it is. `combined` mends what rounding does, too.
/// @throws Error{interrupted}
Mesh boundary_of_union(const Mesh& mesh, const Progress& progress = {});

}  // namespace rayrep
