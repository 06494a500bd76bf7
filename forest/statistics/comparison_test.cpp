// SPDX-License-Identifier: Apache-2.0
#include "forest/statistics/comparison.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "forest/core/random.h"

namespace forest::statistics {
namespace {

FeatureTable cells(std::uint64_t seed, std::size_t count, double shift) {
  FeatureTable t;
  for (int f = 0; f < 8; ++f) t.features.push_back({"feature " + std::to_string(f), "µm", f == 7});
  t.values.resize(Eigen::Index(count), 8);
  for (std::size_t i = 0; i < count; ++i) {
    Random random(seed, i);
    t.cells.push_back(std::to_string(i));
    for (Eigen::Index f = 0; f < 8; ++f)
      t.values(Eigen::Index(i), f) = random.normal() + (f == 5 ? shift : 0.);
    t.sholl.push_back({1., 2. + random.normal(), 1.});
  }
  return t;
}

constexpr ComparisonOptions quick{.repeats = 10, .trees = 50, .permutations = 99, .dealings = 499, .seed = 1};

TEST(Compare, SaysByWhatPopulationsDiffer) {
  const Comparison c = compare(cells(1, 30, 0.), cells(2, 40, 3.), quick);
  EXPECT_TRUE(c.told_apart());
  EXPECT_EQ(c.differences.front().feature.name, "feature 5");
  EXPECT_GT(c.differences.front().delta.value, .8);
  EXPECT_GT(c.differences.front().importance, .4);
  EXPECT_LT(c.differences.front().p_holm, 1e-6);
  EXPECT_GT(c.forest.auc.value, .9);
  const std::string said = sentence(c, "old", "new");
  EXPECT_THAT(said, testing::HasSubstr("can be told apart"));
  EXPECT_THAT(said, testing::HasSubstr("feature 5 (larger in new)"));
}

TEST(Compare, DoesNotCountWhatOnePopulationAloneHas) {
  FeatureTable a = cells(1, 30, 0.), b = cells(2, 40, 3.);
  b.values.col(2).setConstant(NAN);
  const Comparison c = compare(a, b, quick);
  const auto alone =
      std::ranges::find_if(c.differences, [](const Difference& d) { return d.feature.name == "feature 2"; });
  ASSERT_NE(alone, c.differences.end());
  EXPECT_FALSE(alone->compared());
  EXPECT_EQ(alone->cells_a, 30u);
  EXPECT_EQ(alone->cells_b, 0u);
  EXPECT_EQ(c.compared(), std::size_t(std::ranges::count_if(c.differences, &Difference::compared)));
  EXPECT_LT(c.compared(), c.differences.size());
  EXPECT_THAT(sentence(c, "old", "new"), testing::HasSubstr(" 1 more is defined in one of the two alone."));
}

TEST(Compare, SaysWhatItCouldHaveSeenWhereItSeesNothing) {
  const Comparison c = compare(cells(3, 20, 0.), cells(4, 20, 0.), quick);
  EXPECT_FALSE(c.told_apart());
  EXPECT_GT(c.detectable_auc, .65);
  EXPECT_THAT(sentence(c, "a", "b"), testing::HasSubstr("cannot be told apart by these cells"));
}

}  // namespace
}  // namespace forest::statistics
