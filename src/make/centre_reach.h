#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "solve/safest_centre.h"

namespace rayrep::detail {

/// The centre of mass of the inside half full everywhere, well within what insides can have; with a scarce core of none of it.
Eigen::Vector3d middling_centre(const RayIntegrals& rays, const Moments& constant);

/// The centres of mass that insides can have, a convex set: known as the hull of those that were found by looking, which lies
/// within.
class CentreReach {
public:
  /// Looks in 26 directions. @param constant  moments of the rest of the body. Keeps a reference to the rays.
  CentreReach(const RayIntegrals& rays, const Moments& constant);

  const Eigen::Vector3d& middle() const { return middle_; }  ///< middling_centre
  const std::vector<Eigen::Vector3d>& found() const { return found_; }
  double size_mm() const;  ///< the largest distance of one that was found from the middle

  /// Finds the one that is farthest along a direction.
  void look(const Eigen::Vector3d& direction);

  Eigen::Vector3d nearest(const Eigen::Vector3d& place) const;
  /// Where |J c + b| is least; of several such places one near `from`.
  Eigen::Vector3d least(const Eigen::MatrixXd& J, const Eigen::VectorXd& b, const Eigen::Vector3d& from) const;
  /// The outward normal at one that lies at the edge; none: within.
  std::optional<Eigen::Vector3d> outward(const Eigen::Vector3d& centre);

private:
  Eigen::Vector3d mixed(const Eigen::MatrixXd& misses) const;

  CentreSearch search_;
  Eigen::Vector3d middle_;
  double length_mm_;
  std::vector<Eigen::Vector3d> found_;
};

}  // namespace rayrep::detail
