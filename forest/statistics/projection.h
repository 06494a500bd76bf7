// SPDX-License-Identifier: Apache-2.0
// Cells in few dimensions: principal components of standardised features (Pearson 1901).
#pragma once

#include <Eigen/Core>

namespace forest::statistics {

struct Projection {
  Eigen::MatrixXd scores;    // cells × components, of falling variance
  Eigen::VectorXd shares;    // of the whole variance, one a component
  Eigen::MatrixXd loadings;  // features × components, orthonormal; the largest of each is positive
};

/// So many components as hold `share` of the variance, at most `most`.
Projection principal_components(const Eigen::MatrixXd& standardised, double share, Eigen::Index most);

}  // namespace forest::statistics
