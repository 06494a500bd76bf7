// SPDX-License-Identifier: Apache-2.0
#include "forest/statistics/clusters.h"

#include <algorithm>
#include <cmath>

#include <gtest/gtest.h>

#include "forest/core/error.h"
#include "forest/core/parallel.h"
#include "forest/core/random.h"
#include "forest/statistics/projection.h"

namespace forest::statistics {
namespace {

/// Clouds of cells in twenty features, apart in two of them.
FeatureTable clouds(std::uint64_t seed, std::size_t kinds, std::size_t each, double apart) {
  FeatureTable t;
  for (int f = 0; f < 20; ++f) t.features.push_back({"feature " + std::to_string(f), "", false});
  t.values.resize(Eigen::Index(kinds * each), 20);
  for (std::size_t i = 0; i < kinds * each; ++i) {
    Random random(seed, i);
    t.cells.push_back(std::to_string(i));
    const double angle = 2. * std::numbers::pi * double(i % kinds) / double(kinds);
    const double x = random.normal() + apart * std::cos(angle), y = random.normal() + apart * std::sin(angle);
    for (Eigen::Index f = 0; f < 20; ++f)
      t.values(Eigen::Index(i), f) = (f % 2 ? x : y) + .7 * random.normal();
  }
  return t;
}

std::vector<std::uint32_t> truth(std::size_t kinds, std::size_t each) {
  std::vector<std::uint32_t> kind;
  for (std::size_t i = 0; i < kinds * each; ++i) kind.push_back(std::uint32_t(i % kinds));
  return kind;
}

TEST(AdjustedRand, IsThatOfHubertAndArabie) {  // sklearn.metrics.adjusted_rand_score
  const std::vector<std::uint32_t> a{0, 0, 0, 1, 1, 1, 2, 2}, b{0, 0, 1, 1, 1, 1, 2, 0},
      renamed{2, 2, 2, 0, 0, 0, 1, 1};
  EXPECT_NEAR(adjusted_rand(a, b), 0.30434782608695654, 1e-12);
  EXPECT_EQ(adjusted_rand(a, renamed), 1.);
}

TEST(Types, AreFoundAsManyAsThereAre) {
  for (const std::size_t kinds : {1u, 2u, 3u, 4u, 12u}) {
    SCOPED_TRACE(kinds);
    const std::size_t each = kinds < 5 ? 30 : 12;
    const Types found = find_types(clouds(kinds, kinds, each, kinds < 5 ? 6. : 25.), {.seed = 1});
    EXPECT_EQ(found.division().types, kinds);
    EXPECT_GT(adjusted_rand(found.division().type, truth(kinds, each)), .9);
    EXPECT_GT(found.division().stability, .9);
  }
}

TEST(Types, SayWhatDefinesThem) {
  FeatureTable t = clouds(1, 2, 25, 0.);
  for (Eigen::Index i = 0; i < t.values.rows(); i += 2)
    for (const Eigen::Index f : {4, 5, 6, 7, 8, 9}) t.values(i, f) += 9.;
  const Types found = find_types(t, {.types = 2, .seed = 1});
  ASSERT_EQ(found.traits.size(), 2u);
  EXPECT_NEAR(std::abs(found.traits[0].front().delta.value), 1., .01);
  EXPECT_EQ(found.traits[0].front().delta.value, -found.traits[1].front().delta.value);
}

TEST(Types, AreTheSameAtAnyNumberOfThreads) {
  const FeatureTable t = clouds(3, 3, 20, 4.);
  const auto run = [&](unsigned threads) {
    const ThreadLimit limit(threads);
    const Types found = find_types(t, {.seed = 2});
    return std::tuple{found.chosen, found.division().type, found.p, found.division().stability};
  };
  EXPECT_EQ(run(1), run(4));
}

TEST(Types, NeedCells) { EXPECT_THROW(find_types(clouds(1, 1, 5, 0.), {}), Error); }

TEST(PrincipalComponents, KeepDistancesAndAreOrthogonal) {
  const Eigen::MatrixXd X = standardised(clouds(1, 2, 15, 3.));
  const Projection all = principal_components(X, 1., 100);
  EXPECT_NEAR(all.shares.sum(), 1., 1e-9);
  EXPECT_NEAR((all.scores.row(0) - all.scores.row(1)).norm(), (X.row(0) - X.row(1)).norm(), 1e-9);
  EXPECT_TRUE((all.loadings.transpose() * all.loadings).isIdentity(1e-9));
  const Projection tall = principal_components(X.leftCols(4), 1., 100);  // more cells than features
  EXPECT_EQ(tall.scores.cols(), 4);
  EXPECT_GE(tall.shares[0], tall.shares[1]);
}

}  // namespace
}  // namespace forest::statistics
