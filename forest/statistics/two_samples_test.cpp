// SPDX-License-Identifier: Apache-2.0
// Expected values by hand, or by SciPy 1.10 and scikit-learn 1.2 where so noted.
#include "forest/statistics/two_samples.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include <gtest/gtest.h>

#include "forest/core/random.h"

namespace forest::statistics {
namespace {

using Values = std::vector<double>;
const Values a{0.61,  0.29, 0.06, 0.59, -1.73, -0.74, 0.51, -0.56, 0.39,  1.64,  0.05, -0.06, 0.64,
               -0.82, 0.37, 1.77, 1.09, -1.28, 2.36,  1.31, 1.05,  -0.32, -0.40, 1.06, -2.47};
const Values b{2.20,  1.66, 1.38, 0.20, 0.36,  0.00,  0.96, 1.56, 0.44, 1.50,
               -0.30, 0.66, 2.31, 3.29, -0.27, -0.37, 0.38, 0.70, 0.52, -0.71};

TEST(KolmogorovSmirnovTest, IsExactForSmallSamples) {
  const KolmogorovSmirnov ks = kolmogorov_smirnov(a, b);  // scipy.stats.ks_2samp(method="exact")
  EXPECT_TRUE(ks.exact);
  EXPECT_NEAR(ks.statistic, .23, 1e-12);
  EXPECT_NEAR(ks.p, 0.5286364448145011, 1e-12);
}

TEST(KolmogorovSmirnovTest, CountsTiesAsTheyAre) {
  // Of the 126 ways to deal these nine values, 44 are at least as far apart (counted).
  const KolmogorovSmirnov ks = kolmogorov_smirnov(Values{1, 2, 2, 3, 3}, Values{2, 3, 4, 4});
  EXPECT_NEAR(ks.statistic, .5, 1e-12);
  EXPECT_NEAR(ks.p, 44. / 126., 1e-12);
}

TEST(KolmogorovSmirnovTest, MeetsItsLimitWhereSamplesAreLarge) {
  Values x, y;
  for (int i = 0; i < 2000; ++i) x.push_back(i / 2000.);
  for (int i = 0; i < 1000; ++i) y.push_back(std::pow(i / 1000., 1.1));
  const KolmogorovSmirnov ks = kolmogorov_smirnov(x, y);
  EXPECT_FALSE(ks.exact);
  EXPECT_NEAR(ks.statistic, .036, 1e-12);
  EXPECT_NEAR(ks.p, 0.34478531758895403, .01);  // SciPy's own approximation
}

TEST(KolmogorovSmirnovTest, GivesEveryPEquallyOften) {
  // χ² over ten classes; few distinct p are possible, so values are many and p is asked at 40 by 37 cells.
  std::vector<double> counts(10, 0.);
  for (std::uint64_t trial = 0; trial < 3000; ++trial) {
    Random random(3, trial);
    Values x(40), y(37);
    for (double& v : x) v = random.normal();
    for (double& v : y) v = random.normal();
    ++counts[std::min<std::size_t>(9, std::size_t(10. * kolmogorov_smirnov(x, y).p))];
  }
  double chi = 0.;
  for (const double c : counts) chi += (c - 300.) * (c - 300.) / 300.;
  EXPECT_LT(chi, 60.);  // p is discrete: wider than the 27.9 of a thousandth
  EXPECT_LT(counts[0], 300. + 4 * std::sqrt(300.));
}

TEST(KolmogorovSmirnovTest, KnowsNothingOfEmptyOrEqualSamples) {
  EXPECT_EQ(kolmogorov_smirnov({}, a).p, 1.);
  EXPECT_EQ(kolmogorov_smirnov(Values{std::nan("")}, a).p, 1.);
  EXPECT_EQ(kolmogorov_smirnov(a, a).p, 1.);
  EXPECT_EQ(kolmogorov_smirnov(Values{2, 2, 2}, Values{2, 2}).p, 1.);
  EXPECT_NEAR(kolmogorov_smirnov(Values{1, 2, 3}, Values{4, 5, 6}).p, .1, 1e-12);  // 2 of 20 dealings
}

TEST(Holm, MultipliesByHowManyAreLeft) {
  const Values p = holm(Values{.01, .04, .03, .005});
  EXPECT_NEAR(p[3], .02, 1e-15);
  EXPECT_NEAR(p[0], .03, 1e-15);
  EXPECT_NEAR(p[2], .06, 1e-15);
  EXPECT_NEAR(p[1], .06, 1e-15);  // never below one before it
  EXPECT_TRUE(holm({}).empty());
  EXPECT_EQ(holm(Values{.9, .8}), (Values{1., 1.}));
}

TEST(Effects, HaveTheirKnownSizes) {
  EXPECT_NEAR(cohens_d(a, b), 0.563777496141312, 1e-12);
  EXPECT_NEAR(area_under_curve(a, b).value, .636, 1e-12);  // scipy.stats.mannwhitneyu
  EXPECT_NEAR(cliffs_delta(a, b).value, .272, 1e-12);
  EXPECT_NEAR(median_visible_spread(a, b), 0.055013753438359604, 1e-12);  // numpy.percentile
  EXPECT_EQ(area_under_curve(Values{1, 2, 3}, Values{2}).value, .5);
  EXPECT_EQ(cliffs_delta(Values{1, 2}, Values{3, 4}).value, 1.);
  EXPECT_EQ(median_visible_spread(Values{1, 1}, Values{1, 1}), 0.);
  EXPECT_EQ(cohens_d(Values{1, 1}, Values{1, 1}), 0.);
  EXPECT_TRUE(std::isnan(cohens_d({}, b)));
}

TEST(AreaUnderCurve, HoldsTheTruthInNineteenOfTwentyCases) {
  const double truth = .5 * std::erfc(-1. / 2.);  // P(Y > X) for means 1 apart, sd 1: Φ(1/√2)
  int held = 0;
  for (std::uint64_t trial = 0; trial < 1000; ++trial) {
    Random random(8, trial);
    Values x(30), y(25);
    for (double& v : x) v = random.normal();
    for (double& v : y) v = random.normal(1.);
    const Estimate e = area_under_curve(x, y);
    held += e.lower <= truth && truth <= e.upper;
    EXPECT_LE(e.lower, e.value);
    EXPECT_GE(e.upper, e.value);
  }
  EXPECT_GT(held, 925);
  EXPECT_LT(held, 990);
}

TEST(AreaUnderCurve, IsNotCertainOfFewCellsThatAreFullyApart) {
  const Estimate few = area_under_curve(Values{1, 2, 3, 4}, Values{5, 6, 7, 8});
  EXPECT_EQ(few.value, 1.);
  EXPECT_EQ(few.upper, 1.);
  EXPECT_LT(few.lower, .9);
  Values low, high;
  for (int i = 0; i < 100; ++i) low.push_back(i), high.push_back(i + 1000);
  EXPECT_GT(area_under_curve(low, high).lower, .95);
}

TEST(AreaUnderCurve, OfOneCellOrAFewSaysLittle) {
  for (const std::size_t few : {1u, 3u}) {
    int held = 0;
    for (std::uint64_t trial = 0; trial < 500; ++trial) {
      Random random(9, trial);
      Values x(few), y(100);
      for (double& v : x) v = random.normal();
      for (double& v : y) v = random.normal();
      const Estimate e = area_under_curve(x, y);
      held += e.lower <= .5 && .5 <= e.upper;
    }
    EXPECT_GT(held, 465) << few;
  }
}

TEST(Quantile, IsInterpolated) {
  EXPECT_EQ(quantile(Values{4, 1, 3, 2}, .5), 2.5);
  EXPECT_EQ(quantile(Values{1, 2, 3}, 1.), 3.);
  EXPECT_TRUE(std::isnan(quantile({}, .5)));
}

}  // namespace
}  // namespace forest::statistics
