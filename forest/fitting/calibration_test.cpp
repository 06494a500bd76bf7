// SPDX-License-Identifier: Apache-2.0
#include "forest/fitting/calibration.h"

#include <algorithm>
#include <cmath>
#include <sstream>

#include <gtest/gtest.h>

#include "forest/core/error.h"
#include "forest/core/parallel.h"
#include "forest/lsystem/grow.h"
#include "forest/statistics/few_features.h"
#include "forest/statistics/summary.h"

namespace forest::fitting {
namespace {

// Neurons that wind each in its own measure, which a model that draws forks from all of them evens out.
std::vector<Morphology> traced(std::size_t count) {
  const lsystem::Grammar grammar = lsystem::parse(R"(
steps: 60
module Tip(d, left, n), Stems(n)
cell long = uniform(5, 14)
cell wild = uniform(2, 40)
axiom: Soma(14) Basal Stems(0)
stem: Stems(n) : n < 4 -> [ -(90 * n + uniform(-20, 20)) f(7) !(2) F(long, 1.6) Tip(1.6, floor(uniform(1, 5)), 0) ] Stems(n + 1)
fork: Tip(d, left, n) : n > 2 & left > 0
  -> /(uniform(-30, 30)) [ +(30) Tip(0.8 * d, left - 1, 0) ] -(30) Tip(0.7 * d, left - 1, 0) : 0.4
grow: Tip(d, left, n) : n < 8 -> &(uniform(-5, 5)) +(uniform(-wild, wild)) F(long, d) Tip(d, left, n + 1)
)",
                                                  "traced");
  return lsystem::grow_population(grammar, count, 11);
}

// How far the mean features of neurons lie from those of others, in standard deviations of these: the mean square.
double gap(std::span<const Morphology> neurons, std::span<const Morphology> others) {
  statistics::FewFeatures few;
  for (const std::string& name : tasted_features(others, statistics::dendrites)) few.add(name);
  std::vector<std::vector<double>> columns[2];
  for (auto& c : columns) c.resize(few.size());
  for (const auto& [side, some] : {std::pair{0, neurons}, {1, others}})
    for (const Morphology& m : some) {
      const std::vector<double> features = few.measure(m);
      for (std::size_t i = 0; i < few.size(); ++i) columns[side][i].push_back(features[i]);
    }
  double sum = 0., count = 0.;
  for (std::size_t i = 0; i < few.size(); ++i) {
    const statistics::Moments of = statistics::moments(columns[1][i]);
    if (of.count > 1 && of.sd > 1e-4)
      sum += std::pow((statistics::mean(columns[0][i]) - of.mean) / of.sd, 2), ++count;
  }
  return sum / count;
}

constexpr Calibration quick{.rounds = 12, .repeats = 2};

TEST(Calibration, BringsGrownNeuronsNearerToOthersOfTheirKind) {
  const std::vector<Morphology> all = traced(120);
  const std::span known = std::span(all).first(30), others = std::span(all).last(90);
  const Calibrated fitted = calibrated_grammar(known, {}, "like them", {}, quick);
  EXPECT_GT(fitted.rounds, 0u);
  EXPECT_LT(fitted.gap_after, fitted.gap_before);
  const auto grown = [](const std::string& text) {
    return lsystem::grow_population(lsystem::parse(text, "fitted"), 120, 7);
  };
  EXPECT_LT(gap(grown(fitted.text), known), .8 * gap(grown(resampling_grammar(known, "like them")), known));
  EXPECT_LT(gap(grown(fitted.text), others), gap(grown(resampling_grammar(known, "like them")), others));
}

TEST(Calibration, IsInTheText) {
  const std::vector<Morphology> known = traced(20);
  const Calibrated fitted = calibrated_grammar(known, {}, "like them", {}, quick);
  ASSERT_GT(fitted.rounds, 0u);
  const lsystem::Grammar grammar = lsystem::parse(fitted.text, "fitted");
  EXPECT_EQ(grammar.candidates, quick.candidates);
  const std::vector<std::string> names = tasted_features(known, statistics::dendrites);
  EXPECT_GT(grammar.tastes.size(), 20u);
  for (const lsystem::Taste& taste : grammar.tastes) {
    EXPECT_EQ(std::ranges::count(names, taste.feature), 1);
    EXPECT_NE(taste.feature, "basal segment_lengths sd") << "all of a neuron are as long";
  }
  EXPECT_TRUE(fitted.text.starts_with(resampling_grammar(known, "like them")));
}

TEST(Calibration, IsTheSameAtAnyNumberOfThreads) {
  const std::vector<Morphology> known = traced(15);
  const std::string text = calibrated_grammar(known, {}, "like them", {}, quick).text;
  const ThreadLimit one(1);
  EXPECT_EQ(calibrated_grammar(known, {}, "like them", {}, quick).text, text);
}

TEST(Calibration, IsNotTriedOfFewNeuronsOrOneCandidate) {
  const std::vector<Morphology> known = traced(13);
  EXPECT_EQ(calibrated_grammar(known, {}, "like them", {}, {.candidates = 1}).text,
            resampling_grammar(known, "like them"));
  const std::span few = std::span(known).first(11);
  EXPECT_EQ(calibrated_grammar(few, {}, "like them").text, resampling_grammar(few, "like them"));
}

// Neurons of two slices cannot be dealt into thirds of which each has some and the others too: two of three are tried.
TEST(Calibration, KeepsSlicesTogether) {
  const std::vector<Morphology> known = traced(14);
  std::vector<std::uint32_t> slices(14, 0);
  const Calibrated one = calibrated_grammar(known, slices, "like them", {}, quick);
  EXPECT_EQ(one.rounds, 0u) << "of a single slice nothing can be held back";
  EXPECT_EQ(one.gap_before, 0.);
  for (std::size_t i = 0; i < 7; ++i) slices[i] = 1;
  EXPECT_GT(calibrated_grammar(known, slices, "like them", {}, quick).gap_before, 0.);
}

TEST(TastedFeatures, AreOfTheKindsThatNeuronsHave) {
  const std::vector<Morphology> known = traced(4);
  const std::vector<std::string> names = tasted_features(known, statistics::dendrites);
  EXPECT_FALSE(names.empty());
  for (const std::string& name : names) EXPECT_TRUE(name.starts_with("basal ")) << name;
  EXPECT_TRUE(tasted_features(known, {SectionKind::axon}).empty());
}

}  // namespace
}  // namespace forest::fitting
