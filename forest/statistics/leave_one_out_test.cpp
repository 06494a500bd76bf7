// SPDX-License-Identifier: Apache-2.0
#include "forest/statistics/leave_one_out.h"

#include <algorithm>
#include <cmath>

#include <gtest/gtest.h>

#include "forest/core/error.h"
#include "forest/core/random.h"

namespace forest::statistics {
namespace {

constexpr Eigen::Index features = 20;

FeatureTable cells(std::uint64_t seed, std::size_t count, double shift = 0.) {
  FeatureTable t;
  for (Eigen::Index f = 0; f < features; ++f)
    t.features.push_back({"feature " + std::to_string(f), "", f >= 15});
  t.values.resize(Eigen::Index(count), features);
  for (std::size_t i = 0; i < count; ++i) {
    Random random(seed, i);
    t.cells.push_back(std::to_string(seed) + "-" + std::to_string(i));
    for (Eigen::Index f = 0; f < features; ++f)
      t.values(Eigen::Index(i), f) = random.normal() + (f < 5 ? shift : 0.);
  }
  return t;
}

std::vector<FeatureTable> grown(std::uint64_t seed, std::size_t traced, std::size_t each, double shift = 0.) {
  std::vector<FeatureTable> out;
  for (std::size_t i = 0; i < traced; ++i) out.push_back(cells(1000 * seed + i, each, shift));
  return out;
}

const LeaveOneOutOptions quick{.repeats = 6, .trees = 30};

TEST(LeaveOneOut, CellsOfThePopulationAreHardlyEverToldApart) {
  int told = 0;
  double area = 0.;
  constexpr int trials = 40;
  for (int trial = 0; trial < trials; ++trial) {
    const auto result =
        leave_one_out(cells(std::uint64_t(trial), 7), grown(500 + std::uint64_t(trial), 7, 39), quick);
    told += result.told_apart();
    area += result.structure.value / trials;
  }
  EXPECT_LE(told, 9);  // three questions at 5 %
  EXPECT_NEAR(area, .5, .06);
}

// Chances of ranks are right also where most grown cells have no value.
TEST(LeaveOneOut, RanksAmongFewAreNoStrangerThanTheyAre) {
  int below = 0, asked = 0;
  for (std::uint64_t trial = 0; trial < 60; ++trial) {
    auto others = grown(900 + trial, 5, 100);
    for (FeatureTable& g : others) g.values.bottomRows(81).setConstant(NAN), g.values(99, 0) = 0.;
    const auto result = leave_one_out(cells(trial, 5), others, {.repeats = 1, .trees = 1});
    for (const PairedFeature& f : result.features) below += f.p <= .05, ++asked;
  }
  ASSERT_GT(asked, 1000);
  EXPECT_LT(below, asked * 6 / 100);
}

TEST(LeaveOneOut, FindsWhatIsFarOffAndNamesIt) {
  const auto result = leave_one_out(cells(1, 8), grown(2, 8, 59, 4.), quick);
  EXPECT_TRUE(result.told_apart());
  EXPECT_EQ(result.strange, 8u);
  EXPECT_LT(result.strange_p, 1e-6);
  EXPECT_GT(result.structure.value, .95);
  EXPECT_GE(result.rejections, 4u);
  EXPECT_LE(result.rejections, 6u);
  EXPECT_GT(result.features.front().auc, .95);  // grown ones are larger
  EXPECT_NE(sentence(result).find("Even so they are told apart"), std::string::npos) << sentence(result);
}

TEST(LeaveOneOut, AsksNothingTwice) {
  FeatureTable traced = cells(1, 8);
  std::vector<FeatureTable> others = grown(2, 8, 59, 1.);
  const auto once = leave_one_out(traced, others, quick);
  const auto repeat = [](FeatureTable& t) {
    t.features.push_back({"the first again", "", false});
    t.features.push_back({"the same in all", "", false});
    t.values.conservativeResize(Eigen::NoChange, features + 2);
    t.values.col(features) = t.values.col(0), t.values.col(features + 1).setConstant(3.);
  };
  repeat(traced);
  for (FeatureTable& t : others) repeat(t);
  const auto twice = leave_one_out(traced, others, quick);
  ASSERT_EQ(twice.features.size(), once.features.size());
  for (std::size_t f = 0; f < once.features.size(); ++f) {
    EXPECT_EQ(twice.features[f].feature.name, once.features[f].feature.name);
    EXPECT_EQ(twice.features[f].p_holm, once.features[f].p_holm);
  }
}

TEST(LeaveOneOut, SaysThatFewCellsCannotShowEquality) {
  const auto few = leave_one_out(cells(3, 4), grown(4, 4, 39), quick),
             more = leave_one_out(cells(3, 12), grown(4, 12, 39), quick);
  EXPECT_GT(few.detectable_auc, more.detectable_auc);
  EXPECT_GT(few.detectable_auc, .8);
  EXPECT_NE(sentence(few).find("4 cells cannot show that grown cells equal traced ones"), std::string::npos);
  EXPECT_NE(sentence(few).find("could be told among 59"), std::string::npos) << sentence(few);
  EXPECT_GT(few.structure.upper - few.structure.lower, more.structure.upper - more.structure.lower);
}

TEST(LeaveOneOut, CopiesLieNearerThanNewCells) {
  const FeatureTable traced = cells(5, 8);
  std::vector<FeatureTable> copies = grown(6, 8, 39);
  for (std::size_t i = 0; i < 8; ++i)
    for (Eigen::Index g = 0; g < 39; ++g)
      copies[i].values.row(g) =
          traced.values.row(Eigen::Index((i + 1 + std::size_t(g) % 7) % 8)) + .1 * copies[i].values.row(g);
  EXPECT_LT(leave_one_out(traced, copies, quick).neighbour_ratio, .3);
  EXPECT_GT(leave_one_out(traced, grown(6, 8, 39), quick).neighbour_ratio, .8);
}

TEST(LeaveOneOut, SistersAreLeftOutTogetherAndWhatIsMissingIsPassedOver) {
  FeatureTable traced = cells(7, 6);
  traced.slices = {"a", "a", "b", "b", "c", "c"};
  traced.values.col(3).setConstant(NAN);
  traced.values(0, 4) = NAN;
  const auto result = leave_one_out(traced, grown(8, 6, 39), quick);
  EXPECT_EQ(result.cells.size(), 6u);
  for (const PairedFeature& f : result.features) {
    EXPECT_NE(f.feature.name, "feature 3");
    EXPECT_EQ(f.cells, f.feature.name == "feature 4" ? 5u : 6u);
    EXPECT_TRUE(f.p > 0. && f.p <= 1.);
  }
  traced.slices.assign(6, "one");
  EXPECT_THROW((void)leave_one_out(traced, grown(8, 6, 39), quick), Error);
}

TEST(LeaveOneOut, TooFewAreRefused) {
  EXPECT_THROW((void)leave_one_out(cells(1, 2), grown(2, 2, 39), quick), Error);
  EXPECT_THROW((void)leave_one_out(cells(1, 4), grown(2, 4, 5), quick), Error);
  EXPECT_THROW((void)leave_one_out(cells(1, 4), grown(2, 3, 39), quick), Error);
  std::vector<FeatureTable> other = grown(2, 4, 39);
  other[2].features[0].name = "another";
  EXPECT_THROW((void)leave_one_out(cells(1, 4), other, quick), Error);
}

TEST(LeaveOneOut, TheSameSeedGivesTheSame) {
  const auto a = leave_one_out(cells(1, 5), grown(2, 5, 39), quick),
             b = leave_one_out(cells(1, 5), grown(2, 5, 39), quick);
  EXPECT_EQ(a.structure.value, b.structure.value);
  EXPECT_EQ(a.features.front().p, b.features.front().p);
}

}  // namespace
}  // namespace forest::statistics
