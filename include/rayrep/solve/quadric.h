#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "rayrep/physics/moments.h"
#include "rayrep/rays/ray_integrals.h"
#include "rayrep/solve/goals.h"

namespace rayrep {

/// The best interior for a goal among all interiors on the rays: of any number of segments, or of fractional density.
struct QuadricSolution {
  bool converged = false;             ///< the KKT residual is below QuadricOptions::tolerance
  bool infeasible = false;            ///< proven: see `separation`
  int evaluations = 0;                ///< passes over the rays
  Moments q = Moments::Zero();        ///< switching function: material is where q.phi < 0
  Eigen::VectorXd multipliers;        ///< mu of the constraints; q = grad F + J^T mu; those of inequalities are not negative
  Moments moments = Moments::Zero();  ///< of the whole body, constant + S(q)
  double objective = 0;               ///< goal.objective(moments)
  double residual = 0;                ///< relative KKT residual: of s = constant + S(grad F(s) + J^T mu) and of c(s) = 0
  /// Proven for affine goals: no interior on these rays that meets the constraints does better. -infinity otherwise.
  double lower_bound = 0;
  double price = 0;       ///< of what fills the rays, where there is not enough of it: see RayIntegrals::priced
  double filled_mm3 = 0;  ///< volume that it takes; when infeasible for lack of it, how much it would take at least
  /// When infeasible: multipliers y with min over all interiors of y.c(s) > 0, which one pass over the rays can check
  /// (separation_margin). Empty otherwise.
  Eigen::VectorXd separation;
  /// Of Goal::cone, that hold it back: none or two, whose multipliers are the last ones,
  std::vector<Moments> cuts;
  double cut_angle_rad = 0;  ///< u.C u and v.C v of its matrix C, with u = (cos, sin) of this and v across
};

struct QuadricOptions {
  double tolerance = 1e-10;
  int max_evaluations = 200;  ///< of each attempt: a curved goal may be tried from up to three starts
  /// Where to start, from a neighbouring problem; without multipliers: from the solid's moments.
  Eigen::VectorXd multipliers;
  Moments moments = Moments::Zero();
  std::optional<double> cut_angle_rad = {};  ///< of cuts of Goal::cone, with multipliers
};

/// Minimises a goal with affine constraints over all interiors on the rays. At an optimum there is q = grad F(s) + J^T mu such that
/// material lies exactly where q.phi < 0 (theory.md (15), (30)), so the rays are eliminated and at most ten unknowns remain.
///
/// Affine goals: Newton's method with line search on the concave dual. Others: Newton's method on the KKT conditions, and where
/// that fails or ends at no minimum, convex quadratic models of the objective are minimised one after the other over the attainable
/// moments, a convex set, each by its dual, with Newton's method again from where that leads. A goal that is quasiconvex (a yo-yo,
/// a body on a given height) has one minimum; others may have more, see certify.h.
///
/// Inequalities (Goal::at_most) are constraints whose multipliers are not negative: of affine goals the dual is maximised within
/// that, and the bound is proven as without. A curved goal with inequalities is solved by minimising its gradient at the last
/// solution over and over: for a ratio of affine functions (stand_goal) that is Dinkelbach's method and ends at the global minimum;
/// others mostly do not converge. theory.md (70)
///
/// A cone (Goal::cone) is met by two cuts across each other, turned until the matrix is diagonal between them, to 1e-9. Each of
/// them holds for all of the cone, so that bound and proof of infeasibility stand. theory.md (76)
/// @param rays      inner domain
/// @param constant  moments of the rest of the body
/// Constraints that cannot be met are a result, with proof. Where the rays' grid says that there is only so much of what fills them
/// (RayGrid::most_mm3) its price is raised until that is enough: theory.md (49).
QuadricSolution solve_quadric(const Goal& goal, const RayIntegrals& rays, const Moments& constant,
                              const QuadricOptions& options = {});

/// min over all interiors of y.c(s) for constraints c(s) = c_0 + J s: positive when y separates them from what is attainable.
double separation_margin(const Goal& goal, const Eigen::VectorXd& y, const RayIntegrals& rays, const Moments& constant);

/// The interior that comes nearest to meeting affine constraints.
struct NearestSolution {
  bool converged = false;   ///< the bound is the distance to 1e-9 of it, or attainable
  bool attainable = false;  ///< the distance is below the tolerance
  int evaluations = 0;
  Moments moments = Moments::Zero();  ///< of the whole body
  double distance = 0;                ///< |c(s)|
  double lower_bound = 0;             ///< proven: no interior on these rays comes nearer
};

/// Minimises |c(s)| over all interiors on the rays by Wolfe's method for the point of least norm of a convex set: the interior with
/// material where (J^T c).phi < 0 is the one farthest down along c, and the nearest mixture of a few such is found exactly. The
/// interior may be of fractional density where (J^T c).phi does not depend on z. theory.md (28)
/// @param goal  without inequalities (asserted)
/// @param tolerance  distances below it count as attainable
NearestSolution nearest_attainable(const Goal& goal, const RayIntegrals& rays, const Moments& constant, double tolerance);

}  // namespace rayrep
