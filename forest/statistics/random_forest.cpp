// SPDX-License-Identifier: Apache-2.0
#include "forest/statistics/random_forest.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <numeric>

#include "forest/core/parallel.h"
#include "forest/core/random.h"

namespace forest::statistics {
namespace {

constexpr std::uint32_t stream = 0x74726565;  // "tree"

/// Grows one tree after another and lets rows fall through them.
class Grower {
 public:
  Grower(const SortedFeatures& data, std::span<const std::uint8_t> second, const ForestOptions& options,
         Random& random, std::span<double> scores, std::span<double> importances)
      : data_(data),
        second_(second),
        random_(random),
        scores_(scores),
        importances_(importances),
        tried_(options.tried ? std::min(options.tried, data.features())
                             : std::size_t(std::sqrt(double(data.features())))),
        weight_(data.rows()),
        inside_(data.rows()),
        features_(data.features()) {
    tried_ = std::max<std::size_t>(tried_, 1);
    std::iota(features_.begin(), features_.end(), 0u);
  }

  void grow(std::span<const std::uint32_t> train, std::span<const std::uint32_t> test) {
    std::ranges::fill(weight_, 0u);
    for (std::size_t i = 0; i < train.size(); ++i)
      ++weight_[train[random_.below(std::uint32_t(train.size()))]];
    train_.clear();
    for (const std::uint32_t row : train)
      if (weight_[row]) train_.push_back(row);
    test_.resize(test.size());
    for (std::uint32_t i = 0; i < test.size(); ++i) test_[i] = {test[i], i};
    std::vector<Node> nodes{{0, std::uint32_t(train_.size()), 0, std::uint32_t(test_.size())}};
    while (!nodes.empty()) {  // a stack of our own: a tree of equal rows may be deep
      const Node node = nodes.back();
      nodes.pop_back();
      if (node.test_begin == node.test_end && importances_.empty()) continue;  // nobody asks
      const Split split = best_split(node);
      if (split.gain < 0.) {
        for (std::uint32_t i = node.test_begin; i < node.test_end; ++i)
          scores_[test_[i].second] += split.share;
        continue;
      }
      if (!importances_.empty()) importances_[split.feature] += split.gain;
      const auto middle = std::partition(
          train_.begin() + node.begin, train_.begin() + node.end,
          [&](std::uint32_t row) { return data_.value(row, split.feature) <= split.threshold; });
      const auto test_middle = std::partition(
          test_.begin() + node.test_begin, test_.begin() + node.test_end,
          [&](const auto& t) { return data_.value(t.first, split.feature) <= split.threshold; });
      const auto at = std::uint32_t(middle - train_.begin()),
                 test_at = std::uint32_t(test_middle - test_.begin());
      nodes.push_back({at, node.end, test_at, node.test_end});
      nodes.push_back({node.begin, at, node.test_begin, test_at});
    }
  }

 private:
  struct Node {
    std::uint32_t begin, end, test_begin, test_end;  // of train_ and test_
  };
  struct Split {
    double gain = -1.;  // of impurity times weight; negative for a leaf
    std::uint32_t feature = 0;
    double threshold = 0., share = 0.;  // of the second kind in the node
  };

