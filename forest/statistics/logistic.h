// SPDX-License-Identifier: Apache-2.0
// Logistic regression with a ridge: least sum of log(1 + exp(-y f)) + ridge / 2 |w|² for f = w·x + b, by Newton's steps
// (iteratively reweighted least squares). There are more features than cells, so it is solved for the cells: w is a sum
// of their rows, and only their inner products are needed.
#pragma once

#include <cstdint>
#include <span>

#include <Eigen/Core>

namespace forest::statistics {

struct LogisticFit {
  Eigen::VectorXd cells;  // w = Xᵀ cells
  double intercept = 0.;
};

/// @param products  inner products X Xᵀ of the rows to fit
/// @param second    of every row, whether it is of the second kind
/// @param ridge     > 0; scikit-learn's C is 1 / ridge
LogisticFit fit_logistic(const Eigen::MatrixXd& products, std::span<const std::uint8_t> second, double ridge);

}  // namespace forest::statistics
