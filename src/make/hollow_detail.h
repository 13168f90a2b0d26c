#pragma once

#include <functional>
#include <optional>
#include <string>

#include "rayrep/make/hollow.h"
#include "rayrep/mesh/surface_query.h"
#include "solve/interior_solver.h"

namespace rayrep::detail {

/// @throws Error{usage} with the message unless it holds
void require(bool holds, const std::string& message);

/// @throws Error{usage} for options out of range
void check_options(const HollowOptions& options);

/// What every goal needs: the body in the working frame and its inner domain.
struct Body {
  Mesh outer;  ///< as stored, in the frame given
  Eigen::Affine3d to_working;
  Mesh working;   ///< outer in the working frame
  Mesh hull;      ///< what a fluid touches: sealed cavities left out, overlaps united; working frame
  Moments solid;  ///< of the union of its components, unit density, working frame
  double size_mm = 0;
  double diagonal_mm = 0;
  double height_mm = 0;
  SurfaceQuery surface;
  InnerDomain inner;
  std::optional<RayIntegrals> integrals;  ///< over the inner domain
  Moments shell;                          ///< solid - inner domain

  /// @throws Error{goal} when the wall leaves no inside or cannot be resolved
  Body(Mesh mesh, const Eigen::Affine3d& frame, const HollowOptions& options, const Progress& progress);

  /// Samples the field anew on the finest grid that is of use.
  /// @returns false when it was that fine already
  bool refine(const HollowOptions& options, const Progress& progress);

private:
  std::string nothing_inside(const HollowOptions& options, const Progress& progress) const;
};

/// Solves and meshes until the mesh itself meets the goal: what the mesh has more than the model is added to the model's constant
/// part. theory.md (16d)
/// @param error  of a body with these moments, to compare with HollowOptions::as_built_tolerance
/// @param start  correction of the constant part to begin with, from a neighbouring problem
/// @returns the correction of the constant part that led to the delivered mesh
/// @throws Error{solver} when the first pass does not converge
Moments solve_as_built(Body& body, InteriorSolver solver, const HollowOptions& options,
                       const std::function<double(const Moments&)>& error, HollowResult& hollow, const Progress& progress,
                       const Moments& start = Moments::Zero());

}  // namespace rayrep::detail
