#pragma once

#include <Eigen/Core>

namespace rayrep {

/// The x >= 0 that makes |A x - b| least, by Lawson and Hanson's active set method; one of them where there are several.
Eigen::VectorXd nonnegative_least_squares(const Eigen::MatrixXd& A, const Eigen::VectorXd& b);

}  // namespace rayrep
