// SPDX-License-Identifier: Apache-2.0
#include "forest/statistics/summary.h"

#include <cmath>
#include <limits>
#include <vector>

#include <gtest/gtest.h>

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

}  // namespace
}  // namespace forest::statistics
