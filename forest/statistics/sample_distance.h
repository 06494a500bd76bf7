// SPDX-License-Identifier: Apache-2.0
// Two samples of whole feature vectors: are they of one distribution? Both distances are zero, for infinitely many
// cells, when the distributions are the same and only then; how surely is found by dealing the cells anew to the two
// samples many times, with `slices` (dealing.h) those of one slice together. Rows are cells, columns standardised
// features.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include <Eigen/Core>

namespace forest::statistics {

struct DistanceTest {
  double distance = 0.;
  double p = 1.;  // share of random dealings, with the one that was found, that lie at least as far apart
};

/// 2 E|X - Y| - E|X - X'| - E|Y - Y'| over the first term, between 0 and 1 (Székely & Rizzo 2013).
DistanceTest energy_distance(const Eigen::MatrixXd& a, const Eigen::MatrixXd& b, std::size_t dealings,
                             std::uint64_t seed, std::span<const std::uint32_t> slices = {});

/// Squared maximum mean discrepancy with a Gaussian kernel as wide as the median distance of two cells (Gretton et al.
/// 2012, the biased estimate).
DistanceTest mean_discrepancy(const Eigen::MatrixXd& a, const Eigen::MatrixXd& b, std::size_t dealings,
                              std::uint64_t seed, std::span<const std::uint32_t> slices = {});

/// Distances of every row of `a` to every row of `b`.
Eigen::MatrixXd distances(const Eigen::MatrixXd& a, const Eigen::MatrixXd& b);

}  // namespace forest::statistics
