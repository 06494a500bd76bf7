// SPDX-License-Identifier: Apache-2.0
// Generators that minimise Σ φ(J) over the corners of all cells, where the columns of J are the edges of the cell at that corner,
// by L-BFGS.
//
//   length               φ = tr G: every edge short (Laplace's equation; folds where the block is not convex)
//   area-orthogonality   φ = g11 g22 = det J² + g12², even areas and right angles at once; in space the sum of it over
//                        the three pairs of directions
//   liao                 φ = ‖G‖² = g11² + 2 g12² + g22², Liao's functional
//                        (both: Knupp & Steinberg 1993, chapter 8; there as differential equations)
//   foldover-free        a barrier against folds, see minimise.h; J is taken relative to the mean cell
#include <algorithm>
#include <cmath>
#include <utility>

#include <Eigen/Geometry>
#include <Eigen/LU>

#include "forest/cortex/grid_generators.h"
#include "forest/cortex/minimise.h"

namespace forest::cortex {
namespace {

template <int d>
Density<d> length_density(const Matrix<d>& j) {
  return {j.squaredNorm(), 2. * j};
}
template <int d>
Density<d> area_orthogonality_density(const Matrix<d>& j) {
  Density<d> result{0., Matrix<d>::Zero()};
  for (int a = 0; a < d; ++a)
    for (int b = 0; b < a; ++b) {
      const double ga = j.col(a).squaredNorm(), gb = j.col(b).squaredNorm();
      result.value += ga * gb;
      result.slope.col(a) += 2. * gb * j.col(a);
      result.slope.col(b) += 2. * ga * j.col(b);
    }
  return result;
}
template <int d>
Density<d> liao_density(const Matrix<d>& j) {
  const Matrix<d> metric = j.transpose() * j;
  return {metric.squaredNorm(), 4. * j * metric};
}

// The points that may move, as a vector, and the sum of a density over all corners of all cells.
template <int d>
class Problem {
 public:
  explicit Problem(Grid& grid) : grid_(grid) {
    const auto& s = grid.size;
    place_.assign(grid.points.size(), -1);
    for (int k = 0; k < s[2]; ++k)
      for (int j = 0; j < s[1]; ++j)
        for (int i = 0; i < s[0]; ++i)
          if (!grid.on_boundary(i, j, k)) place_[grid.index(i, j, k)] = std::exchange(count_, count_ + d);
    const std::array<std::size_t, 3> step{1, std::size_t(s[0]), std::size_t(s[0]) * std::size_t(s[1])};
    for (std::size_t c = 0; c < corners; ++c)
      corner_[c] = (c & 1) * step[0] + (c >> 1 & 1) * step[1] + (c >> 2) * step[2];
    for (int k = 0; k < (d == 3 ? s[2] - 1 : 1); ++k)
      for (int j = 0; j < s[1] - 1; ++j)
        for (int i = 0; i < s[0] - 1; ++i) cells_.push_back(grid.index(i, j, k));
    at_.resize(Eigen::Index(grid.points.size()) * d);
    for (std::size_t n = 0; n < grid.points.size(); ++n)
      at_.template segment<d>(Eigen::Index(n) * d) = grid.points[n].template head<d>();
    slope_.resize(at_.size());
  }

  Vector start() const {
    Vector x(count_);
    for (std::size_t n = 0; n < place_.size(); ++n)
      if (place_[n] >= 0) x.segment<d>(place_[n]) = grid_.points[n].template head<d>();
    return x;
  }
  void take(const Vector& x) {
    for (std::size_t n = 0; n < place_.size(); ++n)
      if (place_[n] >= 0) grid_.points[n].template head<d>() = x.segment<d>(place_[n]);
  }
  void scale(const Matrix<d>& inverse) { inverse_ = inverse; }  // J is taken times this

  template <class Phi>
  double operator()(const Vector& x, Vector& gradient, const Phi& phi, double* least = nullptr) {
    for (std::size_t n = 0; n < place_.size(); ++n)
      if (place_[n] >= 0) at_.template segment<d>(Eigen::Index(n) * d) = x.segment<d>(place_[n]);
    slope_.setZero();
    double sum = 0.;
    for (const std::size_t cell : cells_)
      for (std::size_t c = 0; c < corners; ++c) {
        Matrix<d> j;
        const Eigen::Index here = Eigen::Index(cell + corner_[c]) * d;
        std::array<Eigen::Index, d> beside;
        for (int a = 0; a < d; ++a) {
          beside[std::size_t(a)] = Eigen::Index(cell + corner_[c ^ (std::size_t(1) << a)]) * d;
          const double sign = c >> a & 1 ? -1. : 1.;
          j.col(a) = sign * (at_.template segment<d>(beside[std::size_t(a)]) - at_.template segment<d>(here));
        }
        j = j * inverse_;
        if (least) *least = std::min(*least, j.determinant());
        const Density<d> density = phi(j);
        sum += density.value;
        const Matrix<d> by_edges = density.slope * inverse_.transpose();
        for (int a = 0; a < d; ++a) {
          const double sign = c >> a & 1 ? -1. : 1.;
          slope_.template segment<d>(beside[std::size_t(a)]) += sign * by_edges.col(a);
          slope_.template segment<d>(here) -= sign * by_edges.col(a);
        }
      }
    gradient.resize(count_);
    for (std::size_t n = 0; n < place_.size(); ++n)
      if (place_[n] >= 0) gradient.segment<d>(place_[n]) = slope_.template segment<d>(Eigen::Index(n) * d);
    return sum;
  }

