// Apart from linear_algebra.cpp: the two compile side by side.
#include <Eigen/QR>

#include "base/linear_algebra.h"

namespace rayrep {

Eigen::VectorXd least_squares(const Eigen::MatrixXd& A, const Eigen::VectorXd& b) {
  return A.completeOrthogonalDecomposition().solve(b);
}

Eigen::VectorXd least_squares_transposed(const Eigen::MatrixXd& A, const Eigen::VectorXd& b) {
  return least_squares(A.transpose(), b);
}

Eigen::MatrixXd orthogonal_completion(const Eigen::MatrixXd& A) { return A.householderQr().householderQ(); }

}  // namespace rayrep
