#include "make/as_built.h"

#include <algorithm>
#include <limits>
#include <vector>

#include "base/linear_algebra.h"

namespace rayrep::detail {
namespace {

/// The fixed-point iteration c = D(c), sped up by what its last steps have shown of D: Anderson's method. theory.md (16e)
class Feedback {
public:
  /// @param unit  of each moment
  explicit Feedback(const Moments& unit) : unit_(unit) {}

  /// After a jump of D its past says nothing about its future.
  void forget() { steps_.clear(); }

  /// Where to go from c, given D(c).
  Moments next(const Moments& c, const Moments& D) {
    const auto n = static_cast<Eigen::Index>(steps_.size());
    Eigen::MatrixXd changes(10, n);  // of D(c) - c
    Eigen::MatrixXd changes_of_D(10, n);
    for (Eigen::Index k = 0; k < n; ++k) {
      const Step& step = steps_[static_cast<std::size_t>(k)];
      changes.col(k) = ((D - c) - (step.D - step.c)).cwiseQuotient(unit_);
      changes_of_D.col(k) = D - step.D;
    }
    steps_.push_back({c, D});
    if (n == 0) return D;
    const Moments more = changes_of_D * least_squares(changes, (D - c).cwiseQuotient(unit_));
    // Differences that are noise lead nowhere.
    return more.cwiseQuotient(unit_).norm() < (D - c).cwiseQuotient(unit_).norm() ? Moments(D - more) : D;
  }

private:
  struct Step {
    Moments c;
    Moments D;
  };
  Moments unit_;
  std::vector<Step> steps_;
};

void keep(Made made, InteriorSolver::Solved& solved, HollowResult& result) {
  result.delivery = std::move(made.delivery);
  result.cavities = made.cavities;
  result.filled_cavities = made.filled_cavities;
  result.filled_mm3 = made.filled_mm3;
  result.removed_islands = made.removed_islands;
  result.solve = std::move(solved.report);
  result.q = solved.q;
  result.price = solved.price;
}

}  // namespace

Error unsolved(const SolveReport& report) {
  return {ErrorCode::solver, "The solver stopped before it converged: " + report.solver + " says " + report.solver_status +
                                 " after " + std::to_string(report.iterations) + " iterations with " +
                                 std::to_string(report.variables) + " variables. Try another resolution (--resolution)."};
}

Moments solve_as_built(const AsBuilt& problem, InteriorSolver solver, Maker& maker, HollowResult& result,
                       const Progress& progress) {
  Feedback feedback(problem.unit);
  Moments correction = problem.start;
  Moments best_correction = correction;
  result.as_built_error = std::numeric_limits<double>::infinity();
  double last_error = 0.1;
  const auto start_finer = [&] {
    if (!maker.refine()) return false;
    feedback.forget();
    correction = problem.start;
    return true;
  };
  for (int pass = 1; pass <= problem.max_passes; ++pass) {
    progress.begin("solve");
    InteriorSolver::Solved solved = solver.solve(problem.shell + correction, progress);
    result.solver_iterations += solved.report.iterations;
    if (solved.report.status != SolveStatus::converged) {
      if (pass == 1) throw unsolved(solved.report);
      // At the edge of what can be met a coarse mesh asks for more than there is.
      if (!start_finer()) break;
      continue;
    }
    result.passes = pass;

    progress.begin("mesh");
    const bool had_adapted = maker.adapted();
    maker.make({solved.q, solved.price});
    double e = problem.error(maker.moments());
    // A mesh that follows cannot tear, close or show what the quadric does away from it: where it folds it is made anew, and where
    // the error stays, if there is a pass left to make up for the change.
    const bool useless = had_adapted && e > 0.9 * last_error && pass < problem.max_passes;
    if (maker.adapted() && (useless || maker.spoilt())) {
      maker.make_anew({solved.q, solved.price});
      e = problem.error(maker.moments());
    }
    if (!maker.adapted()) feedback.forget();
    if (e < result.as_built_error) {
      result.as_built_error = e;
      best_correction = correction;
      keep(maker.made(), solved, result);
    }
    if (result.as_built_error <= problem.tolerance) break;
    // Meshed, and not much nearer than before (in the first pass 2 %): the cavities are too thin for this grid.
    const bool stuck = !maker.adapted() && e > std::max(1e-3, 0.2 * last_error);
    last_error = e;
    if (stuck && start_finer()) continue;
    correction = feedback.next(correction, correction + maker.moments() - solved.model);
  }
  return best_correction;
}

}  // namespace rayrep::detail
