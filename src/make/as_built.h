#pragma once

#include <functional>

#include "make/maker.h"
#include "rayrep/base/error.h"
#include "rayrep/base/progress.h"
#include "rayrep/make/hollow.h"
#include "solve/interior_solver.h"

namespace rayrep::detail {

/// What the as-built loop needs to know.
struct AsBuilt {
  Moments shell;  ///< of everything outside the inner domain
  Moments unit;   ///< of each moment
  /// Of a body with these moments, to compare with HollowOptions::as_built_tolerance.
  std::function<double(const Moments&)> error;
  Moments start;   ///< correction of the constant part to begin with, from a neighbouring problem
  int max_passes;  ///< see HollowOptions
  double tolerance;
};

/// Of a solver that did not converge.
Error unsolved(const SolveReport& report);

/// Solves and makes until what is made meets the goal itself: what it has more than the model is added to the model's constant
/// part. theory.md (16d). Fills in what `result` says of delivery, solve and passes.
/// @returns the correction of the constant part that led to what is delivered
/// @throws Error{solver} when the first pass does not converge
Moments solve_as_built(const AsBuilt& problem, InteriorSolver solver, Maker& maker, HollowResult& result, const Progress& progress);

}  // namespace rayrep::detail
