#include "base/nonnegative.h"

#include <algorithm>
#include <vector>

#include "base/linear_algebra.h"

namespace rayrep {
namespace {

/// Which unknowns may differ from 0.
class FreeSet {
public:
  explicit FreeSet(Eigen::Index size) : is_free_(static_cast<std::size_t>(size), false) {}

  bool contains(Eigen::Index k) const { return is_free_[static_cast<std::size_t>(k)]; }
  void set(Eigen::Index k, bool free) { is_free_[static_cast<std::size_t>(k)] = free; }

  /// Least squares in them alone.
  Eigen::VectorXd solve(const Eigen::MatrixXd& A, const Eigen::VectorXd& b) const {
    std::vector<Eigen::Index> columns;
    for (Eigen::Index k = 0; k < A.cols(); ++k)
      if (contains(k)) columns.push_back(k);
    Eigen::MatrixXd part(A.rows(), static_cast<Eigen::Index>(columns.size()));
    for (std::size_t n = 0; n < columns.size(); ++n) part.col(static_cast<Eigen::Index>(n)) = A.col(columns[n]);
    const Eigen::VectorXd x = least_squares(part, b);
    Eigen::VectorXd all = Eigen::VectorXd::Zero(A.cols());
    for (std::size_t n = 0; n < columns.size(); ++n) all[columns[n]] = x[static_cast<Eigen::Index>(n)];
    return all;
  }

private:
  std::vector<bool> is_free_;
};

/// Goes from x towards the least squares of the free unknowns, and fixes those at 0 that would become negative on the way.
void descend(const Eigen::MatrixXd& A, const Eigen::VectorXd& b, FreeSet& free, Eigen::VectorXd& x) {
  for (;;) {
    const Eigen::VectorXd z = free.solve(A, b);
    double step = 1;
    for (Eigen::Index k = 0; k < x.size(); ++k)
      if (free.contains(k) && z[k] <= 0) step = std::min(step, x[k] / std::max(x[k] - z[k], 1e-300));
    if (step == 1) {
      x = z;
      return;
    }
    x += step * (z - x);
    for (Eigen::Index k = 0; k < x.size(); ++k)
      if (free.contains(k) && z[k] <= 0 && x[k] <= 1e-13) {
        free.set(k, false);
        x[k] = 0;
      }
  }
}

}  // namespace

Eigen::VectorXd nonnegative_least_squares(const Eigen::MatrixXd& A, const Eigen::VectorXd& b) {
  Eigen::VectorXd x = Eigen::VectorXd::Zero(A.cols());
  FreeSet free(A.cols());
  std::vector<bool> vain(static_cast<std::size_t>(A.cols()), false);  // freed, and at 0 again at once: rounding
  const Eigen::VectorXd lengths = A.colwise().norm();
  for (Eigen::Index round = 0; round < 3 * A.cols() + 30; ++round) {
    const Eigen::VectorXd left = b - A * x;
    const Eigen::VectorXd downhill = A.transpose() * left;
    Eigen::Index steepest = -1;
    for (Eigen::Index k = 0; k < A.cols(); ++k) {
      const bool worth = downhill[k] > lengths[k] * (1e-10 * left.norm() + 1e-16 * b.norm());
      if (!free.contains(k) && !vain[static_cast<std::size_t>(k)] && worth && (steepest < 0 || downhill[k] > downhill[steepest]))
        steepest = k;
    }
    if (steepest < 0) break;
    free.set(steepest, true);
    descend(A, b, free, x);
    if (free.contains(steepest))
      std::fill(vain.begin(), vain.end(), false);
    else
      vain[static_cast<std::size_t>(steepest)] = true;
  }
  return x;
}

}  // namespace rayrep
