#pragma once

#include <Eigen/Core>

namespace rayrep {

// Products and decompositions of small dense matrices by Eigen, each compiled once: they take seconds wherever they are used.

/// A B.
Eigen::MatrixXd product(const Eigen::MatrixXd& A, const Eigen::MatrixXd& B);
/// A M A^T for A with ten columns.
Eigen::MatrixXd congruence(const Eigen::MatrixXd& A, const Eigen::Matrix<double, 10, 10>& M);
/// A^T M A for A with ten rows: M on the space that the columns of A span.
Eigen::MatrixXd restricted(const Eigen::Matrix<double, 10, 10>& M, const Eigen::MatrixXd& A);

/// A^-1 b for a symmetric A (its lower triangle is read), by L D L^T with pivoting.
Eigen::VectorXd solve_symmetric(const Eigen::MatrixXd& A, const Eigen::VectorXd& b);

/// A^-1 b for a square A, by LU with full pivoting. Where A is singular: one of the x with A x = b, if there is one (not checked).
Eigen::VectorXd solve_square(const Eigen::MatrixXd& A, const Eigen::VectorXd& b);

/// Columns: a basis of { x : A x = 0 }, not orthogonal; a single column of zeros where that is only 0.
Eigen::MatrixXd kernel(const Eigen::MatrixXd& A);

/// The shortest x of all that make |A x - b| least.
Eigen::VectorXd least_squares(const Eigen::MatrixXd& A, const Eigen::VectorXd& b);
/// The same for A^T x = b.
Eigen::VectorXd least_squares_transposed(const Eigen::MatrixXd& A, const Eigen::VectorXd& b);

/// Ascending, of a symmetric A (its lower triangle is read).
Eigen::VectorXd symmetric_eigenvalues(const Eigen::MatrixXd& A);
struct SymmetricEigen {
  Eigen::VectorXd values;   ///< ascending
  Eigen::MatrixXd vectors;  ///< columns, orthonormal
};
SymmetricEigen symmetric_eigen(const Eigen::MatrixXd& A);

/// An orthogonal square matrix whose first columns span those of A (n x m, m <= n, of rank m), in their order.
Eigen::MatrixXd orthogonal_completion(const Eigen::MatrixXd& A);

}  // namespace rayrep
