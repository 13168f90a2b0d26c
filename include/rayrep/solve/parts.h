#pragma once

#include <Eigen/Core>
#include <vector>

#include "rayrep/physics/moments.h"
#include "rayrep/rays/ray_integrals.h"

namespace rayrep {

/// One of several bodies whose interiors are found together.
struct PartInterior {
  const RayIntegrals* rays = nullptr;  ///< its inner domain, in a frame of its own; not null
  Moments constant = Moments::Zero();  ///< of the rest of it, in that frame
};

/// What is wanted of the moments of n bodies at once, each in its own frame: with s their moments, one below the other,
///
///     minimise g.s   subject to   J s + c_0 = 0.
///
/// Scaled so that values near 1 matter, like Goal. Whatever states the bodies are in, what a state asks for is linear in the
/// moments of what is in it, and these are linear in s: sum over j of M(X_j) s_j with X_j the pose of body j (moment_map).
struct PartsGoal {
  Eigen::MatrixXd J;  ///< rows of 10 n numbers
  Eigen::VectorXd c_0;
  Eigen::Index at_most = 0;  ///< so many of the rows, the last ones, say <= 0 instead
  Eigen::VectorXd g;         ///< of no body all zero
};

struct PartsSolution {
  bool converged = false;
  bool infeasible = false;       ///< proven: see `separation`
  int evaluations = 0;           ///< passes over all rays
  std::vector<Moments> q;        ///< of each body: material is where q.phi < 0
  std::vector<Moments> moments;  ///< of each body
  Eigen::VectorXd multipliers;   ///< mu; (q_1, ..., q_n) = g + J^T mu
  double objective = 0;          ///< g.s
  double residual = 0;           ///< largest of the constraints
  double lower_bound = 0;        ///< proven: no interiors on these rays that meet the constraints have a smaller g.s
  Eigen::VectorXd separation;    ///< when infeasible: y with min over all interiors of y.(J s + c_0) > 0
};

/// Finds the interiors of several bodies at once. The optimum is q = g + J^T mu, a quadric for each body, and as for one body the
/// unknowns are the multipliers alone: Newton's method on the concave dual, with one pass over the rays of each body
/// (theory.md (116)). Constraints that cannot be met are a result, with proof.
/// @param multipliers  where to start, from a neighbouring problem; may be empty
PartsSolution solve_parts(const PartsGoal& goal, const std::vector<PartInterior>& parts, const Eigen::VectorXd& multipliers = {});

}  // namespace rayrep
