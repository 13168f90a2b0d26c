#include "make/centre_reach.h"

#include <algorithm>
#include <cmath>

#include "base/nonnegative.h"
#include "base/rotation.h"

namespace rayrep::detail {
namespace {

constexpr double kEdge = 0.02;  ///< of the way from the middle: so near to the edge nothing is left to correct a mesh with

}  // namespace

Eigen::Vector3d middling_centre(const RayIntegrals& rays, const Moments& constant) {
  // Half of a scarce core may be more than there is.
  const bool scarce = 0.5 * rays.full()[M1] > rays.grid().most_mm3;
  const Moments half = scarce ? constant : Moments(constant + 0.5 * rays.full());
  return half.segment<3>(MX) / half[M1];
}

CentreReach::CentreReach(const RayIntegrals& rays, const Moments& constant)
    : search_(rays, constant), middle_(middling_centre(rays, constant)) {
  const Moments full = constant + rays.full();
  const Eigen::Vector3d centre = full.segment<3>(MX) / full[M1];
  length_mm_ = std::sqrt(std::max(full.segment<3>(MXX).sum() / full[M1] - centre.squaredNorm(), 1e-12));
  found_ = {middle_};
  for (const Eigen::Vector3d& direction : cube_directions()) look(direction.normalized());
}

double CentreReach::size_mm() const {
  double size = 0;
  for (const Eigen::Vector3d& c : found_) size = std::max(size, (c - middle_).norm());
  return size;
}

void CentreReach::look(const Eigen::Vector3d& direction) {
  CentreProblem farthest;
  CentreProblem::Row rise, run;
  const Eigen::Vector3d along = direction.normalized();
  rise << -along.dot(middle_), along;
  run << length_mm_, 0, 0, 0;
  farthest.ratios = {{rise, run}};
  const SafestCentre best = search_.solve(farthest);
  if (best.attainable) found_.push_back(best.centre_mm);
}

/// The mixture of those that were found whose misses, a column for each, mix to the least.
Eigen::Vector3d CentreReach::mixed(const Eigen::MatrixXd& misses) const {
  // As in CentreSearch: the weights that make |misses w|^2 + (sum of w - 1)^2 least are, over their sum, those of the mixture.
  Eigen::MatrixXd A(misses.rows() + 1, misses.cols());
  A << misses / std::max(misses.cwiseAbs().maxCoeff(), 1e-300), Eigen::RowVectorXd::Ones(misses.cols());
  Eigen::VectorXd b = Eigen::VectorXd::Zero(A.rows());
  b[misses.rows()] = 1;
  const Eigen::VectorXd weights = nonnegative_least_squares(A, b);
  Eigen::Vector3d centre = Eigen::Vector3d::Zero();
  for (std::size_t k = 0; k < found_.size(); ++k) centre += weights[static_cast<Eigen::Index>(k)] * found_[k];
  return centre / weights.sum();
}

Eigen::Vector3d CentreReach::nearest(const Eigen::Vector3d& place) const {
  return least(Eigen::Matrix3d::Identity(), -place, place);
}

Eigen::Vector3d CentreReach::least(const Eigen::MatrixXd& J, const Eigen::VectorXd& b, const Eigen::Vector3d& from) const {
  const double stay = 1e-3 * J.norm();
  Eigen::MatrixXd misses(J.rows() + 3, static_cast<Eigen::Index>(found_.size()));
  for (std::size_t k = 0; k < found_.size(); ++k)
    misses.col(static_cast<Eigen::Index>(k)) << J * found_[k] + b, stay * (found_[k] - from);
  return mixed(misses);
}

std::optional<Eigen::Vector3d> CentreReach::outward(const Eigen::Vector3d& centre) {
  const Eigen::Vector3d beyond = centre + kEdge * (centre - middle_);
  const double small = 1e-3 * kEdge * size_mm();
  Eigen::Vector3d normal = beyond - nearest(beyond);
  for (int n = 0; n < 8 && normal.norm() > small; ++n) {
    look(normal);
    normal = beyond - nearest(beyond);
  }
  if (normal.norm() <= small) return std::nullopt;
  return normal.normalized();
}

}  // namespace rayrep::detail
