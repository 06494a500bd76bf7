// SPDX-License-Identifier: Apache-2.0
#include <cmath>

#include <gtest/gtest.h>

#include "forest/core/error.h"
#include "forest/fitting/burke.h"
#include "forest/fitting/hillman.h"
#include "forest/lsystem/grow.h"
#include "forest/morphology/measure.h"
#include "forest/morphology/validate.h"
#include "forest/statistics/metric.h"
#include "forest/statistics/summary.h"

#include "tests/zoo.h"

namespace forest::fitting {
namespace {

double mean_of(const std::vector<Morphology>& cells, std::string_view metric) {
  std::vector<double> values;
  for (const Morphology& m : cells)
    values.push_back(statistics::mean(statistics::find_metric(metric)->values(statistics::Arbors(m))));
  return statistics::mean(values);
}

// Cells that were grown by rules of this very kind: what is estimated from them grows such cells again.
TEST(Burke, GrowsCellsLikeThoseOfBurkesOwnModel) {
  const auto grammar = lsystem::parse_file(std::string(FOREST_SOURCE_DIR) + "/data/grammars/motoneuron.lsys");
  const auto cells = lsystem::grow_population(grammar, 30, 1992);
  std::vector<Corrected> corrected;
  const std::string text =
      burke_grammar(cells, "like motoneurons", {.tell = [&](const Corrected& c) { corrected.push_back(c); }});
  EXPECT_EQ(text, burke_grammar(cells, "like motoneurons"));
  ASSERT_EQ(corrected.size(), 1u);
  EXPECT_NEAR(corrected[0].traced, mean_of(cells, "number_of_leaves"), 1e-6);
  EXPECT_NEAR(corrected[0].grown / corrected[0].traced, 1., .1);
  const auto again = lsystem::grow_population(lsystem::parse(text, "burke"), 60, 7);
  const struct {
    const char* metric;
    double within;  // of the mean
  } rows[] = {
      {"number_of_neurites", 0.1},     {"number_of_leaves", 0.25},          {"total_length", 0.3},
      {"section_lengths", 0.25},       {"max_path_distance", 0.15},         {"trunk_origin_radii", 0.1},
      {"parent_daughter_ratio", 0.15}, {"remote_bifurcation_angles", 0.25}, {"contraction", 0.06}};
  for (const auto& row : rows) {
    const double wanted = mean_of(cells, row.metric), got = mean_of(again, row.metric);
    EXPECT_NEAR(got / wanted, 1., row.within) << row.metric << ": " << got << " for " << wanted;
  }
  for (const Morphology& m : again)
    for (const Finding& f : validate(m)) EXPECT_NE(f.severity, Severity::warning) << f.sentence;
}

TEST(Hillman, GrowsCellsLikeThoseOfBurkesModelToo) {
  const auto grammar = lsystem::parse_file(std::string(FOREST_SOURCE_DIR) + "/data/grammars/motoneuron.lsys");
  const auto cells = lsystem::grow_population(grammar, 30, 1992);
  const std::string text = hillman_grammar(cells, "like motoneurons");
  EXPECT_EQ(text, hillman_grammar(cells, "like motoneurons"));
  const auto again = lsystem::grow_population(lsystem::parse(text, "hillman"), 60, 7);
  const struct {
    const char* metric;
    double within;  // of the mean
  } rows[] = {{"number_of_neurites", 0.1}, {"number_of_leaves", 0.3}, {"section_lengths", 0.3},
              {"trunk_origin_radii", 0.1}, {"daughter_ratio", 0.25},  {"remote_bifurcation_angles", 0.25}};
  for (const auto& row : rows) {
    const double wanted = mean_of(cells, row.metric), got = mean_of(again, row.metric);
    EXPECT_NEAR(got / wanted, 1., row.within) << row.metric << ": " << got << " for " << wanted;
  }
}

TEST(ParametricModels, AreWrittenForWhateverHasABranch) {
  for (const Specimen& s : zoo())
    for (const auto write : {burke_grammar, hillman_grammar}) {
      const std::vector<Morphology> cells{s.morphology};
      double length = 0.;
      for (std::size_t i = 0; i < s.morphology.sections().size(); ++i)
        length += section_length(s.morphology, SectionId(i));
      if (length == 0.) {
        EXPECT_THROW(write(cells, s.name, {}), Error) << s.name;
        continue;
      }
      const std::string text = write(cells, s.name + "\n# not a statement", {.rounds = 2});
      EXPECT_EQ(text.find("nan"), text.npos) << text;
      EXPECT_EQ(text.find("inf"), text.npos) << text;
      for (const Morphology& m : lsystem::grow_population(lsystem::parse(text, s.name), 5, 3))
        EXPECT_LT(m.sections().size(), 200000u) << s.name;
    }
  EXPECT_THROW(burke_grammar({}, "none"), Error);
  EXPECT_THROW(hillman_grammar({}, "none"), Error);
}

TEST(ParametricModels, HaveTheNameOfAnyFolder) {
  const std::vector<Morphology> cells{zoo_parts::binary_tree(3)};
  for (const char* name : {"mine/*", "/*/*//**", "# /*"})
    EXPECT_NO_THROW(lsystem::parse(burke_grammar(cells, name, {.rounds = 0}), "model")) << name;
}

// Forks a hundred times as likely as ends: without the guard such cells have 2^100 tips.
TEST(Burke, DoesNotRunAway) {
  const std::vector<Morphology> cells{zoo_parts::binary_tree(9)};
  const std::string text = burke_grammar(cells, "bush", {.rounds = 0});
  const std::string define = "#define more_basal ";
  const std::size_t found = text.find(define), at = found + define.size();
  ASSERT_NE(found, text.npos);
  const std::string wild = text.substr(0, at) + "1000" + text.substr(text.find(' ', at));
  for (const Morphology& m : lsystem::grow_population(lsystem::parse(wild, "wild"), 4, 1))
    EXPECT_LT(m.sections().size(), 100000u);
}

}  // namespace
}  // namespace forest::fitting
