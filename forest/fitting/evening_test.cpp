// SPDX-License-Identifier: Apache-2.0
#include "forest/fitting/evening.h"

#include <algorithm>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "forest/core/parallel.h"
#include "forest/lsystem/derive.h"
#include "forest/lsystem/grammar.h"
#include "forest/lsystem/grow.h"

namespace forest::fitting {
namespace {

constexpr std::size_t neurons = 24;

// Few fork often and narrowly, most seldom and widely.
std::vector<Morphology> of_two_sorts() {
  return lsystem::grow_population(lsystem::parse(R"(
steps: 40
module Tip(n), Stems(n)
cell bushy = chance(0.3)
cell angle = if(bushy, 25, 45)
axiom: Soma(14) Basal Stems(0)
stem: Stems(n) : n < 4 -> [ -(90 * n + uniform(-20, 20)) f(7) !(1) F(9) Tip(0) ] Stems(n + 1)
fork: Tip(n) : n < 9 & n > 0 -> [ +(angle + normal(0, 8)) &(normal(0, 10)) F(9) Tip(n + 1) ] -(angle) F(9) Tip(n + 1) : if(bushy, 0.35, 0.15)
grow: Tip(n) : n < 9 -> ^(uniform(-9, 9)) +(normal(0, 9)) F(9) Tip(n + 1)
)",
                                                 "two sorts"),
                                  neurons, 3);
}

// How often the forks of a model are drawn by eight times as many neurons as were traced.
std::vector<double> forks_drawn(const std::string& text) {
  const lsystem::Grammar grammar = lsystem::parse(text, "model");
  const auto& samples = grammar.lookups.samples;
  const auto forks = std::ranges::find(samples, "forks", &lsystem::Sample::name);
  const auto trace = lsystem::Symbol(std::ranges::find(grammar.symbols, "Trace") - grammar.symbols.begin());
  std::vector<double> drawn(forks->rows(), 0.);
  lsystem::Deriver deriver(grammar);
  for (std::uint64_t i = 0; i < 8 * neurons; ++i) {
    const lsystem::Word& word = deriver.derive(1234, i);
    for (const lsystem::Module& m : word.modules) {
      const auto values = word.of(m);
      if (m.symbol == trace && samples.data() + std::size_t(values[0]) == &*forks && values[2] == 0.)
        drawn[std::size_t(values[1])] += 1.;
    }
  }
  return drawn;
}

double uneven(const std::vector<double>& drawn) {
  double sum = 0.;
  for (const double n : drawn) sum += (n - 8.) * (n - 8.) / 8.;
  return sum / double(drawn.size());
}

TEST(Evening, EachForkIsDrawnAboutAsOftenAsItWasMet) {
  const std::vector<Morphology> traced = of_two_sorts();
  const double alike = uneven(forks_drawn(resampling_grammar(traced, "t", {.evening = {.rounds = 0}}))),
               evened_out = uneven(forks_drawn(resampling_grammar(traced, "t")));
  EXPECT_LT(evened_out, .7 * alike);
  EXPECT_LT(evened_out, 3.);  // 1 is what chance makes
}

TEST(Evening, IsTheSameAtAnyNumberOfThreads) {
  const std::vector<Morphology> traced = of_two_sorts();
  const Resampling few{.evening = {.rounds = 3}};
  const std::string text = resampling_grammar(traced, "t", few);
  const ThreadLimit one(1);
  EXPECT_EQ(resampling_grammar(traced, "t", few), text);
}

}  // namespace
}  // namespace forest::fitting
