// SPDX-License-Identifier: Apache-2.0
#include "forest/statistics/sample_distance.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <vector>

#include "forest/core/parallel.h"
#include "forest/core/random.h"
#include "forest/statistics/dealing.h"

namespace forest::statistics {
namespace {

using Matrix = Eigen::MatrixXd;

struct Sums {
  double aa, ab, bb;  // of a matrix of pairs, within and between the samples
};

Sums sums_of(const Matrix& pairs, const std::vector<std::uint32_t>& order, Eigen::Index first) {
  Sums sums{0., 0., 0.};
  const Eigen::Index n = pairs.rows();
  for (Eigen::Index i = 0; i < n; ++i) {
    const double* column = pairs.data() + n * order[std::size_t(i)];
    double a = 0., b = 0.;
    for (Eigen::Index j = 0; j < first; ++j) a += column[order[std::size_t(j)]];
    for (Eigen::Index j = first; j < n; ++j) b += column[order[std::size_t(j)]];
    i < first ? (sums.aa += a, sums.ab += b) : (sums.bb += b);
  }
  return sums;
}

/// 2 mean(ab) - mean(aa) - mean(bb), found and after each dealing. Sums of one dealing are added in its own order, so a
/// tie with what was found may be missed by rounding: what is that close counts as a tie.
DistanceTest tested(const Matrix& pairs, Eigen::Index first, std::size_t dealings, std::uint64_t seed,
                    std::uint32_t stream, std::span<const std::uint32_t> slices) {
  const Eigen::Index n = pairs.rows();
  const double m = double(first), rest = double(n - first);
  const auto distance = [&](const Sums& s) {
    return 2. * s.ab / (m * rest) - s.aa / (m * m) - s.bb / (rest * rest);
  };
  std::vector<std::uint32_t> order(static_cast<std::size_t>(n));
  std::iota(order.begin(), order.end(), 0u);
  const double found = distance(sums_of(pairs, order, first));
  const double tie = 1e-12 * pairs.cwiseAbs().maxCoeff();
  std::vector<char> as_far(dealings);
  parallel_for(dealings, 16, [&](std::size_t k) {
    Random random(seed, k, stream);
    as_far[k] = distance(sums_of(pairs, dealt(std::size_t(n), slices, random), first)) >= found - tie;
  });
  const auto count = double(std::ranges::count(as_far, char(1)));
  return {found, (count + 1.) / (double(dealings) + 1.)};
}

Matrix both(const Matrix& a, const Matrix& b) {
  Matrix all(a.rows() + b.rows(), a.cols());
  all << a, b;
  return all;
}

}  // namespace

Eigen::MatrixXd distances(const Matrix& a, const Matrix& b) {
  Matrix D(a.rows(), b.rows());
  parallel_for(std::size_t(b.rows()), 8, [&](std::size_t j) {
    D.col(Eigen::Index(j)) = (a.rowwise() - b.row(Eigen::Index(j))).rowwise().norm();
  });
  return D;
}

DistanceTest energy_distance(const Matrix& a, const Matrix& b, std::size_t dealings, std::uint64_t seed,
                             std::span<const std::uint32_t> slices) {
  if (a.rows() == 0 || b.rows() == 0) return {};
  const Matrix all = both(a, b), D = distances(all, all);
  DistanceTest test = tested(D, a.rows(), dealings, seed, 0x656e6572, slices);  // "ener"
  const double between = 2. * D.topRightCorner(a.rows(), b.rows()).mean();
  test.distance = between > 0. ? std::max(0., test.distance / between) : 0.;
  return test;
}

DistanceTest mean_discrepancy(const Matrix& a, const Matrix& b, std::size_t dealings, std::uint64_t seed,
                              std::span<const std::uint32_t> slices) {
  if (a.rows() == 0 || b.rows() == 0) return {};
  const Matrix all = both(a, b), D = distances(all, all);
  std::vector<double> pairs;
  for (Eigen::Index j = 1; j < D.cols(); ++j)
    for (Eigen::Index i = 0; i < j; ++i) pairs.push_back(D(i, j));
  const auto middle = pairs.begin() + std::ptrdiff_t(pairs.size() / 2);
  std::nth_element(pairs.begin(), middle, pairs.end());
  const double width = middle == pairs.end() || *middle <= 0. ? 1. : *middle;
  const Matrix K = (D.array() / width).square().unaryExpr([](double x) { return -std::exp(-.5 * x); });
  DistanceTest test = tested(K, a.rows(), dealings, seed, 0x6d6d6420, slices);  // "mmd "
  test.distance = std::max(0., test.distance);
  return test;
}

}  // namespace forest::statistics
