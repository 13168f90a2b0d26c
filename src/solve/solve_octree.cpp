#include "rayrep/solve/solve_octree.h"

#include <algorithm>
#include <limits>

namespace rayrep {

OctreeReport solve_octree(const Goal& goal, const RayRep& domain, const Moments& constant, const OctreeOptions& options,
                          const Progress& progress) {
  OctreeReport report;
  int start_level = options.start_level;
  std::vector<OctreeLeaf> leaves = uniform_leaves(domain, start_level);
  double before = std::numeric_limits<double>::infinity();
  for (;;) {
    const OctreeInterior interior(domain, leaves, options.laplacian_weight);
    const InteriorNlp nlp(goal, interior, constant, options.scale, options.start_fill);
    report.solve = solve_ipopt(nlp, options.solve, progress);
    report.iterations += report.solve.iterations;
    const SolveStatus status = report.solve.status;
    if (!nlp.quadratic() && status != SolveStatus::converged && status != SolveStatus::infeasible) {
      SolveOptions other = options.solve;
      other.adaptive_barrier = !other.adaptive_barrier;
      report.solve = solve_ipopt(nlp, other, progress);
      report.iterations += report.solve.iterations;
    }
    report.most_leaves = std::max(report.most_leaves, interior.variables());
    ++report.rounds;
    report.solve.solver = "octree (Ipopt)";
    report.solve.variables = interior.variables();
    report.leaves = interior.leaves();
    if (report.solve.status == SolveStatus::infeasible && start_level > 0) {
      leaves = uniform_leaves(domain, --start_level);
      before = std::numeric_limits<double>::infinity();
      continue;
    }
    if (report.solve.x.size() == 0) return report;  // fewer cells than constraints

    const Eigen::VectorXd fill = nlp.interior_variables(report.solve.x);
    OctreeInterior::Refinement refined = interior.split_and_merge(fill, options.epsilon, options.split_at_fill_changes);
    report.body = constant + interior.moments(fill);
    const double objective = goal.objective(report.body);
    const bool settled = report.rounds > options.start_level && before - objective < options.least_improvement;
    if (report.solve.status == SolveStatus::converged && refined.splits > 0 && !settled) {
      if (report.rounds < options.max_rounds) {
        leaves = std::move(refined.leaves);
        before = objective;
        continue;
      }
      report.solve.status = SolveStatus::iteration_limit;
    }
    const Eigen::VectorXd rounded = (fill.array() > 0.5).cast<double>();
    report.unsplit = refined.splits;
    report.rounded_body = constant + interior.moments(rounded);
    report.rounded_objective = goal.objective(report.rounded_body);
    report.rounded_residual = goal.constraint_values(report.rounded_body).cwiseAbs().maxCoeff();
    report.solve.objective = objective;
    report.solve.x = fill;
    return report;
  }
}

}  // namespace rayrep
