#pragma once

#include <vector>

#include "rayrep/base/progress.h"
#include "rayrep/make/hollow.h"
#include "rayrep/physics/core.h"

namespace rayrep::detail {

/// A mesh with rooms for what is fixed in it.
Mesh with_rooms(Mesh solid, const std::vector<FixedBody>& fixed);

/// Their surfaces, facing outward.
std::vector<Mesh> rooms_of(const std::vector<FixedBody>& fixed);

std::size_t triangles_of(const std::vector<Mesh>& meshes);

/// Thin rods from the lowest point of each room down to where the mesh ends below it: what keeps the wall from them leaves a post
/// that holds the room. @param rooms  in the frame of the mesh, z up
Mesh posts_below(const std::vector<Mesh>& rooms, const Mesh& mesh, double wall_mm);

/// Heights of the tops of their rooms above the lowest point of the solid, ascending, each once.
std::vector<double> pauses_mm(const std::vector<FixedBody>& fixed, const Mesh& solid, const Eigen::Vector3d& up);

/// Sum of the moments of what is fixed, each times its density over `density_g_cm3`.
Moments fixed_moments(const std::vector<FixedBody>& fixed, double density_g_cm3);

/// @throws Error{usage} for a fixed body without density, or whose surface is not closed or faces inward; Error{goal} for one that
///         does not lie in the solid, or nearer to its surface or another one than the wall
void require_room(const std::vector<FixedBody>& fixed, const Mesh& solid, double wall_mm, const Progress& progress);

/// @throws Error{usage} for a region to be kept solid that has nothing in common with the solid
void require_kept(const std::vector<Mesh>& regions, const Mesh& solid, const Progress& progress);

/// @throws Error{usage} for one that lay loose in a cavity, so that it was left out
void require_held(const HollowOptions& options, const Mesh& solid, const HollowResult& made);

}  // namespace rayrep::detail
