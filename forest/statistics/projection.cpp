// SPDX-License-Identifier: Apache-2.0
#include "forest/statistics/projection.h"

#include <algorithm>
#include <cmath>

#include <Eigen/Eigenvalues>

namespace forest::statistics {

Projection principal_components(const Eigen::MatrixXd& X, double share, Eigen::Index most) {
  Projection p;
  if (X.rows() == 0 || X.cols() == 0) return {Eigen::MatrixXd(X.rows(), 0), {}, Eigen::MatrixXd(X.cols(), 0)};
  // Of cells or of features, whichever are fewer; the components are the same.
  const bool by_cells = X.rows() <= X.cols();
  const Eigen::MatrixXd S =
      by_cells ? Eigen::MatrixXd(X * X.transpose()) : Eigen::MatrixXd(X.transpose() * X);
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> solver(S);
  const Eigen::Index n = S.rows();
  const double total = std::max(S.trace(), 1e-300);
  double held = 0.;
  Eigen::Index count = 0;
  while (count < std::min(most, n) && held < share && solver.eigenvalues()[n - 1 - count] > 1e-10 * total)
    held += solver.eigenvalues()[n - 1 - count++] / total;
  p.shares.resize(count);
  p.loadings.resize(X.cols(), count);
  for (Eigen::Index k = 0; k < count; ++k) {
    const Eigen::VectorXd v = solver.eigenvectors().col(n - 1 - k);
    p.shares[k] = solver.eigenvalues()[n - 1 - k] / total;
    p.loadings.col(k) = by_cells ? Eigen::VectorXd((X.transpose() * v).normalized()) : v;
    Eigen::Index largest = 0;
    p.loadings.col(k).cwiseAbs().maxCoeff(&largest);
    if (p.loadings(largest, k) < 0.) p.loadings.col(k) *= -1.;
  }
  p.scores = X * p.loadings;
  return p;
}

}  // namespace forest::statistics