  // Mean lengths of the edges along each axis, scaled so that their product is the mean volume of the cells, which is the block's
  // over their number, wherever the inside lies.
  Matrix<d> mean_cell() const {
    Matrix<d> mean = Matrix<d>::Zero();
    double volume = 0.;
    for (const std::size_t cell : cells_)
      for (std::size_t c = 0; c < corners; ++c) {
        Matrix<d> j;
        for (int a = 0; a < d; ++a) {
          const double sign = c >> a & 1 ? -1. : 1.;
          j.col(a) =
              sign * (at_.template segment<d>(Eigen::Index(cell + corner_[c ^ (std::size_t(1) << a)]) * d) -
                      at_.template segment<d>(Eigen::Index(cell + corner_[c]) * d));
          mean(a, a) += j.col(a).norm();
        }
        volume += j.determinant();
      }
    mean /= double(cells_.size() * corners);
    volume /= double(cells_.size() * corners);
    return mean * std::pow(std::abs(volume) / mean.diagonal().prod(), 1. / d);
  }

 private:
  static constexpr std::size_t corners = d == 2 ? 4 : 8;
  Grid& grid_;
  std::vector<Eigen::Index> place_;  // of a point's coordinates in the vector; −1: it stays
  Eigen::Index count_ = 0;
  std::array<std::size_t, corners> corner_{};  // of a cell, from its first
  std::vector<std::size_t> cells_;             // first corners
  Vector at_, slope_;                          // of all points
  Matrix<d> inverse_ = Matrix<d>::Identity();
};

double diagonal(const Grid& grid) {
  Eigen::Vector3d low = grid.points.front(), high = low;
  for (const auto& p : grid.points) low = low.cwiseMin(p), high = high.cwiseMax(p);
  return (high - low).norm();
}

template <int d, class Phi>
Grid smallest(Grid grid, const GridOptions& options, Phi&& phi) {
  const double enough = options.tolerance * diagonal(grid);
  Problem<d> problem(grid);
  // A functional is of some power of a length: relative to the mean cell its values are near 1.
  problem.scale(Matrix<d>::Identity() / std::pow(problem.mean_cell().determinant(), 1. / d));
  Vector x = problem.start();
  if (x.size() == 0) return grid;
  minimise(x, options.iterations, enough,
           [&](const Vector& at, Vector& gradient) { return problem(at, gradient, phi); });
  problem.take(x);
  return grid;
}

template <int d>
Grid unfolded(Grid grid, const GridOptions& options) {
  const double enough = options.tolerance * diagonal(grid);
  Problem<d> problem(grid);
  Vector x = problem.start();
  if (x.size() == 0) return grid;
  problem.scale(problem.mean_cell().inverse());
  unfold(x, 60, options.iterations / 10 + 1, enough,
         [&](const Vector& at, Vector& gradient, const Unfolding& phi, double* least) {
           return problem(at, gradient, phi, least);
         });
  problem.take(x);
  return grid;
}

}  // namespace

Grid length(Grid grid, const GridOptions& options) {
  return grid.plane() ? smallest<2>(std::move(grid), options, length_density<2>)
                      : smallest<3>(std::move(grid), options, length_density<3>);
}
Grid area_orthogonality(Grid grid, const GridOptions& options) {
  return grid.plane() ? smallest<2>(std::move(grid), options, area_orthogonality_density<2>)
                      : smallest<3>(std::move(grid), options, area_orthogonality_density<3>);
}
Grid liao(Grid grid, const GridOptions& options) {
  return grid.plane() ? smallest<2>(std::move(grid), options, liao_density<2>)
                      : smallest<3>(std::move(grid), options, liao_density<3>);
}
Grid foldover_free(Grid grid, const GridOptions& options) {
  return grid.plane() ? unfolded<2>(std::move(grid), options) : unfolded<3>(std::move(grid), options);
}

}  // namespace forest::cortex
