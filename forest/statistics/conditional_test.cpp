// SPDX-License-Identifier: Apache-2.0
#include "forest/statistics/conditional.h"

#include <cmath>
#include <limits>

#include <gtest/gtest.h>

#include "forest/core/error.h"

namespace forest::statistics {
namespace {

constexpr double nan = std::numeric_limits<double>::quiet_NaN();

TEST(Conditional, BinsHoldTheLeastCountAndPartNoEqualValues) {
  Random random(1);
  std::vector<double> orders;
  for (int i = 0; i < 2000; ++i) orders.push_back(std::floor(random.exponential(3.)));
  orders.push_back(nan);
  const auto edges = bin_edges(orders, {.least = 85});
  ASSERT_GE(edges.size(), 3u);
  std::vector<std::size_t> held(edges.size());
  for (std::size_t i = 0; i < 2000; ++i) ++held[bin_of(edges, orders[i])];
  for (const std::size_t n : held) EXPECT_GE(n, 85u);
  EXPECT_EQ(edges.back(), *std::max_element(orders.begin(), orders.end() - 1));
  EXPECT_EQ(bin_of(edges, 1e9), edges.size() - 1);
  EXPECT_EQ(bin_of(edges, edges[0]), 0u);
  EXPECT_EQ(bin_edges(std::vector{nan}).size(), 0u);
  EXPECT_EQ(bin_edges(std::vector{3., 1., 2.}), std::vector{3.});
  EXPECT_LE(bin_edges(orders, {.least = 1, .most = 4}).size(), 4u);
}

TEST(Conditional, FollowsValuesThatDependOnWhatIsGiven) {
  Random random(2);
  std::vector<double> x, y;
  for (int i = 0; i < 20000; ++i)
    x.push_back(random.uniform(0, 100)), y.push_back(random.normal(x.back(), 1.));
  y[7] = nan, x[9] = nan;
  const Conditional c = conditional(y, x, {.least = 200, .most = 50});
  EXPECT_EQ(c.bins.size(), 49u);  // the last one takes what is left
  for (const double at : {5., 33., 91.}) {
    EXPECT_NEAR(c.quantile(at, 0.5), at, 2.);
    for (const double p : {0., 0.1, 0.5, 0.93, 1.}) EXPECT_NEAR(c.cdf(at, c.quantile(at, p)), p, 1e-9);
    double sum = 0.;
    for (int i = 0; i < 400; ++i) sum += c.draw(at, random);
    EXPECT_NEAR(sum / 400., at, 2.);
  }
  EXPECT_EQ(c.quantile(1e9, 0.5), c.bins.back().quantiles[8]);
  EXPECT_THROW(conditional(std::vector{nan}, std::vector{1.}), Error);
}

TEST(Conditional, ChancesByBins) {
  std::vector<char> forks;
  std::vector<double> orders;
  for (int order = 0; order < 3; ++order)
    for (int i = 0; i < 100; ++i) orders.push_back(order), forks.push_back(i < 90 - 30 * order);
  const auto bins = chance_by(forks, orders);
  ASSERT_EQ(bins.size(), 3u);
  EXPECT_EQ(bins[1].count, 100u);
  EXPECT_DOUBLE_EQ(bins[1].chance.value, 0.6);
  EXPECT_LT(bins[1].chance.lower, 0.6);
  EXPECT_EQ(table_text("fork", bins), "table fork = 0: 0.9, 1: 0.6, 2: 0.3");
}

TEST(Conditional, ItsTextCanBeRead) {
  const std::vector<double> values{1, 2, 3, 4, 10, 20, 30, 40}, orders{0, 0, 0, 0, 1, 1, 1, 1};
  EXPECT_EQ(conditional(values, orders, {.least = 4}, 2).text("length", "order"),
            "# 4 values with order up to 0\n"
            "table length_1 = 0: 1, 1: 2.5, 2: 4\n"
            "function length_1_at(u) = length_1(floor(u)) + (length_1(floor(u) + 1) - length_1(floor(u))) * "
            "(u - floor(u))\n"
            "# 4 values with order above that, to 1\n"
            "table length_2 = 0: 10, 1: 25, 2: 40\n"
            "function length_2_at(u) = length_2(floor(u)) + (length_2(floor(u) + 1) - length_2(floor(u))) * "
            "(u - floor(u))\n"
            "distribution length(order) = if(order <= 0, length_1_at(uniform(0, 2)), length_2_at(uniform(0, "
            "2)))\n");
}

}  // namespace
}  // namespace forest::statistics