  Split best_split(const Node& node) {
    const std::span rows(train_.data() + node.begin, train_.data() + node.end);
    double all = 0., ones = 0.;
    for (const std::uint32_t row : rows) all += weight_[row], ones += second_[row] * weight_[row];
    Split best{.share = ones / all};
    if (ones == 0. || ones == all) return best;
    const double before = (ones * ones + (all - ones) * (all - ones)) / all;
    double most = -1.;

    // In the order of size either by sorting the node's rows, or by passing those of other nodes.
    const bool sort = rows.size() * std::size_t(std::bit_width(rows.size())) < 2 * data_.rows();
    if (!sort)
      for (const std::uint32_t row : rows) inside_[row] = 1;
    std::size_t left = data_.features(), varied = 0;
    while (left > 0 && varied < tried_) {
      std::swap(features_[random_.below(std::uint32_t(left))], features_[left - 1]);
      const std::uint32_t feature = features_[--left];
      const auto ranks = data_.ranks(feature);
      keys_.clear();
      if (sort) {
        for (const std::uint32_t row : rows) keys_.push_back(std::uint64_t(ranks[row]) << 32 | row);
        std::ranges::sort(keys_);
      } else {
        for (const std::uint32_t row : data_.order(feature))
          if (inside_[row]) keys_.push_back(std::uint64_t(ranks[row]) << 32 | row);
      }
      if (keys_.front() >> 32 == keys_.back() >> 32) continue;  // all the same here: does not count as tried
      ++varied;
      double below = 0., below_ones = 0.;
      for (std::size_t i = 0; i + 1 < keys_.size(); ++i) {
        const auto row = std::uint32_t(keys_[i]);
        below += weight_[row], below_ones += second_[row] * weight_[row];
        if (keys_[i] >> 32 == keys_[i + 1] >> 32) continue;
        const double above = all - below, above_ones = ones - below_ones;
        const double pure = (below_ones * below_ones + (below - below_ones) * (below - below_ones)) / below +
                            (above_ones * above_ones + (above - above_ones) * (above - above_ones)) / above;
        if (pure <= most) continue;
        most = pure;
        best.gain = pure - before, best.feature = feature;
        const double low = data_.value(row, feature),
                     high = data_.value(std::uint32_t(keys_[i + 1]), feature);
        best.threshold = low + .5 * (high - low);
        if (best.threshold >= high) best.threshold = low;  // neighbours among the doubles
      }
    }
    if (!sort)
      for (const std::uint32_t row : rows) inside_[row] = 0;
    if (most > 0.) best.gain = std::max(0., best.gain);  // a split may gain nothing, and yet lead on
    return best;
  }

  const SortedFeatures& data_;
  std::span<const std::uint8_t> second_;
  Random& random_;
  std::span<double> scores_, importances_;
  std::size_t tried_;
  std::vector<std::uint32_t> weight_;
  std::vector<std::uint8_t> inside_;
  std::vector<std::uint32_t> features_, train_;
  std::vector<std::pair<std::uint32_t, std::uint32_t>> test_;  // row, place among the scores
  std::vector<std::uint64_t> keys_;
};

}  // namespace

SortedFeatures::SortedFeatures(Eigen::MatrixXd values)
    : values_(std::move(values)), order_(rows() * features()), ranks_(rows() * features()) {
  parallel_for(features(), 8, [&](std::size_t f) {
    const double* column = values_.data() + rows() * f;
    const std::span order(order_.data() + rows() * f, rows());
    std::iota(order.begin(), order.end(), 0u);
    std::ranges::stable_sort(order, {}, [&](std::uint32_t row) { return column[row]; });
    std::uint32_t rank = 0;
    for (std::size_t i = 0; i < order.size(); ++i) {
      if (i && column[order[i]] != column[order[i - 1]]) ++rank;
      ranks_[rows() * f + order[i]] = rank;
    }
  });
}

std::vector<double> forest_scores(const SortedFeatures& data, std::span<const std::uint8_t> second,
                                  std::span<const std::uint32_t> train, std::span<const std::uint32_t> test,
                                  const ForestOptions& options, std::uint64_t seed, std::uint64_t item,
                                  std::span<double> importances) {
  std::vector<double> scores(test.size(), 0.);
  if (train.empty() || data.features() == 0) return std::vector<double>(test.size(), .5);
  Random random(seed, item, stream);
  Grower grower(data, second, options, random, scores, importances);
  for (std::size_t tree = 0; tree < options.trees; ++tree) grower.grow(train, test);
  for (double& score : scores) score /= double(options.trees);
  return scores;
}

std::vector<double> forest_importances(const SortedFeatures& data, std::span<const std::uint8_t> second,
                                       const ForestOptions& options, std::uint64_t seed) {
  constexpr std::size_t blocks = 16;  // each has its random numbers, whoever grows it
  std::vector<std::vector<double>> parts(blocks, std::vector<double>(data.features()));
  std::vector<std::uint32_t> all(data.rows());
  std::iota(all.begin(), all.end(), 0u);
  parallel_for(blocks, 1, [&](std::size_t b) {
    ForestOptions some = options;
    some.trees = std::max<std::size_t>(1, options.trees / blocks);
    forest_scores(data, second, all, {}, some, seed, (std::uint64_t(1) << 32) + b, parts[b]);
  });
  std::vector<double> sums(data.features(), 0.);
  for (const auto& part : parts)
    for (std::size_t f = 0; f < sums.size(); ++f) sums[f] += part[f];
  const double total = std::accumulate(sums.begin(), sums.end(), 0.);
  if (total > 0.)
    for (double& sum : sums) sum /= total;
  return sums;
}

}  // namespace forest::statistics
