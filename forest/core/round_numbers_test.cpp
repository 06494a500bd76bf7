// SPDX-License-Identifier: Apache-2.0
#include "forest/core/round_numbers.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include <gtest/gtest.h>

namespace forest {
namespace {

TEST(RoundNumbers, LieBelowAndAboveANumberAndNextToEachOther) {
  for (double x = 1.1e-6; x < 1e9; x *= 1.37) {
    const double below = round_below(x), above = round_above(x);
    EXPECT_LE(below, x);
    EXPECT_GE(above, x);
    const double ratio = above / below;  // 1 → 2, 2 → 5, 5 → 10
    EXPECT_TRUE(std::abs(ratio - 2.) < 1e-9 || std::abs(ratio - 2.5) < 1e-9) << x;
    const double first = below / std::pow(10., std::floor(std::log10(below) + 1e-9));
    EXPECT_LT(std::min({std::abs(first - 1.), std::abs(first - 2.), std::abs(first - 5.)}), 1e-9) << x;
  }
}

TEST(RoundNumbers, AreTheLongestThatAScaleBarHasRoomFor) {
  for (const auto& [longest, length] :
       {std::pair(99., 50.), {100., 100.}, {.3, .2}, {7., 5.}, {1999., 1000.}})
    EXPECT_NEAR(round_below(longest), length, 1e-9 * length);
}

TEST(RoundNumbers, AreTheirOwnNeighbours) {
  for (const double x : {1., 2., 5., 10., 200., 5000.}) {
    EXPECT_EQ(round_below(x), x);
    EXPECT_EQ(round_above(x), x);
  }
}

TEST(Ticks, AreRoundAndWithinAndNoMoreThanAskedFor) {
  EXPECT_EQ(ticks(0., 100., 5), (std::vector<double>{0., 20., 40., 60., 80., 100.}));
  EXPECT_EQ(ticks(-3., 3., 3), (std::vector<double>{-2., 0., 2.}));
  for (const double low : {-1e4, -.3, 0., 17.5})
    for (const double span : {.07, 1., 333., 1e6})
      for (const int count : {1, 3, 8}) {
        const auto all = ticks(low, low + span, count);
        EXPECT_LE(all.size(), std::size_t(count) + 1);
        for (const double t : all) {
          EXPECT_GE(t, low - 1e-6 * span);
          EXPECT_LE(t, low + span * (1. + 1e-6));
        }
      }
}

TEST(Ticks, OfNoSpanAreWhereItBegins) {
  EXPECT_EQ(ticks(4., 4., 5), (std::vector<double>{4.}));
  EXPECT_EQ(ticks(4., std::numeric_limits<double>::infinity(), 5), (std::vector<double>{4.}));
  EXPECT_EQ(ticks(376.99111843077515, 376.9911184307752, 4).size(), 1u);  // a rounding apart
  EXPECT_EQ(ticks(-1e15, -1e15 + .25, 4).size(), 1u);
}

}  // namespace
}  // namespace forest
