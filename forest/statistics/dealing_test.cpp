// SPDX-License-Identifier: Apache-2.0
#include "forest/statistics/dealing.h"

#include <algorithm>

#include <gtest/gtest.h>

#include "forest/statistics/discriminator.h"
#include "forest/statistics/sample_distance.h"

namespace forest::statistics {
namespace {

TEST(Dealt, KeepsSlicesTogetherAndLosesNobody) {
  const std::vector<std::string> words{"b", "a", "b", "c", "a", "b"};
  const auto slices = numbered(words);
  EXPECT_EQ(slices, (std::vector<std::uint32_t>{0, 1, 0, 2, 1, 0}));
  for (std::uint64_t trial = 0; trial < 50; ++trial) {
    Random random(1, trial);
    auto rows = dealt(6, slices, random);
    int changes = 0;
    for (std::size_t i = 1; i < rows.size(); ++i) changes += slices[rows[i]] != slices[rows[i - 1]];
    EXPECT_EQ(changes, 2);
    std::ranges::sort(rows);
    EXPECT_EQ(rows, (std::vector<std::uint32_t>{0, 1, 2, 3, 4, 5}));
  }
  EXPECT_TRUE(numbered({}).empty());
}

TEST(Dealt, SaysNothingOfCellsThatDifferByTheirSliceAlone) {
  // Two populations of six slices each; what differs is the slice.
  int rejected = 0, rejected_alone = 0;
  double auc = 0., auc_alone = 0.;
  constexpr int trials = 20;
  for (std::uint64_t trial = 0; trial < trials; ++trial) {
    Random random(7, trial);
    Eigen::MatrixXd X(48, 6);
    std::vector<std::uint32_t> slices;
    for (Eigen::Index i = 0; i < 48; ++i) {
      if (i % 4 == 0)
        for (double& x : X.row(i)) x = 2. * random.normal();
      else
        X.row(i) = X.row(i - i % 4);
      slices.push_back(std::uint32_t(i / 4));
    }
    for (double& x : X.reshaped()) x += .3 * random.normal();
    rejected += energy_distance(X.topRows(24), X.bottomRows(24), 99, trial, slices).p <= .05;
    rejected_alone += energy_distance(X.topRows(24), X.bottomRows(24), 99, trial).p <= .05;
    DiscriminatorOptions options{.repeats = 3, .trees = 40, .seed = trial};
    auc_alone +=
        discriminate(X.topRows(24), X.bottomRows(24), Classifier::random_forest, options).auc.value / trials;
    options.slices = slices;
    auc +=
        discriminate(X.topRows(24), X.bottomRows(24), Classifier::random_forest, options).auc.value / trials;
  }
  EXPECT_LE(rejected, 5);
  EXPECT_GT(rejected_alone, rejected + 3);
  EXPECT_LT(auc, .62);
  EXPECT_GT(auc_alone, .85);
}

}  // namespace
}  // namespace forest::statistics
