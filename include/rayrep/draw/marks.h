#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "rayrep/base/progress.h"
#include "rayrep/mesh/mesh.h"
#include "rayrep/physics/moments.h"
#include "rayrep/physics/spec.h"

namespace rayrep {

/// What a picture shows of a body besides its surface, in the frame of the mesh.
struct Marks {
  struct Water {
    double offset_mm = 0;  ///< of the surface, along up
    Eigen::Vector3d centre_of_buoyancy_mm = Eigen::Vector3d::Zero();
    std::optional<Eigen::Vector3d> metacentre_mm = {};
    bool dry_pockets = false;  ///< below its surface there are spaces that it does not reach
  };

  Eigen::Vector3d up = Eigen::Vector3d::UnitZ();  ///< unit vector: vertical in the picture
  std::optional<double> mass_g = {};
  std::optional<Eigen::Vector3d> centre_of_mass_mm = {};
  std::optional<Eigen::Vector3d> centre_before_mm = {};  ///< of mass, of the solid
  std::optional<Water> water = {};
  std::optional<Eigen::Vector3d> contact_mm = {};  ///< of a spin: the axis goes through it, along up
  bool yoyo = false;                               ///< it is the centre, not where a top touches the ground
  std::optional<Eigen::Vector3d> hook_mm = {};     ///< from which it hangs
  std::vector<Eigen::Vector3d> support_mm = {};    ///< corners of the support polygon, counter-clockwise from above
  std::optional<double> ground_mm = {};            ///< height of the ground, along up
};

/// Of a body in what its spec says it is for; of several poses in the first.
/// @param outside  the mesh that is delivered, or the solid: closed; sealed cavities do not count
/// @param spec     as a judge was given it: without a waterline it is that at which the body displaces its own mass
/// @param body     mass properties, in the frame of the mesh
/// @throws Error{interrupted}. What cannot be found (the waterline of a body that sinks) is left out.
Marks marks_of(const Mesh& outside, const Spec& spec, const MassProperties& body, const Progress& progress = {});

}  // namespace rayrep
