// SPDX-License-Identifier: Apache-2.0
#include "forest/statistics/logistic.h"

#include <algorithm>
#include <cmath>

#include <Eigen/Cholesky>

namespace forest::statistics {
namespace {

double objective(const Eigen::MatrixXd& K, const Eigen::VectorXd& y, const LogisticFit& fit, double ridge) {
  const Eigen::VectorXd w = K * fit.cells;
  double loss = .5 * ridge * fit.cells.dot(w);
  for (Eigen::Index i = 0; i < y.size(); ++i) {
    const double margin = (2. * y[i] - 1.) * (w[i] + fit.intercept);
    loss += margin > 0. ? std::log1p(std::exp(-margin)) : -margin + std::log1p(std::exp(margin));
  }
  return loss;
}

}  // namespace

LogisticFit fit_logistic(const Eigen::MatrixXd& K, std::span<const std::uint8_t> second, double ridge) {
  const Eigen::Index n = K.rows();
  Eigen::VectorXd y(n);
  for (Eigen::Index i = 0; i < n; ++i) y[i] = second[std::size_t(i)];
  LogisticFit fit{Eigen::VectorXd::Zero(n), 0.};
  double value = objective(K, y, fit, ridge);
  for (int step = 0; step < 100; ++step) {
    const Eigen::VectorXd f = (K * fit.cells).array() + fit.intercept;
    const Eigen::ArrayXd p = 1. / (1. + (-f.array()).exp());
    const Eigen::ArrayXd weight = (p * (1. - p)).max(1e-9);
    const Eigen::VectorXd z = f.array() + (y.array() - p) / weight;
    Eigen::MatrixXd A = K;
    A.diagonal().array() += ridge / weight;
    const Eigen::LLT<Eigen::MatrixXd> solver(A);
    const Eigen::VectorXd u = solver.solve(z), v = solver.solve(Eigen::VectorXd::Ones(n));
    const double intercept = u.sum() / v.sum();
    const LogisticFit newton{u - intercept * v, intercept};
    // Newton's step may overshoot where the weights are small: half of it until the objective falls.
    LogisticFit next = newton;
    double reached = objective(K, y, next, ridge);
    for (double part = .5; !(reached <= value) && part > 1e-6; part *= .5) {
      next = {fit.cells + part * (newton.cells - fit.cells),
              fit.intercept + part * (newton.intercept - fit.intercept)};
      reached = objective(K, y, next, ridge);
    }
    if (!(reached < value)) break;
    const bool done = value - reached < 1e-10 * (1. + value);
    fit = std::move(next), value = reached;
    if (done) break;
  }
  return fit;
}

}  // namespace forest::statistics
