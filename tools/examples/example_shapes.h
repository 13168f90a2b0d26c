#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <functional>
#include <string>
#include <vector>

#include "rayrep/mesh/mesh.h"

namespace rayrep {

/// A solid of examples/, as a field that is negative inside and close to the distance (mm) near its surface. z is up. The plane y =
/// 0 is one of symmetry (for three_spheres x = 0 instead, for the die nearly), and the tops, bird, sumo and tilted_ellipsoid, spin
/// about x = y = 0.
struct ExampleShape {
  std::string name;                                     ///< file name without ".stl"
  std::function<double(const Eigen::Vector3d&)> field;  ///< mm; may be called from several threads
  Eigen::AlignedBox3d box;                              ///< mm; the field is positive on its sides
  double spacing_mm = 1;                                ///< of the samples, and about the length of the mesh's edges
};

/// duck, bird, three_spheres, tilted_ellipsoid, heart, teapot, ellipsoid, robin, sumo, couple, die.
std::vector<ExampleShape> example_shapes();

/// The shape's surface: meshed by OpenVDB, then relaxed on the zero set so that triangles are even, small features get the smaller
/// ones and edges follow ridges; at last moved along z until it stands on z = 0. The same bytes on every run and for any number of
/// threads.
Mesh mesh_example(const ExampleShape& shape);

}  // namespace rayrep
