// SPDX-License-Identifier: Apache-2.0
// Of the candidates of a neuron one is drawn by taste (grow.h).
#include <algorithm>
#include <cmath>
#include <set>
#include <string>

#include <gtest/gtest.h>

#include "forest/core/error.h"
#include "forest/core/parallel.h"
#include "forest/lsystem/derive.h"
#include "forest/lsystem/grow.h"
#include "forest/lsystem/turtle.h"
#include "forest/morphology/measure.h"

namespace forest::lsystem {
namespace {

// A dendrite of 5 to 100 µm, and a card that says how many others of 1 µm there are.
const std::string growing = R"(steps: 30
module Tip(n), More(n)
cell others = dealt(5)
axiom: Soma(10) Basal [ f(5) !(1) F(5) Tip(1) ] More(0)
end: Tip(n) -> : 0.1
go: Tip(n) : n < 20 -> F(5) Tip(n + 1)
more: More(n) : n < others -> [ +(30 + 10 * n) f(5) !(1) F(1) ] More(n + 1)
)";

Grammar tasting(const std::string& statements) { return parse(growing + statements, "growing"); }

double mean_length(const Grammar& grammar) {
  double sum = 0.;
  const auto neurons = grow_population(grammar, 400, 5);
  for (const Morphology& m : neurons) sum += total_length(m);
  return sum / double(neurons.size());
}

TEST(Taste, WithoutOneCandidatesChangeNothing) {
  EXPECT_EQ(grow_population(tasting("candidates: 8\n"), 20, 3), grow_population(tasting(""), 20, 3));
}

TEST(Taste, OfNothingDrawsEachCandidateAsOften) {
  const Grammar grammar = tasting("candidates: 4\ntaste basal total_length(x) = 0 * x\n");
  Deriver deriver(grammar);
  double seen[4] = {}, neurons = 0.;
  for (std::uint64_t i = 0; i < 3000; ++i) {
    const Morphology drawn = grow(deriver, grammar, 2, i);
    std::vector<std::size_t> same;
    for (std::uint32_t c = 0; c < 4; ++c)
      if (interpret(deriver.derive(2, i, {}, c), grammar) == drawn) same.push_back(c);
    ASSERT_FALSE(same.empty()) << i;
    for (const std::size_t c : same) seen[c] += 1. / double(same.size());
    ++neurons;
  }
  double chi2 = 0.;
  for (const double n : seen) chi2 += std::pow(n - neurons / 4., 2) / (neurons / 4.);
  EXPECT_LT(chi2, 16.27);  // 3 degrees of freedom, p = .001
  EXPECT_NEAR(mean_length(grammar), mean_length(tasting("")), 5.);
}

TEST(Taste, ForLongerCellsMakesLongerCells) {
  const double plain = mean_length(tasting(""));
  const auto liked = [](int candidates, const char* weight) {
    return mean_length(tasting("candidates: " + std::to_string(candidates) +
                               "\ntaste basal total_length(x) = " + weight + " * x\n"));
  };
  EXPECT_GT(liked(2, "0.1"), plain + 5.);
  EXPECT_GT(liked(8, "0.1"), liked(2, "0.1") + 5.);
  EXPECT_LT(liked(8, "-0.1"), plain - 10.);
}

// A pair of candidates is of two lengths with a chance of one half; then the longer is drawn three times of four.
TEST(Taste, DrawsByTheExponentialOfItsScore) {
  const Grammar grammar = parse(R"(steps: 1
axiom: Soma(10) Basal f(5) !(1) F(10) A
long: A -> F(10) : 0.5
short: A ->
candidates: 2
taste basal total_length(x) = if(x > 15, log(3), 0)
)",
                                "two");
  constexpr int count = 8000;
  int longer = 0;
  for (const Morphology& m : grow_population(grammar, count, 1)) longer += total_length(m) > 15.;
  constexpr double share = .25 + .5 * .75;
  EXPECT_NEAR(double(longer) / count, share, 4. * std::sqrt(share * (1. - share) / count));
}

TEST(Taste, LeavesCardsDealt) {
  const Grammar grammar = tasting("candidates: 8\ntaste basal number_of_neurites(x) = 10 * x\n");
  for (std::uint64_t seed = 0; seed < 20; ++seed) {
    std::set<std::size_t> stems;
    for (std::uint64_t i = 0; i < 5; ++i) stems.insert(grow(grammar, seed, i).roots().size());
    EXPECT_EQ(stems, (std::set<std::size_t>{1, 2, 3, 4, 5}));
  }
}

TEST(Taste, GrowsTheSameAtAnyNumberOfThreadsAndFromItsText) {
  const Grammar grammar = tasting(
      "candidates: 3\ntaste basal total_length(x) = 0.1 * x\ntaste basal section_lengths sd(x) = -x\n");
  const auto many = grow_population(grammar, 30, 3);
  EXPECT_EQ(grow_population(parse(grammar.text, "again"), 30, 3), many);
  const ThreadLimit one(1);
  EXPECT_EQ(grow_population(grammar, 30, 3), many);
  Deriver deriver(grammar);
  for (const std::uint64_t i : {17u, 4u, 29u}) {
    EXPECT_EQ(grow(deriver, grammar, 3, i), many[i]);
    EXPECT_EQ(grow_to(deriver, grammar, 3, i, grammar.steps), many[i])
        << "its youth is that of the one drawn";
  }
}

// A neuron without any such section is liked neither well nor badly.
TEST(Taste, PassesOverWhatIsNotDefined) {
  const Grammar grammar = tasting("candidates: 2\ntaste apical contraction mean(x) = 1 / 0 * x\n");
  EXPECT_NO_THROW(grow(grammar, 1, 0));
}

TEST(Taste, RefusesWhatItCannotAsk) {
  const auto refused = [](const std::string& statements) -> std::string {
    try {
      grow(tasting(statements), 1, 0);
    } catch (const Error& error) {
      return error.what();
    }
    return "nothing";
  };
  for (const auto& [statements, sentence] : std::initializer_list<std::pair<std::string, std::string>>{
           {"taste basal total_length(x) = x\n", "candidates: 4"},
           {"candidates: 0\n", "growing:8: column 13: the number of candidates"},
           {"candidates: 2\ntaste basal total_lngth(x) = x\n",
            "growing:9: column 7: there is no feature 'basal total_lngth'"},
           {"candidates: 2\ntaste dragon total_length(x) = x\n", "growing:9: column 7: there is no kind"},
           {"candidates: 2\ntaste basal total_length = x\n", "growing:9: column 26"},
           {"candidates: 2\ntaste basal total_length(x)\n", "growing:9: column 28: a '=' is missing"},
           {"candidates: 2\ntaste basal total_length(x) = uniform(0, x)\n", "neither draws"},
           {"candidates: 2\ntaste basal total_length(x) = y\n", "'y' is not known here"},
           {"candidates: 2\ntaste basal total_length(x) = log(0 * x)\n",
            "growing:9: how well basal total_length"}})
    EXPECT_NE(refused(statements).find(sentence), std::string::npos)
        << statements << " gives: " << refused(statements);
}

}  // namespace
}  // namespace forest::lsystem
