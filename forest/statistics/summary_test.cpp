// SPDX-License-Identifier: Apache-2.0
#include "forest/statistics/summary.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include <gtest/gtest.h>

#include "forest/core/random.h"

namespace forest::statistics {
namespace {

constexpr double nan = std::numeric_limits<double>::quiet_NaN();

TEST(Summary, IsOfTheDefinedValues) {
  const Summary s = summarize(std::vector{4., nan, 1., 3., nan, 8.});
  EXPECT_EQ(s.count, 4u);
  EXPECT_EQ(s.mean, 4.);
  EXPECT_NEAR(s.sd, std::sqrt(26. / 3.), 1e-12);
  EXPECT_EQ(s.min, 1.);
  EXPECT_EQ(s.median, 3.5);
  EXPECT_EQ(s.max, 8.);
  EXPECT_EQ(summarize(std::vector{9., 2., 5.}).median, 5.);
}

TEST(Summary, OfOneValueHasNoSpreadAndOfNoneHasNoMean) {
  EXPECT_EQ(summarize(std::vector{7.}).sd, 0.);
  const Summary none = summarize(std::vector{nan});
  EXPECT_EQ(none.count, 0u);
  EXPECT_TRUE(std::isnan(none.mean) && std::isnan(none.median));
}

TEST(Summary, KeepsItsSpreadFarFromZero) {
  EXPECT_NEAR(summarize(std::vector{1e9 + 1., 1e9 + 2., 1e9 + 3.}).sd, 1., 1e-6);
}

TEST(Summary, IsThatOfThePlainDefinitions) {
  Random random(1);
  for (const std::size_t count : {1u, 2u, 7u, 8u, 9u, 500u, 1024u, 5000u, 5001u})
    for (const bool skewed : {false, true}) {
      std::vector<double> values, defined;
      for (std::size_t i = 0; i < count; ++i) {
        values.push_back(skewed ? std::exp(random.normal(0., 9.)) : std::round(random.normal(0., 30.)));
        defined.push_back(values.back());
        if (i % 5 == 4) values.push_back(nan);
      }
      double sum = 0., squares = 0.;
      for (const double x : defined) sum += x;
      const double expected = sum / double(count);
      for (const double x : defined) squares += (x - expected) * (x - expected);
      std::ranges::sort(defined);
      const Summary s = summarize(values);
      EXPECT_EQ(s.count, count);
      EXPECT_NEAR(s.mean, expected, 1e-12 * (1. + std::abs(expected)));
      EXPECT_NEAR(mean(values), expected, 1e-12 * (1. + std::abs(expected)));
      EXPECT_NEAR(s.sd, count > 1 ? std::sqrt(squares / double(count - 1)) : 0., 1e-9 * (1. + s.sd));
      EXPECT_EQ(s.min, defined.front());
      EXPECT_EQ(s.max, defined.back());
      EXPECT_EQ(s.median, 0.5 * (defined[(count - 1) / 2] + defined[count / 2])) << count << skewed;
    }
}

}  // namespace
}  // namespace forest::statistics
