// SPDX-License-Identifier: Apache-2.0
#include "forest/statistics/sample_distance.h"

#include <gtest/gtest.h>

#include "forest/core/parallel.h"
#include "forest/core/random.h"

namespace forest::statistics {
namespace {

Eigen::MatrixXd cloud(std::uint64_t seed, Eigen::Index cells, Eigen::Index features, double shift = 0.) {
  Random random(seed);
  Eigen::MatrixXd X(cells, features);
  for (double& x : X.reshaped()) x = random.normal();
  X.col(0).array() += shift;
  return X;
}

TEST(Distances, HaveTheirKnownValues) {  // by SciPy's cdist
  Eigen::MatrixXd a(3, 2), b(2, 2);
  a << 0, 0, 1, 0, 0, 2;
  b << 3, 1, 2, 2;
  EXPECT_NEAR(energy_distance(a, b, 99, 1).distance, 0.6408326526005805, 1e-12);
  EXPECT_NEAR(mean_discrepancy(a, b, 99, 1).distance, 0.7046952222951492, 1e-12);
  // One of the ten dealings is as far apart, which is what was found.
  EXPECT_NEAR(energy_distance(a, b, 9999, 1).p, .1, .012);
}

TEST(Distances, SeeAShiftAndNothingWhereNothingIs) {
  EXPECT_LT(energy_distance(cloud(1, 40, 5), cloud(2, 40, 5, 1.5), 999, 1).p, .01);
  EXPECT_LT(mean_discrepancy(cloud(1, 40, 5), cloud(2, 40, 5, 1.5), 999, 1).p, .01);
  EXPECT_EQ(energy_distance(cloud(1, 9, 3), cloud(1, 9, 3), 99, 1).p, 1.);
  EXPECT_EQ(energy_distance(cloud(1, 9, 3), Eigen::MatrixXd(0, 3), 99, 1).p, 1.);
}

TEST(Distances, RejectEqualPopulationsInOneOfTwentyCases) {
  int energy = 0, mmd = 0;
  for (std::uint64_t trial = 0; trial < 400; ++trial) {
    const Eigen::MatrixXd a = cloud(1000 + trial, 15, 4), b = cloud(5000 + trial, 12, 4);
    energy += energy_distance(a, b, 199, trial).p <= .05;
    mmd += mean_discrepancy(a, b, 199, trial).p <= .05;
  }
  for (const int rejected : {energy, mmd}) {  // 20 expected, sd 4.4
    EXPECT_GT(rejected, 4);
    EXPECT_LT(rejected, 38);
  }
}

TEST(Distances, AreTheSameAtAnyNumberOfThreads) {
  const Eigen::MatrixXd a = cloud(1, 30, 6), b = cloud(2, 20, 6, .5);
  const auto run = [&](unsigned threads) {
    const ThreadLimit limit(threads);
    return std::pair{energy_distance(a, b, 500, 3).p, mean_discrepancy(a, b, 500, 3).p};
  };
  EXPECT_EQ(run(1), run(4));
}

}  // namespace
}  // namespace forest::statistics
