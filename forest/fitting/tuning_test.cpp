// SPDX-License-Identifier: Apache-2.0
#include "forest/fitting/tuning.h"

#include <cmath>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "forest/core/parallel.h"
#include "forest/fitting/resampling.h"
#include "forest/lsystem/grammar.h"
#include "forest/lsystem/grow.h"

namespace forest::fitting {
namespace {

// Winding branches in a slice, which fork narrowly.
std::vector<Morphology> winding() {
  return lsystem::grow_population(lsystem::parse(R"(
steps: 40
module Tip(n), Stems(n)
cell wild = uniform(8, 20)
axiom: Soma(14) Basal Stems(0)
stem: Stems(n) : n < 4 -> [ -(90 * n + uniform(-20, 20)) f(7) !(1) F(9) Tip(0) ] Stems(n + 1)
fork: Tip(n) : n < 12 & n > 0 -> [ +(25 + normal(0, 8)) &(normal(0, 10)) F(9) Tip(n + 1) ] -(25 + normal(0, 8)) F(9) Tip(n + 1) : 0.2
grow: Tip(n) : n < 12 -> ^(normal(0, wild / 2)) +(normal(0, wild)) F(9) Tip(n + 1)
)",
                                                 "winding"),
                                  24, 5);
}

// By how many standard deviations the knobs' styles of grown neurons are amiss, together.
double amiss(const std::vector<Morphology>& models, const Resampling& options) {
  const lsystem::Grammar grammar = lsystem::parse(resampling_grammar(models, "t", options), "t");
  const Traced traced = learn(models, options.kinds),
               grown = learn(lsystem::grow_population(grammar, 4 * models.size(), 1), options.kinds);
  double sum = 0.;
  for (const auto& [kind, mean] : traced.means)
    for (const Knob& knob : knobs)
      sum += std::pow(
          (grown.means.at(kind)[knob.style] - mean[knob.style]) / traced.deviations.at(kind)[knob.style], 2);
  return std::sqrt(sum);
}

TEST(Tuning, BringsGrownBranchesNearerToTracedOnesInTheMean) {
  const std::vector<Morphology> models = winding();
  EXPECT_LT(amiss(models, {}), .6 * amiss(models, {.tuning = {.rounds = 0}}));
}

TEST(Tuning, IsTheSameAtAnyNumberOfThreads) {
  const std::vector<Morphology> models = winding();
  const Resampling few{.evening = {.rounds = 1}, .tuning = {.rounds = 3}};
  const std::string text = resampling_grammar(models, "t", few);
  EXPECT_NE(text, resampling_grammar(models, "t", {.evening = {.rounds = 1}, .tuning = {.rounds = 0}}));
  const ThreadLimit one(1);
  EXPECT_EQ(resampling_grammar(models, "t", few), text);
}

// Where neurons do not differ, or some kind is not grown at all, there is nothing to go by.
TEST(Tuning, LeavesWhatItCannotHear) {
  const Morphology one = winding().front();
  const std::vector<Morphology> same(3, one);
  const Traced traced = learn(same, statistics::dendrites);
  const lsystem::Grammar grammar = lsystem::parse(resampling_grammar(same, "t"), "t");
  EXPECT_EQ(tuned(grammar, traced, {}), untuned(traced));
}

}  // namespace
}  // namespace forest::fitting
