#include "make/as_built.h"

#include <algorithm>
#include <limits>
#include <optional>
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
    // Differences that are noise lead nowhere. Where the last few of them explain all that is off, as where resin takes the place
    // of the plastic that is left out, a long way does.
    constexpr Eigen::Index kFew = 3;
    constexpr double kExplained = 0.1;
    constexpr double kLong = 100;
    const double off = (D - c).cwiseQuotient(unit_).norm();
    const auto within = [&](const Extrapolated& e, double most) { return e.more.cwiseQuotient(unit_).norm() < most * off; };
    const auto n = static_cast<Eigen::Index>(steps_.size());
    std::optional<Moments> far;
    for (Eigen::Index few = 1; few <= std::min(n, kFew) && !far; ++few)
      if (const Extrapolated e = extrapolated(c, D, few); e.left < kExplained * off && within(e, kLong)) far = D - e.more;
    const Extrapolated all = extrapolated(c, D, n);
    steps_.push_back({c, D});
    if (far) return *far;
    return within(all, 1) ? Moments(D - all.more) : D;
  }

private:
  struct Step {
    Moments c;
    Moments D;
  };
  struct Extrapolated {
    Moments more;  ///< how far beyond D(c) the way back is
    double left;   ///< of D(c) - c, unexplained
  };

  /// By the last n steps.
  Extrapolated extrapolated(const Moments& c, const Moments& D, Eigen::Index n) const {
    const Moments off = (D - c).cwiseQuotient(unit_);
    if (n == 0) return {Moments::Zero(), off.norm()};
    Eigen::MatrixXd changes(10, n);  // of D(c) - c
    Eigen::MatrixXd changes_of_D(10, n);
    for (Eigen::Index k = 0; k < n; ++k) {
      const Step& step = steps_[steps_.size() - static_cast<std::size_t>(n - k)];
      changes.col(k) = ((D - c) - (step.D - step.c)).cwiseQuotient(unit_);
      changes_of_D.col(k) = D - step.D;
    }
    const Eigen::VectorXd share = least_squares(changes, off);
    return {changes_of_D * share, (off - changes * share).norm()};
  }

  Moments unit_;
  std::vector<Step> steps_;
};

/// Where to go after each pass. A cut that is made anew may jump: where that made it worse, it is made anew on a part of the way
/// from the best one, half of it, a quarter and so on, until what is made follows again. theory.md (141)
class Way {
public:
  explicit Way(const AsBuilt& problem) : feedback_(problem.unit), start_(problem.start) {}

  /// @param c  the correction with which a body was made that has D(c); not `smooth`: made anew
  Moments next(const Moments& c, const Moments& D, double error, bool smooth) {
    if (!smooth) feedback_.forget();
    const Moments whole = feedback_.next(c, D);
    const bool better = ++made_ <= 2 || error < least_error_;  // the first one may have been good by chance
    lost_ = !better && !smooth;
    if (better) {
      least_error_ = error;
      best_ = c;
      from_best_ = whole - c;
      if (smooth) part_ = 1;
    }
    if (lost_) part_ /= 2;
    return smooth ? whole : Moments(best_ + part_ * from_best_);
  }

  /// What was made last is nothing to follow.
  bool lost() const { return lost_; }

  Moments start_anew() {
    feedback_.forget();
    least_error_ = std::numeric_limits<double>::infinity();
    part_ = 1;
    made_ = 0;
    lost_ = false;
    return start_;
  }

private:
  Feedback feedback_;
  Moments start_;
  Moments best_ = Moments::Zero();
  Moments from_best_ = Moments::Zero();
  double least_error_ = std::numeric_limits<double>::infinity();
  double part_ = 1;
  int made_ = 0;  ///< so many bodies
  bool lost_ = false;
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
  Way way(problem);
  Moments correction = problem.start;
  Moments best_correction = correction;
  result.as_built_error = std::numeric_limits<double>::infinity();
  double last_error = 0.1;
  bool was_slow = false;
  int most_passes = problem.max_passes;
  const auto start_anew = [&](int pass) {
    correction = way.start_anew();
    most_passes = problem.max_passes + pass;  // those before do not count
  };
  for (int pass = 1; pass <= most_passes; ++pass) {
    progress.begin("solve");
    InteriorSolver::Solved solved = solver.solve(problem.shell + correction, progress);
    result.solver_iterations += solved.report.iterations;
    if (solved.report.status != SolveStatus::converged) {
      if (pass == 1) throw unsolved(solved.report);
      // At the edge of what can be met a coarse mesh asks for more than there is.
      if (!maker.refine() && !maker.take_all()) break;
      start_anew(pass);
      continue;
    }
    result.passes = pass;

    progress.begin("mesh");
    const bool had_adapted = maker.adapted();
    if (way.lost())
      maker.make_anew({solved.q, solved.price});
    else
      maker.make({solved.q, solved.price});
    double e = problem.error(maker.moments());
    const bool renewed = maker.renewed();
    if (renewed) {
      way.start_anew();
      most_passes = problem.max_passes + pass;
    }
    // A mesh that follows cannot tear, close or show what the quadric does away from it: where it folds it is made anew, and where
    // the error stays, or falls slowly twice, if there is a pass left to make up for the change; as little as cuts differ by anyhow
    // may stay.
    constexpr double kOfCuts = 2e-5;
    const bool slow = had_adapted && e > std::max(0.9 * last_error, kOfCuts);
    const bool useless = slow && !renewed && !maker.floods() && (e > last_error || was_slow) && pass < most_passes;
    was_slow = slow;
    if (maker.adapted() && (useless || maker.spoilt())) {
      maker.make_anew({solved.q, solved.price});
      e = problem.error(maker.moments());
    }
    if (e < result.as_built_error) {
      result.as_built_error = e;
      best_correction = correction;
      keep(maker.made(), solved, result);
    }
    if (result.as_built_error <= problem.tolerance) break;
    // Meshed, and not much nearer than before (in the first pass 2 %): the cavities are too thin for this grid.
    const bool stuck = !maker.adapted() && e > std::max(1e-3, 0.2 * last_error);
    last_error = e;
    if (stuck && maker.refine()) {
      start_anew(pass);
      continue;
    }
    correction = way.next(correction, correction + maker.moments() - solved.model, e, maker.adapted());
  }
  return best_correction;
}

}  // namespace rayrep::detail
