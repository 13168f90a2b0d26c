#pragma once

#include <Eigen/Core>

#include "rayrep/goals.h"
#include "rayrep/moments.h"
#include "rayrep/ray_rep.h"

namespace rayrep {

/// The optimum of an affine goal over all interiors on a ray-rep, with its proof.
struct QuadricSolution {
  bool converged = false;             ///< constraints met to 1e-10
  int evaluations = 0;                ///< passes over the rays
  Moments q = Moments::Zero();        ///< material is where q.phi < 0
  Moments moments = Moments::Zero();  ///< of the whole body
  double objective = 0;               ///< goal.objective(moments)
  double lower_bound = 0;             ///< dual value: no interior on these rays that meets the constraints does better
};

/// Maximises the concave dual g(mu) = min over interiors of [ objective(s) + mu.c(s) ] by Newton's method with line search. The
/// inner minimum has the closed form z0 = lo, z1 = clamp(root of q.phi along the ray), q = grad objective + (dc/ds)^T mu: the rays
/// are eliminated and the unknowns are the multipliers mu. Each evaluation is one pass over the rays. theory.md (15).
/// @param goal      affine, with a positive derivative by s_z and none by second moments (float and stand); its first constraint
///                  fixes the mass
/// @param domain    inner domain
/// @param constant  moments of the rest of the body
/// Constraints that cannot be met are a result: `converged` is false after 200 evaluations. The bound holds all the same.
QuadricSolution solve_quadric(const Goal& goal, const RayRep& domain, const Moments& constant);

}  // namespace rayrep
