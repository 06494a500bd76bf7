// SPDX-License-Identifier: Apache-2.0
// What generators and untangling minimise, and how: functions of Jacobians, by L-BFGS (Liu & Nocedal 1989, "On the limited memory
// BFGS method for large scale optimization", Math Program 45:503). Private to this room.
//
// Against folds: φ = (1 − λ) ‖J‖² / (d χ^(2/d)) + λ (1 + det J²) / (2 χ) with χ = (det J + √(ε² + det J²)) / 2. For ε → 0 it is infinite
// where det J ≤ 0; ε begins large and follows the worst Jacobian down, so that what begins folded unfolds (Garanzha,
// Kaporin, Kudryavtseva, Protais, Ray & Sokolov 2021, "Foldover-free maps in 50 lines of code", ACM Trans Graph 40:102).
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <utility>
#include <vector>

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <Eigen/LU>

namespace forest::cortex {

template <int d>
using Matrix = Eigen::Matrix<double, d, d>;
using Vector = Eigen::VectorXd;

// φ and ∂φ/∂J.
template <int d>
struct Density {
  double value = 0.;
  Matrix<d> slope;
};

// The matrix of cofactors, ∂ det J / ∂J.
template <int d>
Matrix<d> cofactors(const Matrix<d>& j) {
  Matrix<d> c;
  if constexpr (d == 2) {
    c << j(1, 1), -j(1, 0), -j(0, 1), j(0, 0);
  } else {
    c.col(0) = j.col(1).cross(j.col(2));
    c.col(1) = j.col(2).cross(j.col(0));
    c.col(2) = j.col(0).cross(j.col(1));
  }
  return c;
}

struct Unfolding {
  double epsilon = 1.;
  static constexpr double even = .2;  // λ: even volumes against even shapes

  double chi(double det) const {
    const double root = std::sqrt(epsilon * epsilon + det * det);
    return det > 0. ? .5 * (det + root) : .5 * epsilon * epsilon / (root - det);
  }
  template <int d>
  Density<d> operator()(const Matrix<d>& j) const {
    const double det = j.determinant(), x = chi(det), dx = x / std::sqrt(epsilon * epsilon + det * det);
    const double power = std::pow(x, 2. / d), shape = j.squaredNorm() / (d * power),
                 size = .5 * (1. + det * det) / x;
    Density<d> result{(1. - even) * shape + even * size, Matrix<d>::Zero()};
    const double by_det = (1. - even) * (-2. / d) * shape * dx / x + even * (det - size * dx) / x;
    result.slope = (1. - even) * 2. / (d * power) * j + by_det * cofactors<d>(j);
    return result;
  }
};

// Minimises f from x on; `f(x, gradient)` returns the value, which may be infinite. Returns the value. Ends after so many iterations,
// when no coordinate moves by `enough`, or when five iterations together gain less than the share `gain` of the value.
template <class Function>
double minimise(Vector& x, int iterations, double enough, Function&& f, double gain = 0.) {
  constexpr std::size_t memory = 12;
  Vector gradient, next, next_gradient, tried, tried_gradient;
  double value = f(x, gradient), next_value = value;
  if (!std::isfinite(value)) return value;
  std::vector<std::pair<Vector, Vector>> past;  // steps and changes of the gradient
  double since = value;
  for (int iteration = 0; iteration < iterations; ++iteration) {
    Vector direction = -gradient;
    std::vector<double> alpha(past.size());
    for (std::size_t i = past.size(); i-- > 0;) {
      alpha[i] = past[i].first.dot(direction) / past[i].first.dot(past[i].second);
      direction -= alpha[i] * past[i].second;
    }
    if (!past.empty())
      direction *= past.back().first.dot(past.back().second) / past.back().second.squaredNorm();
    for (std::size_t i = 0; i < past.size(); ++i)
      direction +=
          (alpha[i] - past[i].second.dot(direction) / past[i].first.dot(past[i].second)) * past[i].first;
    double along = direction.dot(gradient);
    if (!(along < 0.)) {
      if (past.empty()) break;
      past.clear();
      continue;
    }
    // A step after Lewis & Overton (2013): the value falls enough, the slope flattens; by bisection. Where no step does both, the
    // longest that was low enough.
    double low = 0., high = std::numeric_limits<double>::infinity();
    double step = past.empty() ? std::min(1., enough * 1e4 / direction.cwiseAbs().maxCoeff()) : 1.;
    for (int attempt = 0; attempt < 40; ++attempt) {
      tried = x + step * direction;
      const double tried_value = f(tried, tried_gradient);
      if (tried_value <= value + 1e-4 * step * along) {
        low = step, next_value = tried_value;
        next.swap(tried), next_gradient.swap(tried_gradient);
        if (!(next_gradient.dot(direction) < .9 * along)) break;
      } else {
        high = step;
      }
      step = std::isinf(high) ? 2. * step : .5 * (low + high);
    }
    if (low == 0.) {
      if (past.empty()) break;
      past.clear();
      continue;
    }
    const Vector moved = next - x, changed = next_gradient - gradient;
    x = next, value = next_value, gradient = next_gradient;
    if (moved.dot(changed) > 1e-12 * moved.norm() * changed.norm()) {
      if (past.size() == memory) past.erase(past.begin());
      past.emplace_back(moved, changed);
    }
    if (moved.cwiseAbs().maxCoeff() < enough) break;
    if (iteration % 5 == 4) {
      if (since - value < gain * since) break;
      since = value;
    }
  }
  return value;
}

/// Minimises Σ φ while ε follows the worst Jacobian down. `sum(x, gradient, phi, &least)` adds φ up and lowers `least` to the least
/// determinant where that is given. Returns whether the least is positive in the end.
template <class Sum>
bool unfold(Vector& x, int rounds, int iterations, double enough, Sum&& sum) {
  Unfolding phi;
  Vector gradient;
  const auto least_of = [&](const Vector& at) {
    double least = std::numeric_limits<double>::infinity();
    sum(at, gradient, phi, &least);
    return least;
  };
  constexpr double barrier = 1e-9;
  double least = least_of(x);
  if (least > 0.) phi.epsilon = barrier;
  for (int round = 0; round < rounds; ++round) {
    const double before = sum(x, gradient, phi, nullptr);
    const double value = minimise(
        x, iterations, enough, [&](const Vector& at, Vector& slope) { return sum(at, slope, phi, nullptr); });
    least = least_of(x);
    if (least > 0. && phi.epsilon <= barrier && before - value < 1e-4 * before) break;
    const double progress = std::max(.1, 1. - value / before), aim = (1. - progress) * phi.chi(least);
    phi.epsilon = least < aim ? 2. * std::sqrt(aim * (aim - least)) : barrier;
  }
  return least > 0.;
}

}  // namespace forest::cortex
