#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "rayrep/rays/ray_integrals.h"

namespace rayrep::detail {

/// What is asked of a centre of mass c. A row (a_0, a) stands for a_0 + a.c, in mm.
struct CentreProblem {
  using Row = Eigen::Vector4d;
  struct Ratio {
    Row rise;
    Row run;  ///< positive for every body (not checked)
  };
  std::vector<Ratio> ratios;         ///< at least one; the smallest rise / run shall be as large as it can be
  std::vector<Row> at_most;          ///< at most 0
  std::vector<Row> level;            ///< 0
  std::optional<double> volume_mm3;  ///< of material

  /// The smallest ratio at a centre.
  double smallest_ratio(const Eigen::Vector3d& centre_mm) const;
};

/// The best centre of mass that some interior has.
struct SafestCentre {
  bool attainable = false;  ///< some interior meets all that is at most 0 or 0, and the volume, to 1e-9 of the body's size
  /// If attainable, of the best; else of the one that comes nearest, in the sense of mass times distance.
  Eigen::Vector3d centre_mm = Eigen::Vector3d::Zero();
  double ratio = 0;  ///< its smallest ratio
  double bound = 0;  ///< proven: no interior on the rays that is attainable has a larger one
  /// Upward normal of the plane below which the best interior is filled, relative to the steepest row that takes part in it: nearly
  /// 0 where the ratios alone stand against each other, and the centre is not at the edge of what is attainable.
  Eigen::Vector3d slope = Eigen::Vector3d::Zero();
};

/// Finds it on one set of rays, for any number of problems: what it learns of the attainable centres serves the next.
class CentreSearch {
public:
  /// @param constant  moments of the rest of the body. Keeps a reference to the rays.
  CentreSearch(const RayIntegrals& rays, const Moments& constant);

  /// The smallest of several ratios of linear functions of (m, m c) is quasiconcave, and what is attainable of these four numbers
  /// is convex, with a linear oracle: the interior below a plane. From a ratio that is out of reach it comes down: the point of the
  /// interiors found so far that misses it least (Wolfe) gives a plane; while the interior below that plane misses it by less, that
  /// one joins them; once it does not, the plane separates, and the largest ratio that it leaves is a proven bound and the next to
  /// be tried. theory.md (66)
  SafestCentre solve(const CentreProblem& problem);

  int evaluations() const { return evaluations_; }  ///< passes over the rays

private:
  struct Rows;
  struct Nearest;
  Eigen::Vector4d minimiser(const Eigen::Vector4d& q);
  Nearest nearest(const Rows& rows, std::vector<Eigen::Index>& working) const;
  Nearest separated(const Rows& rows);
  double ratio_left_by(const Nearest& point, const Rows& rows, double ratio);

  const RayIntegrals& rays_;
  Moments constant_;
  Eigen::Vector4d unit_;  ///< of (m, m c), mm^3 and mm^4
  double length_mm_;
  std::vector<Eigen::Vector4d> found_;  ///< attainable (m, m c), over the unit
  int evaluations_ = 0;
};

}  // namespace rayrep::detail
