#pragma once

#include "rayrep/base/progress.h"
#include "rayrep/rays/octree_interior.h"
#include "rayrep/rays/ray_rep.h"
#include "rayrep/solve/goals.h"
#include "rayrep/solve/nlp.h"
#include "rayrep/solve/solve.h"

namespace rayrep {

/// Spin-It's adaptive hollowing, Sec. 5.2-5.4. The paper gives no numbers.
struct OctreeOptions {
  InteriorNlp::Scale scale;  ///< as for InteriorNlp
  int start_level = 2;       ///< cells at the start are 2^start_level ray spacings wide
  double epsilon = 0.01;     ///< fractions this close to 0 or 1 count as void or full
  /// gamma of the paper's regulariser gamma / 2 rho^T L rho, beside the goal's objective. None by default: Ipopt's barrier already
  /// makes the optimum unique, and any weight raises the objective and fills the factors of the Hessian.
  double laplacian_weight = 0;
  bool split_at_fill_changes = true;  ///< see OctreeInterior::split_and_merge
  /// Once the finest cells are reached, a round that lowers the objective by less than this is the last. Merged cubes at the
  /// surface between void and solid may otherwise be split and merged in turn for ever.
  double least_improvement = 1e-7;
  int max_rounds = 30;
  double start_fill = 0.5;
  /// At 1e-9 Ipopt stalls on some curved goals, whose cells of many sizes leave more rounding. Curved goals want a barrier_target,
  /// as on rays.
  SolveOptions solve{.tolerance = 1e-8};
};

struct OctreeReport {
  /// Of the last round. `objective` is the goal's, without the regulariser; x holds the fill fractions; status iteration_limit also
  /// means that OctreeOptions::max_rounds did not suffice.
  SolveReport solve;
  std::vector<OctreeLeaf> leaves;  ///< of the last round, to go with x
  std::size_t unsplit = 0;         ///< leaves of the last round that another would have split
  int rounds = 0;
  int iterations = 0;              ///< of Ipopt, over all rounds
  Eigen::Index most_leaves = 0;    ///< in any round
  Moments body = Moments::Zero();  ///< of the whole body with these fractions
  /// The same with every fraction rounded to 0 or 1. Rounding breaks the constraints a little.
  Moments rounded_body = Moments::Zero();
  double rounded_objective = 0;
  double rounded_residual = 0;  ///< largest |c_i| of the goal
};

/// Solves for the fill fractions of a mid-level octree, splits and merges its leaves, and so on until every fraction that is
/// neither 0 nor 1 belongs to a leaf of the finest level, one ray spacing; then rounds. Each round starts anew from `start_fill`.
/// @param constant  moments of the rest of the body, unit density
/// A round of a curved goal that does not converge is tried once more with the other barrier strategy. Large cells reach less than
/// small ones: a start that is infeasible is tried again with cells half as wide. Any other round that does not converge ends it:
/// SolveReport::status says so, and the rest of the report is about that round.
/// @throws Error{interrupted}
OctreeReport solve_octree(const Goal& goal, const RayRep& domain, const Moments& constant, const OctreeOptions& options,
                          const Progress& progress = {});

}  // namespace rayrep
