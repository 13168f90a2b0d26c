#pragma once

#include <optional>

#include "rayrep/base/progress.h"
#include "rayrep/rays/ray_integrals.h"
#include "rayrep/rays/ray_interior.h"
#include "rayrep/solve/goals.h"
#include "rayrep/solve/nlp.h"
#include "rayrep/solve/quadric.h"
#include "rayrep/solve/solve.h"

namespace rayrep {

/// One discretisation of an inner domain with its solver, for the passes of the as-built loop.
class InteriorSolver {
public:
  struct Setup {
    Solver solver = Solver::quadric;
    /// With Solver::rays: two ends for each interval, else one and material at the bottom.
    bool segments = false;
    SegmentBounds bounds = SegmentBounds::complete;
    Between between = Between::material;
    double start_fill = 0.5;  ///< of the Ipopt solvers
    InteriorNlp::Scale scale;
    SolveOptions options;  ///< of Ipopt
    QuadricOptions warm;   ///< where the quadric solver starts
  };
  struct Solved {
    SolveReport report;               ///< with Solver::rays x holds z1, or z0, z1, of each interval
    Moments q = Moments::Zero();      ///< switching function: cavity where q.phi > 0
    double price = 0;                 ///< see QuadricSolution
    Moments model = Moments::Zero();  ///< moments of the whole body as the solver sees it
  };

  /// Keeps references to `goal`, `domain` and `integrals`, which belong together.
  InteriorSolver(const Goal& goal, const RayRep& domain, const RayIntegrals& integrals, const Setup& setup)
      : goal_(goal), domain_(domain), integrals_(integrals), setup_(setup), warm_(setup.warm) {}

  /// @param constant  moments of the rest of the body. From the second call on the quadric solver starts from the last solution,
  /// and voxels and octree keep their switching function but for multiples of the constraints, which brings it to the new constant:
  /// their own solution, at a vertex, would jump from cell to cell.
  Solved solve(const Moments& constant, const Progress& progress);

private:
  Solved solve_quadric(const Moments& constant);
  Solved solve_interior(const Interior& interior, const Moments& constant, const Progress& progress) const;
  Solved solve_segments(const Moments& constant, const Progress& progress) const;
  Solved solve_octree(const Moments& constant, const Progress& progress) const;
  Solved adjusted(const Solved& cells, const Moments& constant) const;

  const Goal& goal_;
  const RayRep& domain_;
  const RayIntegrals& integrals_;
  Setup setup_;
  QuadricOptions warm_;
  std::optional<Solved> cells_;  ///< the first solution on voxels or the octree
};

}  // namespace rayrep
