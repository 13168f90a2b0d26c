#pragma once

#include <Eigen/Core>
#include <string>

#include "rayrep/base/progress.h"
#include "rayrep/solve/nlp.h"

namespace rayrep {

/// How the inside is discretised and solved.
enum class Solver {
  quadric,  ///< exact on the rays: the ends eliminated in closed form, see quadric.h
  rays,     ///< the ray-reps paper: Ipopt over the ends of each interval
  voxels,   ///< the paper's comparison: Ipopt over the fill fractions of uniform voxels, one ray spacing wide
  octree    ///< Spin-It's: the same over an adaptive octree
};

inline constexpr const char* kSolverNames[] = {"quadric", "rays", "voxels", "octree"};

/// What is known after a solve.
enum class SolveStatus {
  not_run,          ///< no solver was called; no other field means anything
  converged,        ///< the KKT conditions hold to SolveOptions::tolerance; x is a (local) minimum
  infeasible,       ///< the solver found no point that satisfies the constraints; x violates them least, locally
  iteration_limit,  ///< stopped at SolveOptions::max_iterations; x is the last iterate, of unknown quality
  failed,           ///< numerical trouble, named in SolveReport::solver_status; x is the last iterate
};

inline constexpr const char* kSolveStatusNames[] = {"not_run", "converged", "infeasible", "iteration_limit", "failed"};

struct SolveOptions {
  /// Scaled KKT error at which to stop. Smaller costs an iteration per decade.
  double tolerance = 1e-9;
  int max_iterations = 500;
  /// Where the barrier parameter stops. 0 goes to the optimum itself. A small positive value stays on the central path, which is
  /// what programmes with flat optima need to converge at all; the objective is then off by about this times the number of bounds.
  double barrier_target = 0;
  /// For programmes that are not quadratic: how the barrier parameter goes down. Adaptive takes a third of the iterations on most
  /// spin problems, monotone converges on some where it does not.
  bool adaptive_barrier = true;
  /// How an adaptive barrier parameter is chosen: by Mehrotra's probing, or by Ipopt's quality function. Measured on spin problems:
  /// fill fractions and convex pairs (SegmentRays) take less time with probing, the ends of segments between the paper's bounds up
  /// to several times more.
  bool probing = false;
  /// Part of the way to the nearest bound that a step may take at least, below 1. Convex pairs take fewer iterations with 0.9.
  double least_fraction_to_bound = 0.99;
};

struct SolveReport {
  SolveStatus status = SolveStatus::not_run;
  std::string solver;         ///< "rays (Ipopt)", "quadric"
  std::string solver_status;  ///< in the solver's own words, e.g. "Solve_Succeeded"
  int iterations = 0;
  Eigen::Index variables = 0;
  double objective = 0;             ///< of the Nlp, which may be scaled: see nlp.h
  double constraint_violation = 0;  ///< largest |c_i| of the Nlp
  Eigen::VectorXd x;
  Eigen::VectorXd multipliers;  ///< of the constraints: gradient(f) + J^T mu + bound multipliers = 0
};

/// Solves with Ipopt (interior point, exact derivatives, MUMPS). One solve at a time in a process: MUMPS is not reentrant, so
/// concurrent calls wait for each other. Reads no options file.
/// @throws Error{interrupted} within an iteration of Progress::cancelled returning true; exceptions of `nlp` pass through
SolveReport solve_ipopt(const Nlp& nlp, const SolveOptions& options = {}, const Progress& progress = {});

}  // namespace rayrep
