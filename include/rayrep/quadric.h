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

/// The interior that comes nearest to meeting linear constraints.
struct NearestSolution {
  bool converged = false;             ///< to 1e-9 of the distance, or found to be attainable
  bool attainable = false;            ///< the distance is below the tolerance
  Moments moments = Moments::Zero();  ///< of the whole body
  double distance = 0;                ///< |A s|
  double lower_bound = 0;             ///< proven: no interior on these rays comes nearer
};

/// Minimises |A s| over all interiors on a ray-rep by Newton's method on the concave dual g(y) = min over interiors of y.(A s) -
/// |y|^2 / 2, whose inner minimum is material where (A^T y).phi < 0. theory.md (28)
/// @param A  rows that are linear in z along a ray: no entries for s_zz
/// @param tolerance  distances below it count as attainable
NearestSolution nearest_attainable(const Eigen::Matrix<double, Eigen::Dynamic, 10>& A, const RayRep& domain,
                                   const Moments& constant, double tolerance);

}  // namespace rayrep
