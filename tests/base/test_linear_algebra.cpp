#include <gtest/gtest.h>

#include "base/linear_algebra.h"
#include "base/rotation.h"
#include "solids.h"

namespace rayrep {
namespace {

Eigen::MatrixXd random_matrix(test::Random& random, Eigen::Index rows, Eigen::Index cols) {
  Eigen::MatrixXd A(rows, cols);
  for (Eigen::Index i = 0; i < A.size(); ++i) A(i) = random.uniform(-1, 1);
  return A;
}

TEST(LinearAlgebra, SolutionsSolve) {
  test::Random random(1);
  for (const Eigen::Index n : {1, 2, 5, 15}) {
    const Eigen::MatrixXd A = random_matrix(random, n, n);
    const Eigen::VectorXd b = random_matrix(random, n, 1);
    EXPECT_LT((A * solve_square(A, b) - b).norm(), 1e-10) << n;
    const Eigen::MatrixXd S = A * A.transpose() + Eigen::MatrixXd::Identity(n, n);
    EXPECT_LT((S * solve_symmetric(S, b) - b).norm(), 1e-12) << n;
  }
}

TEST(LinearAlgebra, TheKernelIsAllThatVanishes) {
  test::Random random(2);
  const Eigen::MatrixXd A = random_matrix(random, 4, 3) * random_matrix(random, 3, 10);
  const Eigen::MatrixXd N = kernel(A);
  ASSERT_EQ(N.cols(), 7);
  EXPECT_LT((A * N).norm(), 1e-12);
  EXPECT_GT(symmetric_eigenvalues(N.transpose() * N)[0], 1e-6);  // independent
  EXPECT_TRUE(kernel(Eigen::MatrixXd::Identity(3, 3)).isZero(0));
}

TEST(LinearAlgebra, LeastSquaresLeaveWhatIsAcrossAndAreShortest) {
  test::Random random(3);
  // More equations than unknowns, fewer, and neither of full rank.
  for (const auto& [rows, cols] : {std::pair<Eigen::Index, Eigen::Index>{10, 3}, {3, 10}, {6, 6}}) {
    const Eigen::MatrixXd A = random_matrix(random, rows, 2) * random_matrix(random, 2, cols);
    const Eigen::VectorXd b = random_matrix(random, rows, 1);
    const Eigen::VectorXd x = least_squares(A, b);
    EXPECT_LT((A.transpose() * (A * x - b)).norm(), 1e-12);
    EXPECT_LT((kernel(A).transpose() * x).norm(), 1e-11);
    EXPECT_LT((least_squares_transposed(A.transpose(), b) - x).norm(), 1e-11);
  }
}

TEST(LinearAlgebra, EigenvectorsDiagonalise) {
  test::Random random(4);
  for (const Eigen::Index n : {1, 2, 5, 9}) {
    const Eigen::MatrixXd B = random_matrix(random, n, n);
    const Eigen::MatrixXd A = B + B.transpose();
    const SymmetricEigen eigen = symmetric_eigen(A);
    EXPECT_LT((A * eigen.vectors - eigen.vectors * eigen.values.asDiagonal()).norm(), 1e-12);
    EXPECT_LT((eigen.vectors.transpose() * eigen.vectors - Eigen::MatrixXd::Identity(n, n)).norm(), 1e-12);
    EXPECT_LT((symmetric_eigenvalues(A) - eigen.values).norm(), 1e-12);
    for (Eigen::Index k = 1; k < n; ++k) EXPECT_LE(eigen.values[k - 1], eigen.values[k]);
  }
}

TEST(LinearAlgebra, TheCompletionIsOrthogonalAndKeepsTheSpan) {
  test::Random random(5);
  const Eigen::MatrixXd A = random_matrix(random, 10, 4);
  const Eigen::MatrixXd Q = orthogonal_completion(A);
  EXPECT_LT((Q.transpose() * Q - Eigen::MatrixXd::Identity(10, 10)).norm(), 1e-13);
  for (Eigen::Index k = 1; k <= 4; ++k) EXPECT_LT((Q.rightCols(10 - k).transpose() * A.leftCols(k)).norm(), 1e-13);
}

TEST(LinearAlgebra, ProductsAreSumsOfProducts) {
  test::Random random(6);
  const Eigen::MatrixXd A = random_matrix(random, 3, 10);
  const Eigen::Matrix<double, 10, 10> M = random_matrix(random, 10, 10);
  const Eigen::MatrixXd AM = product(A, M);
  const Eigen::MatrixXd C = congruence(A, M);
  const Eigen::MatrixXd R = restricted(M, A.transpose());
  for (Eigen::Index i = 0; i < 3; ++i) {
    for (Eigen::Index j = 0; j < 10; ++j) EXPECT_NEAR(AM(i, j), A.row(i).dot(M.col(j)), 1e-13);
    for (Eigen::Index j = 0; j < 3; ++j) EXPECT_NEAR(C(i, j), AM.row(i).dot(A.row(j)), 1e-13);
  }
  EXPECT_LT((R - C).norm(), 1e-13);
}

TEST(Rotation, TakesOneDirectionToTheOtherByTheSmallestAngle) {
  test::Random random(7);
  for (int n = 0; n < 100; ++n) {
    const Eigen::Vector3d from = random.in_box(2);
    const Eigen::Vector3d to = n % 10 == 0 ? Eigen::Vector3d(-0.5 * from) : random.in_box(2);
    const Eigen::Matrix3d R = rotation_between(from, to).toRotationMatrix();
    EXPECT_LT((R * from.normalized() - to.normalized()).norm(), 1e-7);
    EXPECT_LT((R.transpose() * R - Eigen::Matrix3d::Identity()).norm(), 1e-12);
    const double angle = std::acos(std::clamp(from.normalized().dot(to.normalized()), -1.0, 1.0));
    EXPECT_NEAR(std::acos(std::clamp(0.5 * (R.trace() - 1), -1.0, 1.0)), angle, 1e-6);
  }
}

}  // namespace
}  // namespace rayrep
