#pragma once

#include <Eigen/Core>

#include "rayrep/physics/moments.h"
#include "rayrep/rays/ray_integrals.h"

namespace rayrep::detail {

/// What is wanted of the ten moments s of a whole body: the first of the values rows s + offset are to be 0, the others at most 0;
/// or the last three, a, b and c, are a symmetric matrix ((a, c / root 2), (c / root 2, b)) that has no positive eigenvalue. Scaled
/// so that values near 1 matter.
struct Wanted {
  Eigen::Matrix<double, Eigen::Dynamic, 10> rows;
  Eigen::VectorXd offset;
  Eigen::Index equations = 0;
  bool matrix = false;

  Eigen::Index inequalities() const { return rows.rows() - equations - (matrix ? 3 : 0); }
  Eigen::VectorXd values(const Moments& s) const { return rows * s + offset; }
};

/// How much all interiors on the rays fall short of it.
struct Shortfall {
  double distance = 0;                ///< of the values from what is wanted, for the interior that comes nearest
  Eigen::VectorXd normal;             ///< of length 1, pointing at it: no interior has less of normal . values
  Moments moments = Moments::Zero();  ///< of the whole body that comes nearest; a mixture of interiors
};

/// Wolfe's method (see nearest_attainable) for a convex set plus the cone of what inequalities and matrix leave open, which may be
/// added to it. theory.md (61)
/// @param tolerance  distances below it count as 0: then nothing is said of `normal`
Shortfall shortfall(const Wanted& wanted, const RayIntegrals& rays, const Moments& constant, double tolerance);

/// min over all interiors of normal . values, and the moments of the whole body that has it.
struct Support {
  double value = 0;
  Moments moments = Moments::Zero();
};
Support support(const Wanted& wanted, const Eigen::VectorXd& normal, const RayIntegrals& rays, const Moments& constant);

}  // namespace rayrep::detail
