#pragma once

#include <optional>

#include "rayrep/base/progress.h"
#include "rayrep/rays/ray_integrals.h"
#include "rayrep/rays/ray_rep.h"
#include "rayrep/solve/goals.h"
#include "rayrep/solve/quadric.h"

namespace rayrep {

/// The spin problem for a largest axis, as for spin_goal, that certify_spin can bound: lambda c_z / L + gamma_i R.
struct CertifiedSpin {
  double lambda = 0.1;
  double gamma_i = 1;
  bool yoyo = false;
  std::optional<double> material_mm3 = {};  ///< of a top: the volume of material that it shall have
  double volume_mm3 = 1;                    ///< V
  double length_mm = 1;                     ///< L
};

struct CertifyOptions {
  /// In which the centre of mass of every interior lies, e.g. those of the body. Of no account for a yo-yo.
  Interval heights;
  bool within = false;   ///< interiors with their centre of mass beyond the heights do not count, theory.md (75)
  double gap = 1e-4;     ///< relative, at which to stop
  int max_nodes = 2000;  ///< heights at which to solve
};

/// What is known of the global optimum.
struct SpinCertificate {
  bool closed = false;      ///< the gap was reached
  bool infeasible = false;  ///< proven: no interior on these rays meets the constraints
  double lower_bound = 0;   ///< proven: no interior on these rays, of any number of segments or fractional density, does better
  QuadricSolution best;     ///< the best interior found, converged; its objective is an upper bound
  double gap = 0;           ///< (best.objective - lower_bound) / best.objective
  int nodes = 0;            ///< heights at which the problem was solved
  int evaluations = 0;      ///< passes over the rays
};

/// What one solve proves of a range of heights of the centre of mass.
struct HeightBound {
  Interval heights;  ///< the part of the range that is not ruled out; empty when none is attainable
  double bound = 0;  ///< no interior with its centre of mass in `heights` does better; -infinity when nothing is known
};

/// Solves the problem with the centre of mass at the height l, for a top, and bounds the heights from l to `end`. theory.md (32a),
/// (32b)
HeightBound bound_heights(const CertifiedSpin& problem, const RayIntegrals& rays, const Moments& constant, double l, double end);

/// Finds and proves the global optimum of the spin problem by branch and bound over the height l of the centre of mass. With it
/// fixed the problem is quasiconvex, so that a stationary point is its optimum, and its multipliers bound the objective for all
/// heights in an interval around it. theory.md (32)
/// @param constant  moments of the rest of the body
/// @throws Error{interrupted}
SpinCertificate certify_spin(const CertifiedSpin& problem, const RayIntegrals& rays, const Moments& constant,
                             const CertifyOptions& options, const Progress& progress = {});

}  // namespace rayrep
