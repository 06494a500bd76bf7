// SPDX-License-Identifier: Apache-2.0
#include "forest/statistics/typical.h"

#include <algorithm>
#include <array>
#include <cmath>

#include <gtest/gtest.h>

#include "forest/core/error.h"
#include "forest/core/random.h"

namespace forest::statistics {
namespace {

FeatureTable cells(std::uint64_t seed, std::size_t count) {
  FeatureTable t;
  for (int f = 0; f < 30; ++f) t.features.push_back({"feature " + std::to_string(f), "", false});
  t.values.resize(Eigen::Index(count), 30);
  for (std::size_t i = 0; i < count; ++i) {
    Random random(seed, i);
    t.cells.push_back(std::to_string(i));
    for (Eigen::Index f = 0; f < 30; ++f)
      t.values(Eigen::Index(i), f) =
          f % 3 ? random.normal() : std::exp(random.normal());  // some with long tails
  }
  return t;
}

TEST(Typicality, GivesEveryPEquallyOftenToCellsOfThePopulation) {
  int small = 0, tiny = 0;
  for (std::uint64_t trial = 0; trial < 300; ++trial) {
    const Typicality t = typicality(cells(trial, 39), cells(10000 + trial, 1));
    small += t.p_whole <= .1;
    tiny += t.p <= .05;
  }
  EXPECT_NEAR(small, 30, 16);
  EXPECT_LT(tiny, 28);  // at most 15 expected
}

TEST(Typicality, NamesTheMetricThatMakesACellAbnormal) {
  FeatureTable cell = cells(77, 1);
  cell.values(0, 7) = 9.;
  const Typicality t = typicality(cells(1, 60), cell);
  EXPECT_LE(t.p, .05);
  EXPECT_EQ(t.oddities.front().feature.name, "feature 7");
  EXPECT_TRUE(t.oddities.front().abnormal);
  EXPECT_FALSE(t.oddities.back().abnormal);
  EXPECT_GT(t.oddities.front().value, t.oddities.front().high);
  EXPECT_EQ(t.cells, 60u);
}

// Nine of ten cells do not have it: what would be filled in for them says nothing of how far it goes among the others.
TEST(Typicality, SetsAMetricBesideTheCellsThatHaveIt) {
  FeatureTable population = cells(1, 100), cell = cells(78, 1);
  for (Eigen::Index i = 0; i < 90; ++i) population.values(i, 1) = NAN;
  cell.values(0, 1) = 1.5;
  const Typicality t = typicality(population, cell);
  const auto of = [](const Typicality& found, std::string_view name) {
    return std::ranges::find_if(found.oddities, [&](const Oddity& o) { return o.feature.name == name; });
  };
  const auto rare = of(t, "feature 1");
  ASSERT_NE(rare, t.oddities.end());
  EXPECT_LT(rare->low, -.5);
  EXPECT_GT(rare->high, .5);
  EXPECT_FALSE(rare->abnormal);
  EXPECT_GE(rare->p, 1. / 11.);
  cell.values(0, 1) = NAN;  // and nothing is said of what the cell has not got
  const Typicality without = typicality(population, cell);
  EXPECT_EQ(of(without, "feature 1"), without.oddities.end());
}

TEST(Typicality, SeesACellThatIsABitOffInEverything) {
  FeatureTable cell = cells(78, 1);
  cell.values.array() += 1.6;
  EXPECT_LE(typicality(cells(1, 60), cell).p, .05);
}

TEST(Typicality, SeesACellOfWhichLittleIsKnown) {
  FeatureTable cell = cells(79, 1);
  cell.values.leftCols(25).setConstant(std::nan(""));
  const Typicality t = typicality(cells(1, 60), cell);
  EXPECT_NEAR(t.p_missing, 1. / 61., 1e-12);
  EXPECT_LE(t.p, .05);
  EXPECT_GT(t.oddities.front().strangeness, 2.);  // "… is defined", which it is in all the others
}

// Four metrics of six cells, by hand. Ranges of the six: 1–6, 1–2, 0–9, and 5–9 of the five that have the last.
TEST(Typicality, CountsMetricsOutsideTheRangeOfAllOthers) {
  FeatureTable population;
  for (const char* name : {"a", "b", "c", "d"}) population.features.push_back({name, "", false});
  population.values.resize(6, 4);
  population.values << 1., 1., 0., 5.,  // first in a and d; in b another is as small, in c too
      2., 1., 0., 6.,                   //
      3., 2., 1., 7.,                   //
      4., 2., 2., 8.,                   //
      5., 1.5, 3., 9.,                  // last in d
      6., 1.7, 9., NAN;                 // last in a and c
  FeatureTable cell = population;
  population.cells = {"0", "1", "2", "3", "4", "5"};
  cell.cells = {"asked"};
  cell.values.resize(1, 4);
  cell.values << 7., 2., -1., 8.5;  // outside in a and c; at the end of b's range is not outside
  const Typicality t = typicality(population, cell);
  EXPECT_EQ(t.metrics, 4u);
  EXPECT_EQ(t.outside, 2u);
  EXPECT_EQ(t.outside_usual, .5);  // of 2, 0, 0, 0, 1, 2
  EXPECT_EQ(t.outside_most, 2u);
  EXPECT_EQ(t.as_much_outside, 2u);
  for (const Oddity& o : t.oddities) {
    const std::string& name = o.feature.name;
    EXPECT_EQ(o.outside, name == "a" || name == "c") << name;
  }

  cell.values(0, 3) = NAN;  // what it has not got counts for no cell
  const Typicality without = typicality(population, cell);
  EXPECT_EQ(without.metrics, 3u);
  EXPECT_EQ(without.outside_usual, 0.);  // of 1, 0, 0, 0, 0, 2
}

// A cell of the population is outside in as many metrics as any other of them: in 2 of n + 1 on average.
TEST(Typicality, FindsCellsOfThePopulationOutsideAsOftenAsOneAnother) {
  double asked = 0., usual = 0.;
  int beyond = 0;
  for (std::uint64_t trial = 0; trial < 300; ++trial) {
    const Typicality t = typicality(cells(trial, 19), cells(10000 + trial, 1));
    asked += double(t.outside) / 300., usual += t.outside_usual / 300.;
    beyond += t.outside > t.outside_most;
  }
  EXPECT_NEAR(asked, 30. * 2. / 20., .4);
  EXPECT_NEAR(usual, 30. * 2. / 19., .6);
  EXPECT_LT(beyond, 25);  // at most 15 expected
  FeatureTable odd = cells(77, 1);
  odd.values.array() += 50.;
  const Typicality t = typicality(cells(1, 19), odd);
  EXPECT_EQ(t.outside, 30u);
  EXPECT_GT(t.outside, t.outside_most);
  EXPECT_EQ(t.as_much_outside, 0u);
}

TEST(Typicality, LeavesTheCellItselfOutOfItsPopulation) {
  const FeatureTable all = cells(1, 20);
  const std::array<std::size_t, 1> third{3};
  EXPECT_EQ(typicality(all, rows_of(all, third)).cells, 19u);
  EXPECT_THROW(typicality(cells(1, 4), cells(2, 1)), Error);
}

}  // namespace
}  // namespace forest::statistics
