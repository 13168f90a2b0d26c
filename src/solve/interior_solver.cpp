#include "solve/interior_solver.h"

#include <memory>

#include "rayrep/rays/voxel_interior.h"
#include "rayrep/solve/solve_octree.h"

namespace rayrep {
InteriorSolver::Solved InteriorSolver::solve(const Moments& constant, const Progress& progress) {
  switch (setup_.solver) {
    case Solver::quadric:
      return solve_quadric(constant);
    case Solver::rays:
      if (!setup_.segments) return solve_interior(BottomFilledRays(domain_), constant, progress);
      if (setup_.bounds == SegmentBounds::paper)
        return solve_interior(CentredSegmentRays(domain_, setup_.between), constant, progress);
      return solve_segments(constant, progress);
    case Solver::voxels:
    case Solver::octree:
      if (!cells_) {
        cells_ = setup_.solver == Solver::voxels ? solve_interior(VoxelInterior(domain_, 1), constant, progress)
                                                 : solve_octree(constant, progress);
        if (cells_->report.status != SolveStatus::converged) return *cells_;
      }
      return adjusted(*cells_, constant);
  }
  return {};
}

InteriorSolver::Solved InteriorSolver::solve_quadric(const Moments& constant) {
  Solved solved;
  const QuadricSolution exact = rayrep::solve_quadric(goal_, integrals_, constant, warm_);
  if (exact.converged) {
    warm_.multipliers = exact.multipliers;
    warm_.moments = exact.moments;
    if (!exact.cuts.empty()) warm_.cut_angle_rad = exact.cut_angle_rad;
  }
  solved.q = exact.q;
  solved.price = exact.price;
  solved.model = exact.moments;
  SolveReport& report = solved.report;
  report.solver = "quadric";
  report.status = exact.converged ? SolveStatus::converged : exact.infeasible ? SolveStatus::infeasible : SolveStatus::failed;
  report.solver_status = exact.converged ? "converged" : exact.infeasible ? "infeasible, proven" : "stalled";
  report.iterations = exact.evaluations;
  report.variables = exact.multipliers.size();
  report.objective = exact.objective;
  report.constraint_violation = exact.residual;
  report.multipliers = exact.multipliers;
  return solved;
}

InteriorSolver::Solved InteriorSolver::solve_interior(const Interior& interior, const Moments& constant,
                                                      const Progress& progress) const {
  const InteriorNlp nlp(goal_, interior, constant, setup_.scale, setup_.start_fill);
  Solved solved;
  SolveReport& report = solved.report;
  SolveOptions first = setup_.options;
  const bool pairs = interior.pair_lengths().size() > 0;
  first.probing = pairs || setup_.solver == Solver::voxels;
  if (pairs) first.least_fraction_to_bound = 0.9;
  report = solve_ipopt(nlp, first, progress);
  if (report.status != SolveStatus::converged && !nlp.quadratic()) {
    SolveOptions other = setup_.options;
    other.adaptive_barrier = !other.adaptive_barrier;
    const int before = report.iterations;
    report = solve_ipopt(nlp, other, progress);
    report.iterations += before;
  }
  report.solver = setup_.solver == Solver::voxels ? "voxels (Ipopt)" : "rays (Ipopt)";
  solved.model = nlp.body(report.x);
  solved.q = nlp.switching(report.multipliers);
  report.x = nlp.interior_variables(report.x);
  report.variables = interior.variables();
  report.objective = goal_.objective(solved.model);
  return solved;
}

InteriorSolver::Solved InteriorSolver::solve_segments(const Moments& constant, const Progress& progress) const {
  const SegmentRays interior(domain_, setup_.between);
  Solved solved = solve_interior(interior, constant, progress);
  solved.report.x = interior.ends(solved.report.x);
  return solved;
}

InteriorSolver::Solved InteriorSolver::solve_octree(const Moments& constant, const Progress& progress) const {
  OctreeOptions options;
  const double tolerance = options.solve.tolerance;
  options.solve = setup_.options;
  options.solve.tolerance = std::max(tolerance, setup_.options.tolerance);
  options.scale = setup_.scale;
  options.start_fill = setup_.start_fill;
  Solved solved;
  const OctreeReport octree = rayrep::solve_octree(goal_, domain_, constant, options, progress);
  solved.report = octree.solve;
  solved.report.solver = "octree (Ipopt)";
  solved.report.iterations = octree.iterations;
  solved.model = octree.body;
  const OctreeInterior interior(domain_, octree.leaves, options.laplacian_weight);
  solved.q = InteriorNlp(goal_, interior, constant, setup_.scale, setup_.start_fill).switching(octree.solve.multipliers);
  return solved;
}

InteriorSolver::Solved InteriorSolver::adjusted(const Solved& cells, const Moments& constant) const {
  const QuadricSolution exact = rayrep::solve_quadric(linear_goal(cells.q, goal_), integrals_, constant);
  Solved solved = cells;
  if (!exact.converged) {
    solved.report.status = SolveStatus::failed;
    solved.report.solver_status = "no quadric like that of the cells meets the constraints on the rays";
    return solved;
  }
  solved.q = exact.q;
  solved.model = exact.moments;
  solved.report.objective = goal_.objective(exact.moments);
  return solved;
}

}  // namespace rayrep
