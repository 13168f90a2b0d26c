#pragma once

#include "rayrep/physics/moments.h"
#include "rayrep/rays/ray_integrals.h"
#include "rayrep/solve/goals.h"
#include "rayrep/solve/quadric.h"

namespace rayrep {

/// A goal with its solution.
struct TargetSolution {
  TargetGoal goal;
  QuadricSolution solution;  ///< neither converged nor infeasible: no weight worked
};

/// Solves with a TargetGoal of the smallest weight with which Newton's method converges: 1e-2, or larger in steps of about three,
/// with height or moments of inertia as the second objective. What that costs of the first, HollowResult::extreme tells.
/// @param setup  whose weight is not used; not determined, see TargetGoal
TargetSolution solve_target(const TargetGoal::Setup& setup, const RayIntegrals& rays, const Moments& constant);

}  // namespace rayrep
