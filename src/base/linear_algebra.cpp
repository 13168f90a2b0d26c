#include "base/linear_algebra.h"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <Eigen/LU>

namespace rayrep {

Eigen::MatrixXd product(const Eigen::MatrixXd& A, const Eigen::MatrixXd& B) { return A * B; }

Eigen::MatrixXd congruence(const Eigen::MatrixXd& A, const Eigen::Matrix<double, 10, 10>& M) { return A * M * A.transpose(); }

Eigen::MatrixXd restricted(const Eigen::Matrix<double, 10, 10>& M, const Eigen::MatrixXd& A) { return A.transpose() * M * A; }

Eigen::VectorXd solve_symmetric(const Eigen::MatrixXd& A, const Eigen::VectorXd& b) { return A.ldlt().solve(b); }

Eigen::VectorXd solve_square(const Eigen::MatrixXd& A, const Eigen::VectorXd& b) { return A.fullPivLu().solve(b); }

Eigen::MatrixXd kernel(const Eigen::MatrixXd& A) { return A.fullPivLu().kernel(); }

Eigen::VectorXd symmetric_eigenvalues(const Eigen::MatrixXd& A) {
  return Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd>(A, Eigen::EigenvaluesOnly).eigenvalues();
}

SymmetricEigen symmetric_eigen(const Eigen::MatrixXd& A) {
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen(A);
  return {eigen.eigenvalues(), eigen.eigenvectors()};
}

}  // namespace rayrep
