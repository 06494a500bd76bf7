// SPDX-License-Identifier: Apache-2.0
// Winslow's (1967, "Numerical solution of the quasilinear Poisson equation in a nonuniform triangle mesh", J Comput Phys 1:149)
// and Thompson's generator: ξ, η, ζ are harmonic functions of the place. Exchanging dependent and independent variables,
// Σ g^ab ∂²x/∂a∂b = 0, where g^ab is the inverse of G; in the plane g22 x_ξξ − 2 g12 x_ξη + g11 x_ηη = 0. Central
// differences; the metric of the moment, point after point (Gauss and Seidel).
#include <algorithm>
#include <cmath>

#include <Eigen/LU>

#include "forest/cortex/grid_generators.h"

namespace forest::cortex {
namespace {

double diagonal(const Grid& grid) {
  Eigen::Vector3d low = grid.points.front(), high = low;
  for (const auto& p : grid.points) low = low.cwiseMin(p), high = high.cwiseMax(p);
  return (high - low).norm();
}

template <int dimensions>
Grid solve(Grid grid, const GridOptions& options) {
  constexpr std::size_t d = dimensions;
  const auto& size = grid.size;
  const std::array<std::size_t, 3> step{1, std::size_t(size[0]), std::size_t(size[0]) * std::size_t(size[1])};
  std::array<double, 3> n{};  // steps a unit of the parameter
  for (std::size_t a = 0; a < 3; ++a) n[a] = double(size[a] - 1);
  const double enough = options.tolerance * diagonal(grid);
  std::vector<Eigen::Vector3d>& x = grid.points;

  for (int sweep = 0; sweep < options.iterations; ++sweep) {
    double furthest = 0.;
    for (int k = dimensions == 3 ? 1 : 0; k < (dimensions == 3 ? size[2] - 1 : 1); ++k)
      for (int j = 1; j < size[1] - 1; ++j)
        for (int i = 1; i < size[0] - 1; ++i) {
          const std::size_t here = grid.index(i, j, k);
          Eigen::Matrix<double, 3, dimensions> slopes;
          for (std::size_t a = 0; a < d; ++a)
            slopes.col(int(a)) = .5 * n[a] * (x[here + step[a]] - x[here - step[a]]);
          const Eigen::Matrix<double, dimensions, dimensions> metric = slopes.transpose() * slopes;
          // The adjugate in place of the inverse: the equation's sides may be scaled, and it does not grow where J vanishes.
          Eigen::Matrix<double, dimensions, dimensions> g;
          if constexpr (dimensions == 2)
            g << metric(1, 1), -metric(0, 1), -metric(0, 1), metric(0, 0);
          else
            for (int a = 0; a < 3; ++a)
              for (int b = 0; b < 3; ++b)
                g(a, b) = metric((a + 1) % 3, (b + 1) % 3) * metric((a + 2) % 3, (b + 2) % 3) -
                          metric((a + 1) % 3, (b + 2) % 3) * metric((a + 2) % 3, (b + 1) % 3);
          Eigen::Vector3d sum = Eigen::Vector3d::Zero();
          double weight = 0.;
          for (std::size_t a = 0; a < d; ++a) {
            const double w = g(int(a), int(a)) * n[a] * n[a];
            weight += 2. * w;
            sum += w * (x[here + step[a]] + x[here - step[a]]);
            for (std::size_t b = 0; b < a; ++b)
              sum += .5 * g(int(a), int(b)) * n[a] * n[b] *
                     (x[here + step[a] + step[b]] - x[here + step[a] - step[b]] -
                      x[here - step[a] + step[b]] + x[here - step[a] - step[b]]);
          }
          if (!(weight > 0.)) continue;
          const Eigen::Vector3d moved = sum / weight;
          furthest = std::max(furthest, (moved - x[here]).norm());
          x[here] = moved;
        }
    if (!(furthest > enough)) break;
  }
  return grid;
}

}  // namespace

Grid winslow(Grid grid, const GridOptions& options) {
  return grid.plane() ? solve<2>(std::move(grid), options) : solve<3>(std::move(grid), options);
}

}  // namespace forest::cortex
