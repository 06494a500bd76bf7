// SPDX-License-Identifier: Apache-2.0
// A forest of decision trees that tells two kinds of rows apart (Breiman 2001): each tree grows on a bootstrap sample to
// the end, every split the best by Gini's impurity among a few features drawn anew; a row's score is the mean, over
// trees, of the share of the second kind in the leaf that it falls into. Trees are never kept: rows to be scored go
// down with those that the tree grows from.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include <Eigen/Core>

namespace forest::statistics {

/// Features sorted once, for all the forests that grow on parts of the rows.
class SortedFeatures {
 public:
  /// @param values  rows × features, all defined
  explicit SortedFeatures(Eigen::MatrixXd values);

  std::size_t rows() const { return std::size_t(values_.rows()); }
  std::size_t features() const { return std::size_t(values_.cols()); }
  double value(std::uint32_t row, std::uint32_t feature) const { return values_(row, feature); }
  std::span<const std::uint32_t> order(std::uint32_t feature) const {  // rows by rising value
    return {order_.data() + rows() * feature, rows()};
  }
  std::span<const std::uint32_t> ranks(std::uint32_t feature) const {  // of each row; equal values share one
    return {ranks_.data() + rows() * feature, rows()};
  }

 private:
  Eigen::MatrixXd values_;
  std::vector<std::uint32_t> order_, ranks_;
};

struct ForestOptions {
  std::size_t trees = 200;
  std::size_t tried = 0;  // features a split; 0 for the square root of their number
};

/// Scores of the rows `test` by a forest grown on the rows `train`.
/// @param second       of every row, whether it is of the second kind
/// @param item         what the random numbers are drawn for, with the seed
/// @param importances  one a feature, or none: what splits by it took of the impurity is added
std::vector<double> forest_scores(const SortedFeatures& data, std::span<const std::uint8_t> second,
                                  std::span<const std::uint32_t> train, std::span<const std::uint32_t> test,
                                  const ForestOptions& options, std::uint64_t seed, std::uint64_t item,
                                  std::span<double> importances = {});

/// How much each feature tells by the splits of trees on all rows, which add up to 1 (mean decrease of impurity).
/// Features that say the same share what they tell.
std::vector<double> forest_importances(const SortedFeatures& data, std::span<const std::uint8_t> second,
                                       const ForestOptions& options, std::uint64_t seed);

}  // namespace forest::statistics
