// SPDX-License-Identifier: Apache-2.0
#include "forest/core/random.h"

#include <cmath>
#include <functional>
#include <vector>

#include <boost/math/distributions/chi_squared.hpp>
#include <gtest/gtest.h>

namespace forest {
namespace {

// p value of Pearson's test that `draw` falls evenly into `bins` bins of probability 1 / bins each.
double chi_squared_p(int bins, int count, const std::function<int()>& draw) {
  std::vector<double> seen(static_cast<std::size_t>(bins));
  for (int i = 0; i < count; ++i) seen[static_cast<std::size_t>(draw())] += 1;
  const double expected = double(count) / bins;
  double sum = 0;
  for (double n : seen) sum += (n - expected) * (n - expected) / expected;
  return boost::math::cdf(boost::math::complement(boost::math::chi_squared(bins - 1), sum));
}

double normal_cdf(double x) { return 0.5 * std::erfc(-x / std::sqrt(2.)); }

TEST(Random, IsAPureFunctionOfSeedItemAndStream) {
  Random a(1, 2, 3), b(1, 2, 3), other_item(1, 3, 3), other_stream(1, 2, 4), other_seed(2, 2, 3);
  const auto first = a();
  EXPECT_EQ(first, b());
  EXPECT_NE(first, other_item());
  EXPECT_NE(first, other_stream());
  EXPECT_NE(first, other_seed());
}

TEST(Random, UniformIsUniform) {
  Random random(7);
  EXPECT_GT(chi_squared_p(64, 100000, [&] { return int(random.uniform() * 64); }), 1e-4);
}

TEST(Random, BelowIsUnbiased) {
  Random random(8);
  EXPECT_GT(chi_squared_p(7, 70000, [&] { return int(random.below(7)); }), 1e-4);
}

TEST(Random, NormalFollowsItsDistribution) {
  Random random(9);
  EXPECT_GT(chi_squared_p(32, 100000, [&] { return int(32 * normal_cdf((random.normal(3, 2) - 3) / 2)); }),
            1e-4);
}

TEST(Random, VonMisesFollowsItsDensityAllAroundTheCircle) {
  Random random(12);
  for (const double concentration : {0., 0.5, 3., 40.}) {
    constexpr int bins = 36;
    std::vector<double> part(bins, 0.);
    double total = 0.;
    for (int i = 0; i < 3600; ++i) {
      const double x = -180. + (i + .5) / 10.;
      const double d = std::exp(concentration * (std::cos((x - 170.) * 3.141592653589793 / 180.) - 1.));
      part[std::size_t(i / 100)] += d, total += d;
    }
    std::vector<double> seen(bins, 0.);
    for (int i = 0; i < 50000; ++i) {
      const double x = random.von_mises(170., concentration);
      ASSERT_TRUE(x > -180. && x <= 180.);
      ++seen[std::size_t(std::min(35., (x + 180.) / 10.))];
    }
    double sum = 0., rest = 0., rest_seen = 0.;
    int used = 0;
    for (int b = 0; b < bins; ++b) {
      const double expected = 50000. * part[std::size_t(b)] / total, here = seen[std::size_t(b)];
      if (expected < 5.) {
        rest += expected, rest_seen += here;
      } else {
        sum += (here - expected) * (here - expected) / expected, ++used;
      }
    }
    EXPECT_LT(rest_seen, rest + 5. * std::sqrt(rest) + 5.);
    EXPECT_GT(boost::math::cdf(boost::math::complement(boost::math::chi_squared(used - 1), sum)), 1e-4)
        << concentration;
  }
}

TEST(Random, TruncatedNormalFollowsItsDistributionAndKeepsItsLimits) {
  Random random(10);
  const double low = normal_cdf(-1.), high = normal_cdf(.5);
  EXPECT_GT(chi_squared_p(32, 100000,
                          [&] {
                            const double x = random.truncated_normal(5, 2, 3, 6);
                            EXPECT_TRUE(x >= 3 && x <= 6);
                            const double u = (normal_cdf((x - 5) / 2) - low) / (high - low);
                            return std::min(31, int(32 * u));
                          }),
            1e-4);
}

// The mean of a tail is known: sd times the density where it begins over what lies beyond, by Mills' ratio 1/a - 1/a³ + 3/a⁵ - ….
TEST(Random, TruncatedNormalIsRightFarFromItsMean) {
  for (const double a : {8., 20., 37., 50., 300.})
    for (const double side : {-1., 1.}) {
      Random random(12);
      double sum = 0.;
      constexpr int count = 20000;
      for (int i = 0; i < count; ++i) {
        const double x = side > 0. ? random.truncated_normal(3., 2., 3. + 2. * a, 3. + 2. * (a + 5.))
                                   : random.truncated_normal(3., 2., 3. - 2. * (a + 5.), 3. - 2. * a);
        ASSERT_GE(side * (x - 3.) / 2., a * (1. - 1e-12));
        ASSERT_LE(side * (x - 3.) / 2., a + 5.);
        sum += side * (x - 3.) / 2. - a;
      }
      const double beyond = 1. / a - 2. / std::pow(a, 3) + 10. / std::pow(a, 5);
      EXPECT_NEAR(sum / count, beyond, 5. * beyond / std::sqrt(count)) << a << ' ' << side;
    }
}

TEST(Random, GammaHasItsMeanAndVariance) {
  for (double shape : {0.4, 1., 5.}) {
    Random random(11);
    double sum = 0, squares = 0;
    const int count = 200000;
    for (int i = 0; i < count; ++i) {
      const double x = random.gamma(shape, 2.);
      sum += x, squares += x * x;
    }
    const double mean = sum / count, variance = squares / count - mean * mean;
    EXPECT_NEAR(mean, 2 * shape, 6 * std::sqrt(4 * shape / count));
    EXPECT_NEAR(variance / (4 * shape), 1., .05);
  }
}

}  // namespace
}  // namespace forest
