// SPDX-License-Identifier: Apache-2.0
#include "forest/statistics/discriminator.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include <gtest/gtest.h>

#include "forest/core/error.h"
#include "forest/core/parallel.h"
#include "forest/core/random.h"
#include "forest/statistics/logistic.h"
#include "forest/statistics/random_forest.h"
#include "forest/statistics/summary.h"

#include "tests/effort.h"

namespace forest::statistics {
namespace {

Eigen::MatrixXd cloud(std::uint64_t seed, Eigen::Index cells, Eigen::Index features, double shift = 0.) {
  Random random(seed);
  Eigen::MatrixXd X(cells, features);
  for (double& x : X.reshaped()) x = random.normal();
  X.leftCols(std::min<Eigen::Index>(3, features)).array() += shift;
  return X;
}

TEST(Logistic, FindsWhatOthersFind) {  // sklearn.linear_model.LogisticRegression
  Eigen::MatrixXd X(6, 3);
  X << .5, 1.2, -.3, 1.5, .2, .3, -.5, .7, .1, .2, -1., .9, -1.2, .4, -.6, .9, -.3, 1.1;
  const std::vector<std::uint8_t> second{0, 1, 0, 1, 0, 1};
  const LogisticFit one = fit_logistic(X * X.transpose(), second, 1.);
  const Eigen::Vector3d w = X.transpose() * one.cells;
  EXPECT_NEAR(w[0], 0.7754513054972285, 1e-4);
  EXPECT_NEAR(w[1], -0.7875024186083401, 1e-4);
  EXPECT_NEAR(w[2], 0.6271823705609837, 1e-4);
  EXPECT_NEAR(one.intercept, -0.19619293278280991, 1e-4);
  const LogisticFit ten = fit_logistic(X * X.transpose(), second, 10.);
  EXPECT_NEAR((X.transpose() * ten.cells)[0], 0.1625744531627672, 1e-4);
  EXPECT_NEAR(ten.intercept, -0.041519301329697035, 1e-4);
}

TEST(Logistic, StaysFiniteWhereClassesAreFarApart) {
  Eigen::MatrixXd X(4, 1);
  X << -1e4, -2e4, 1e4, 3e4;
  const std::vector<std::uint8_t> second{0, 0, 1, 1};
  const LogisticFit fit = fit_logistic(X * X.transpose(), second, 1.);
  EXPECT_TRUE(fit.cells.allFinite());
  EXPECT_GT((X * X.transpose() * fit.cells)[3], (X * X.transpose() * fit.cells)[0]);
}

TEST(RandomForest, LearnsWhatNoSingleFeatureTells) {
  // Exclusive or: the second kind is where the signs of the two features differ.
  Random random(4);
  Eigen::MatrixXd X(300, 2);
  std::vector<std::uint8_t> second;
  for (Eigen::Index i = 0; i < 300; ++i) {
    X(i, 0) = random.normal(), X(i, 1) = random.normal();
    second.push_back((X(i, 0) > 0.) != (X(i, 1) > 0.));
  }
  std::vector<std::uint32_t> train(200), test(100);
  std::iota(train.begin(), train.end(), 0u);
  std::iota(test.begin(), test.end(), 200u);
  const auto scores = forest_scores(SortedFeatures(X), second, train, test, {.trees = 100}, 1, 1);
  int right = 0;
  for (std::size_t i = 0; i < test.size(); ++i) right += (scores[i] > .5) == (second[test[i]] == 1);
  EXPECT_GT(right, 90);
}

TEST(RandomForest, RepeatsThePureRowsItGrewFrom) {
  const Eigen::MatrixXd X = cloud(1, 60, 5);
  std::vector<std::uint8_t> second(60);
  std::vector<std::uint32_t> all(60);
  std::iota(all.begin(), all.end(), 0u);
  for (std::size_t i = 0; i < 60; ++i) second[i] = i % 3 == 0;
  const auto scores = forest_scores(SortedFeatures(X), second, all, all, {.trees = 300}, 1, 1);
  for (std::size_t i = 0; i < 60; ++i) EXPECT_EQ(scores[i] > .5, second[i] == 1) << i;
}

TEST(RandomForest, SaysWhichFeaturesTell) {
  Eigen::MatrixXd X = cloud(2, 100, 20);
  X.block(50, 7, 50, 1).array() += 2.5;
  std::vector<std::uint8_t> second(100, 0);
  std::fill(second.begin() + 50, second.end(), 1);
  const auto importances = forest_importances(SortedFeatures(X), second, {}, 1);
  EXPECT_NEAR(std::accumulate(importances.begin(), importances.end(), 0.), 1., 1e-12);
  EXPECT_EQ(std::ranges::max_element(importances) - importances.begin(), 7);
  EXPECT_GT(importances[7], .2);
}

class EitherClassifier : public testing::TestWithParam<Classifier> {};
INSTANTIATE_TEST_SUITE_P(All, EitherClassifier,
                         testing::Values(Classifier::random_forest, Classifier::logistic));

TEST_P(EitherClassifier, TellsWhatIsApartAndGuessesWhatIsNot) {
  const DiscriminatorOptions options{.repeats = 10, .trees = 60, .permutations = 39, .seed = 5};
  const Discrimination apart = discriminate(cloud(1, 30, 10), cloud(2, 25, 10, 2.), GetParam(), options);
  EXPECT_GT(apart.auc.value, .95);
  EXPECT_NEAR(apart.p, 1. / 40., 1e-12);
  EXPECT_EQ(apart.scores.size(), 55u);
  EXPECT_EQ(apart.repeats.size(), 10u);
  const Discrimination same = discriminate(cloud(3, 30, 10), cloud(4, 25, 10), GetParam(), options);
  EXPECT_LT(same.auc.lower, .5);
  EXPECT_GT(same.p, .05);
}

TEST_P(EitherClassifier, IsFairToGuessing) {
  // Over many pairs of samples of one distribution the AUC is a half: nothing leaks from tested to training cells.
  std::vector<double> values;
  for (std::uint64_t trial = 0; trial < 40; ++trial)
    values.push_back(discriminate(cloud(100 + trial, 16, 6), cloud(900 + trial, 12, 6), GetParam(),
                                  {.repeats = 4, .trees = 40, .seed = trial})
                         .auc.value);
  EXPECT_NEAR(mean(values), .5, .06);
}

TEST_P(EitherClassifier, IsTheSameAtAnyNumberOfThreadsAndFollowsTheSeed) {
  const auto run = [&](unsigned threads, std::uint64_t seed) {
    const ThreadLimit limit(threads);
    const auto d =
        discriminate(cloud(1, 20, 8), cloud(2, 30, 8, .4), GetParam(),
                     {.repeats = 6, .trees = 30, .permutations = 5, .first = 18, .second = 20, .seed = seed});
    return std::pair{d.repeats, d.null};
  };
  EXPECT_EQ(run(1, 7), run(4, 7));
  EXPECT_NE(run(1, 7), run(1, 8));
}

TEST(Discriminate, TakesDrawsOfTheFirstSampleByTurns) {
  // Of forty rows ten are as the second sample and the others far off: the draws say which are seen.
  Eigen::MatrixXd first(40, 4);
  first << cloud(1, 10, 4), cloud(2, 30, 4, 6.);
  const Eigen::MatrixXd second = cloud(3, 12, 4);
  const auto rows = [](std::uint32_t from) {
    std::vector<std::uint32_t> out(10);
    std::iota(out.begin(), out.end(), from);
    return out;
  };
  const auto told = [&](std::vector<std::vector<std::uint32_t>> draws) {
    return discriminate(first, second, Classifier::random_forest,
                        {.repeats = 4, .trees = 30, .draws = std::move(draws)});
  };
  EXPECT_GT(told({rows(10), rows(20)}).auc.value, .95);
  EXPECT_LT(told({rows(0)}).auc.value, .8);
  const auto turns = told({rows(0), rows(10)});
  EXPECT_LT(turns.repeats[0], .8);
  EXPECT_GT(turns.repeats[1], .95);
  EXPECT_LT(turns.repeats[2], .8);
  EXPECT_EQ(turns.scores[35], .5) << "never drawn";
}

TEST(Discriminate, RefusesAHandfulOfCells) {
  EXPECT_THROW(discriminate(cloud(1, 3, 4), cloud(2, 30, 4), Classifier::logistic, {}), Error);
  const auto few = discriminate(cloud(1, 4, 4), cloud(2, 4, 4, 9.), Classifier::random_forest,
                                {.repeats = 5, .trees = 30});
  EXPECT_GT(few.auc.value, .9);
  EXPECT_LT(few.auc.lower, .9);
}

TEST(Power, GrowsWithTheNumberOfCells) {
  EXPECT_GT(detectable_effect(64, 64, 1), .495);  // the t-test's, which makes more of normal values
  EXPECT_GT(detectable_effect(64, 64, 100), detectable_effect(64, 64, 1));
  EXPECT_NEAR(detectable_effect(400, 400, 10), .5 * detectable_effect(100, 100, 10), .01);
  EXPECT_GT(detectable_effect(3, 3, 100), 1e9);  // no difference can be shown
  const double effect = detectable_effect(20, 25, 200);
  int found = 0;
  for (std::uint64_t trial = 0; trial < 500; ++trial) {
    Random random(5, trial);
    std::vector<double> x(20), y(25);
    for (double& v : x) v = random.normal();
    for (double& v : y) v = random.normal(effect);
    found += kolmogorov_smirnov(x, y).p <= .05 / 200.;
  }
  EXPECT_NEAR(found, 400, 40);
  EXPECT_GT(detectable_auc(10, 10), detectable_auc(100, 100));
  // By drawing: samples whose means are apart as such an AUC demands are told in about four of five cases.
  const double auc = detectable_auc(30, 30);
  int told = 0;
  for (std::uint64_t trial = 0; trial < 500; ++trial) {
    Random random(6, trial);
    double u = 0.;
    std::vector<double> x(30), y(30);
    double shift = 0.;  // Φ(shift / √2) = auc, by bisection
    for (double low = 0., high = 5.; high - low > 1e-6;) {
      shift = .5 * (low + high);
      (.5 * std::erfc(-shift / 2.) < auc ? low : high) = shift;
    }
    for (double& v : x) v = random.normal();
    for (double& v : y) v = random.normal(shift);
    for (const double v : x)
      for (const double w : y) u += w > v;
    told += (u / 900. - .5) / std::sqrt(61. / (12. * 900.)) > 1.644854;
  }
  EXPECT_NEAR(told, 400, 40);
  EXPECT_GT(detectable_auc(30, 30, .01), auc);
  std::vector<double> null(100, .4);
  std::fill_n(null.begin(), 50, .6);
  EXPECT_GT(detectable_auc(30, 30, .05, null), auc);  // guessing differs by .1 where ranks differ by .075
  EXPECT_EQ(detectable_auc(30, 30, .05, std::vector<double>(100, .5)), auc);
}

// Cells of one kind dealt to two samples: an interval of 95 % leaves one half out in one case of twenty.
TEST(Discriminate, TheIntervalHoldsWhatOtherCellsWouldHaveTaught) {
  LONG_TEST();
  constexpr int trials = 200;
  for (const std::size_t permutations : {0u, 40u}) {
    int missed = 0;
    for (std::uint64_t trial = 0; trial < trials; ++trial) {
      const auto told =
          discriminate(cloud(2 * trial + 11, 25, 12), cloud(2 * trial + 12, 25, 12), Classifier::logistic,
                       {.repeats = 10, .permutations = permutations, .seed = trial});
      missed += told.auc.lower > .5 || told.auc.upper < .5;
    }
    EXPECT_LE(missed, trials / 9) << permutations;
  }
}

}  // namespace
}  // namespace forest::statistics
