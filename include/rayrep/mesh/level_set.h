#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <functional>

#include "rayrep/mesh/block_field.h"
#include "rayrep/mesh/mesh.h"

namespace rayrep {

/// The zero set of a field as a closed triangle mesh (OpenVDB's dual contouring without adaptivity), oriented outward from the
/// region of negative values. Vertices lie within a cell of the zero set, one per cell and sheet; empty when there is no sign
/// change.
Mesh mesh_zero_set(const BlockField& field);

/// The zero set of f inside a box, sampled every `spacing_mm` (f is called at every sample, from several threads). f is negative
/// inside and must be positive on the box's sides. For generated shapes and tests.
Mesh mesh_implicit(const std::function<double(const Eigen::Vector3d&)>& f, const Eigen::AlignedBox3d& box, double spacing_mm);

}  // namespace rayrep
