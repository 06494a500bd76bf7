// SPDX-License-Identifier: Apache-2.0
#include "forest/statistics/features.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "forest/core/error.h"
#include "forest/morphology/transform.h"

#include "tests/zoo.h"

namespace forest::statistics {
namespace {

constexpr double nan = std::numeric_limits<double>::quiet_NaN();

FeatureTable small_table(const std::vector<std::vector<double>>& rows) {
  FeatureTable t;
  t.values.resize(Eigen::Index(rows.size()), Eigen::Index(rows[0].size()));
  for (std::size_t c = 0; c < rows[0].size(); ++c)
    t.features.push_back({"f" + std::to_string(c), "µm", c == 1});
  for (std::size_t r = 0; r < rows.size(); ++r) {
    t.cells.push_back("cell" + std::to_string(r));
    for (std::size_t c = 0; c < rows[r].size(); ++c) t.values(Eigen::Index(r), Eigen::Index(c)) = rows[r][c];
  }
  return t;
}

std::vector<std::string> names(const FeatureTable& t) {
  std::vector<std::string> names;
  for (const Feature& f : t.features) names.push_back(f.name);
  return names;
}

TEST(Groups, AreTheSelectionAndItsKinds) {
  const auto words = [](std::string_view word) {
    std::vector<std::string> names;
    for (const Group& g : groups_of(word)) names.push_back(g.name);
    return names;
  };
  EXPECT_EQ(words("all"), (std::vector<std::string>{"all", "basal", "apical", "axon"}));
  EXPECT_EQ(words("dendrite"), (std::vector<std::string>{"dendrite", "basal", "apical"}));
  EXPECT_EQ(words("axon"), (std::vector<std::string>{"axon"}));
  EXPECT_THROW(groups_of("dragon"), Error);
}

TEST(Features, FillTheirColumnsForAnyNeuron) {
  const auto groups = groups_of("all");
  const auto features = features_of(groups);
  EXPECT_GT(features.size(), 200u);
  auto sorted = features;
  std::ranges::sort(sorted, {}, &Feature::name);
  EXPECT_EQ(std::ranges::adjacent_find(sorted, {}, &Feature::name), sorted.end());
  for (const Specimen& s : zoo()) {
    SCOPED_TRACE(s.name);
    const Measured m = measure(s.morphology, groups);
    ASSERT_EQ(m.features.size(), features.size());
    for (const double x : m.features) EXPECT_FALSE(std::isinf(x));
    for (std::size_t i = 0; i < features.size(); ++i)
      if (features[i].name == "all number_of_leaves") {
        EXPECT_EQ(m.features[i], double(s.tips));
      }
  }
}

TEST(Features, ReadShollsCurveAtFixedRadii) {
  const auto groups = groups_of("basal");
  const auto features = features_of(groups);
  const Measured m = measure(zoo_parts::binary_tree(3), groups);
  const auto value = [&](std::string_view name) {
    const auto at = std::ranges::find(features, name, &Feature::name);
    return at == features.end() ? nan : m.features[std::size_t(at - features.begin())];
  };
  ASSERT_GE(m.sholl.size(), 4u);
  EXPECT_EQ(value("basal sholl_crossings at 20 µm"), m.sholl[1]);
  EXPECT_EQ(value("basal sholl_crossings at 40 µm"), m.sholl[3]);
  EXPECT_EQ(value("basal sholl_crossings at 1000 µm"), 0.);
  EXPECT_EQ(value("basal sholl_maximum"), *std::ranges::max_element(m.sholl));
  EXPECT_EQ(m.bars.size(), 8u);  // one a tip
  const Measured moved = measure(translated(zoo_parts::binary_tree(3), {64, -128, 32}), groups);
  for (std::size_t i = 0; i < features.size(); ++i)
    EXPECT_TRUE(moved.features[i] == m.features[i] || std::isnan(m.features[i])) << features[i].name;
}

TEST(Distinct, LeavesOutWhatSaysNothingAndWhatIsSaidTwice) {
  const FeatureTable t = distinct(small_table({{1, 7, 1, nan, 5}, {2, 7, 2, nan, 4}, {4, 7, 4, nan, 3}}));
  EXPECT_EQ(names(t), (std::vector<std::string>{"f0", "f4"}));
}

TEST(Distinct, SaysOnceWhichCellsHaveNoValue) {
  const FeatureTable t =
      distinct(small_table({{1, nan, nan, 3}, {2, 5, 9, 4}, {3, 6, 8, 3}, {4, 5, 2, nan}}));
  EXPECT_EQ(names(t), (std::vector<std::string>{"f0", "f1", "f1 is defined", "f2", "f3", "f3 is defined"}));
  EXPECT_EQ(t.values.col(2), (Eigen::Vector4d(0, 1, 1, 1)));
  EXPECT_TRUE(t.features[2].diameters);
  EXPECT_TRUE(std::isnan(t.values(0, 1)));
}

TEST(Completed, TakesTheMedianForWhatIsMissing) {
  const FeatureTable t = completed(small_table({{1, nan}, {2, 5}, {3, 6}, {4, 10}}));
  EXPECT_EQ(t.values.col(1), (Eigen::Vector4d(6, 5, 6, 10)));
  EXPECT_TRUE(t.values.allFinite());
  const Eigen::MatrixXd X = standardised(t);
  EXPECT_NEAR(X.colwise().sum().norm(), 0., 1e-12);
  EXPECT_NEAR(X.col(0).squaredNorm(), 3., 1e-12);
}

TEST(Slopes, AreOfBranchesInTheSliceAndOfNothingElse) {
  const std::vector<Group> groups = groups_of("all");
  const FeatureTable all = table_of({}, groups, {});
  const FeatureTable slopes = slopes_of(all);
  const auto has = [&](const char* name) {
    return std::ranges::count(slopes.features, name, &Feature::name) > 0;
  };
  EXPECT_TRUE(has("all length_fraction_along_z"));
  EXPECT_TRUE(has("basal segment_elevations sd"));
  EXPECT_FALSE(has("all depth"));
  EXPECT_FALSE(has("all total_length"));
}

TEST(Features, OfAllTogetherTwoAreAskedOfAlone) {
  std::vector<std::string> asked;
  for (const Feature& f : features_of(groups_of("all")))
    if (!f.alone.empty()) asked.push_back(std::string(f.alone) + ": " + f.name);
  EXPECT_EQ(asked, (std::vector<std::string>{"level: all level_segment_fraction",
                                             "depth: all length_along_z_by_x"}));
}

TEST(Unlike, LeavesOutWhatFollowsFromOneBefore) {
  const FeatureTable t =
      small_table({{1, 1, 5, -1}, {2, 8, 1, -2}, {3, 27, 4, -3}, {4, 64, 2, -4}, {5, 65, 3, -5}});
  const std::array<std::size_t, 4> order{1, 0, 2, 3};
  EXPECT_EQ(unlike(t, order, 9), (std::vector<std::size_t>{1, 2}));
  EXPECT_EQ(unlike(t, order, 1), (std::vector<std::size_t>{1}));
}

TEST(Tables, AreStackedCutAndStrippedOfDiameters) {
  const std::array<FeatureTable, 2> two{small_table({{1, 2}, {3, 4}}), small_table({{5, 6}})};
  const FeatureTable all = stacked(two);
  EXPECT_EQ(all.size(), 3u);
  EXPECT_EQ(all.values(2, 1), 6.);
  const std::array<std::size_t, 2> rows{2, 0};
  EXPECT_EQ(rows_of(all, rows).values.col(0), Eigen::Vector2d(5, 1));
  EXPECT_EQ(names(structure_of(all)), std::vector<std::string>{"f0"});
  const std::array<FeatureTable, 2> unlike{two[0], small_table({{1, 2, 3}})};
  EXPECT_THROW(stacked(unlike), Error);
}

}  // namespace
}  // namespace forest::statistics
