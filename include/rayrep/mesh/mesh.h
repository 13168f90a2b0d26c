#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <vector>

namespace rayrep {

/// An indexed triangle mesh. Vertices in mm, triangles counter-clockwise seen from outside the material, 0-based.
struct Mesh {
  std::vector<Eigen::Vector3d> vertices;
  std::vector<Eigen::Vector3i> triangles;

  /// Corner k (0, 1, 2) of triangle t.
  const Eigen::Vector3d& corner(std::size_t t, int k) const { return vertices[triangles[t][k]]; }
};

/// Smallest axis-aligned box around all vertices; empty for a mesh without vertices.
Eigen::AlignedBox3d bounding_box(const Mesh& mesh);

/// Area of the triangles from number `first` on.
double surface_area(const Mesh& mesh, std::size_t first = 0);

/// Every vertex p replaced by T p. A reflection would turn the mesh inside out: T must have a positive determinant,
/// which is asserted.
Mesh transformed(const Mesh& mesh, const Eigen::Affine3d& T);

/// The rotation that turns `up`, which need not be a unit vector, to +z about the axis across both. Exact (entries 0 and +-1) for
/// directions along the axes.
Eigen::Matrix3d up_to_z(const Eigen::Vector3d& up);

/// The rigid motion that turns `up` to +z (up_to_z), puts the lowest point to z = 0 and centres the box in x and y.
Eigen::Affine3d working_frame(const Mesh& mesh, const Eigen::Vector3d& up);

/// Appends the vertices and triangles of `other` to `mesh`.
void append(Mesh& mesh, const Mesh& other);

/// Reverses the orientation of every triangle.
void flip(Mesh& mesh);

/// The same triangles over vertices of which those with equal coordinates (-0 = 0) are one, numbered in order of first use.
Mesh with_merged_vertices(const Mesh& mesh);

/// True when every coordinate is a float32 value, as in a file that stores no others (STL).
bool is_float32(const Mesh& mesh);

/// Distance between neighbouring float32 values at the largest coordinate of a box, mm.
double float32_spacing_mm(const Eigen::AlignedBox3d& box);

/// True when float32 coordinates can hold a wall in this box: their spacing is at most 1/100 of it, so that rounding takes less
/// than 1 % from it at each of its two surfaces. At 1e6 mm, where the spacing is 0.0625 mm, they cannot hold 1.2 mm.
bool float32_holds_wall(const Eigen::AlignedBox3d& box, double wall_mm);

/// The connected components of a mesh: triangles joined over shared vertices (by index).
struct Components {
  std::vector<int> of_triangle;  ///< component of each triangle, numbered by first appearance
  int count = 0;
};
Components connected_components(const Mesh& mesh);

/// One mesh per component, in order; vertices renumbered in order of first use.
std::vector<Mesh> split(const Mesh& mesh, const Components& components);

}  // namespace rayrep
