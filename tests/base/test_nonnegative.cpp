#include <gtest/gtest.h>

#include "base/linear_algebra.h"
#include "base/nonnegative.h"
#include "solids.h"

namespace rayrep {
namespace {

Eigen::MatrixXd random_matrix(test::Random& random, Eigen::Index rows, Eigen::Index cols) {
  Eigen::MatrixXd A(rows, cols);
  for (Eigen::Index i = 0; i < A.size(); ++i) A(i) = random.uniform(-1, 1);
  return A;
}

/// The best over all sets of unknowns that may differ from 0.
double least_by_trying_all(const Eigen::MatrixXd& A, const Eigen::VectorXd& b) {
  double least = b.norm();
  for (unsigned set = 1; set < 1u << A.cols(); ++set) {
    Eigen::MatrixXd part = A;
    for (Eigen::Index k = 0; k < A.cols(); ++k)
      if (!(set >> k & 1)) part.col(k).setZero();
    const Eigen::VectorXd x = least_squares(part, b);
    if (x.minCoeff() >= -1e-12) least = std::min(least, (part * x - b).norm());
  }
  return least;
}

TEST(NonnegativeLeastSquares, IsTheBestOfAllSets) {
  test::Random random(11);
  int with_zeros = 0;
  for (int n = 0; n < 60; ++n) {
    const Eigen::Index rows = 1 + n % 6;
    const Eigen::Index cols = 1 + (n / 6) % 6;
    const Eigen::MatrixXd A = random_matrix(random, rows, cols);
    const Eigen::VectorXd b = random_matrix(random, rows, 1);
    const Eigen::VectorXd x = nonnegative_least_squares(A, b);
    EXPECT_GE(x.minCoeff(), 0);
    EXPECT_NEAR((A * x - b).norm(), least_by_trying_all(A, b), 1e-10) << n;
    with_zeros += x.minCoeff() == 0;
  }
  EXPECT_GT(with_zeros, 20);
}

TEST(NonnegativeLeastSquares, TakesColumnsThatDependOnEachOther) {
  test::Random random(12);
  const Eigen::MatrixXd A = random_matrix(random, 5, 2) * random_matrix(random, 2, 9);
  const Eigen::VectorXd b = A * random_matrix(random, 9, 1).cwiseAbs();
  const Eigen::VectorXd x = nonnegative_least_squares(A, b);
  EXPECT_GE(x.minCoeff(), 0);
  EXPECT_LT((A * x - b).norm(), 1e-9);
}

}  // namespace
}  // namespace rayrep
