// SPDX-License-Identifier: Apache-2.0
// Growth in time: the BES model of van Pelt & Uylings, data/grammars/bes.lsys, against what its theory says.
#include <cmath>
#include <map>

#include <gtest/gtest.h>

#include "forest/core/file.h"
#include "forest/lsystem/derive.h"
#include "forest/lsystem/turtle.h"
#include "forest/morphology/measure.h"
#include "forest/statistics/summary.h"

#include "tests/effort.h"

namespace forest::lsystem {
namespace {

std::string bes() {
  const MappedFile file(std::string(FOREST_SOURCE_DIR) + "/data/grammars/bes.lsys");
  return std::string(file.text());
}

struct Published {
  double B, E, S;
};

Grammar with(const Published& p) {
  std::string text = bes();
  for (const auto& [was, is] :
       {std::pair{std::string("#define B 2.52"), "#define B " + std::to_string(p.B)},
        std::pair{std::string("#define E 0.73"), "#define E " + std::to_string(p.E)},
        std::pair{std::string("#define S 0.5"), "#define S " + std::to_string(p.S)}}) {
    EXPECT_NE(text.find(was), text.npos);
    text.replace(text.find(was), was.size(), is);
  }
  return parse(text, "bes");
}

struct Moments {
  double mean, sd;
};

/// Whichever of its growth cones forks, a dendrite of n forks at the rate B/T n^(1-E): a pure birth process (van Elburg 2011,
/// "Stochastic continuous time neurite branching models with tree and segment dependent rates"), whose
/// equations are solved here in small steps.
Moments theory(const Published& p, double hours) {
  constexpr double T = 264., dt = 0.02;
  std::vector<double> chance(200, 0.);
  chance[1] = 1.;
  for (double t = 0.; t < std::min(hours, T); t += dt)
    for (std::size_t n = chance.size() - 1; n > 0; --n) {
      const double leave = p.B / T * std::pow(double(n), 1. - p.E),
                   come = n > 1 ? p.B / T * std::pow(double(n - 1), 1. - p.E) : 0.;
      chance[n] += dt * ((n > 1 ? come * chance[n - 1] : 0.) - leave * chance[n]);
    }
  Moments m{0., 0.};
  for (std::size_t n = 1; n < chance.size(); ++n) m.mean += double(n) * chance[n];
  for (std::size_t n = 1; n < chance.size(); ++n)
    m.sd += (double(n) - m.mean) * (double(n) - m.mean) * chance[n];
  return {m.mean, std::sqrt(m.sd)};
}

/// Growth cones of every dendrite of many cells.
std::vector<double> cones(const Grammar& g, int steps, std::uint64_t cells) {
  Deriver deriver(g);
  std::vector<double> counts;
  for (std::uint64_t index = 0; index < cells; ++index) {
    std::map<int, double> of_tree;
    const Word& word = deriver.derive(5, index, steps);
    for (const Module& m : word.modules)
      if (g.symbols[m.symbol] == "F_t") ++of_tree[int(word.of(m)[2])];
    for (const auto& [tree, count] : of_tree) counts.push_back(count);
  }
  return counts;
}

TEST(Growth, TerminalNumbersHaveTheMeanAndSpreadThatTheModelPredictsAtEveryAge) {
  LONG_TEST();
  for (const Published& p :
       {Published{2.52, 0.73, 0.5}, Published{3.85, 0.74, 0.87}, Published{1.26, 0.106, 0.}}) {
    const Grammar g = with(p);
    for (const int hour : {40, 132, 264}) {
      // Dendrites come one a step, eight at most; after hour 264 nothing forks any more.
      const auto seen = cones(g, hour < 264 ? hour + 4 : 280, 160);
      const Moments wanted = theory(p, hour);
      const statistics::Summary got = statistics::summarize(seen);
      ASSERT_GT(got.count, 600u);
      const double error = wanted.sd / std::sqrt(double(got.count));
      EXPECT_NEAR(got.mean, wanted.mean, 4. * error + 0.01 * wanted.mean) << p.B << " at " << hour;
      EXPECT_NEAR(got.sd, wanted.sd, 4. * error + 0.02 * wanted.sd) << p.B << " at " << hour;
    }
  }
}

// S > 0 lets growth cones near the soma fork more: trees are more even than where all fork alike.
TEST(Growth, TheOrderOfGrowthConesDecidesWhichOfThemFork) {
  const auto deepest = [](double S) {
    const Grammar g = with({6., 0.5, S});
    Deriver deriver(g);
    double sum = 0.;
    int trees = 0;
    for (std::uint64_t index = 0; index < 60; ++index) {
      std::map<int, double> deep;
      const Word& word = deriver.derive(5, index, 280);
      for (const Module& m : word.modules)
        if (g.symbols[m.symbol] == "F_t")
          deep[int(word.of(m)[2])] = std::max(deep[int(word.of(m)[2])], word.of(m)[3]);
      for (const auto& [tree, order] : deep) sum += order, ++trees;
    }
    return sum / trees;
  };
  const double even = deepest(1.), alike = deepest(0.), uneven = deepest(-1.);
  EXPECT_LT(even, alike - 0.3);
  EXPECT_LT(alike, uneven - 0.3);
}

TEST(Growth, AWordOfFewerStepsIsTheSameNeuronYounger) {
  const Grammar g = parse(bes(), "bes");
  Deriver deriver(g);
  for (std::uint64_t index = 0; index < 5; ++index) {
    double length = 0.;
    std::vector<Point> first;  // the first branch of the youngest, as far as it is drawn for good
    for (int steps = 30; steps <= 432; steps += 67) {
      const Morphology m = interpret(deriver.derive(9, index, steps), g);
      EXPECT_GT(total_length(m), length);
      length = total_length(m);
      const auto points = m.points(m.roots()[0]);
      if (first.empty()) first.assign(points.begin(), points.end() - 1);
      for (std::size_t i = 0; i < std::min(first.size(), points.size()); ++i) EXPECT_EQ(points[i], first[i]);
    }
  }
}

TEST(Growth, BranchesElongateAtThePublishedRates) {
  const Grammar g = parse(bes(), "bes");
  Deriver deriver(g);
  for (const auto& [steps, wanted] :
       {std::pair{132 + 4, 132 * .22}, std::pair{432, 264 * .22 + (432 - 264 - 4) * .51}}) {
    double sum = 0., tips = 0.;
    for (std::uint64_t index = 0; index < 60; ++index) {
      const Morphology m = interpret(deriver.derive(2, index, steps), g);
      const auto paths = path_distances(m);
      for (std::size_t i = 0; i < m.sections().size(); ++i)
        if (m.is_terminal(SectionId(i))) sum += paths[i], ++tips;
    }
    EXPECT_NEAR(sum / tips, wanted, 0.05 * wanted) << steps;
  }
}

}  // namespace
}  // namespace forest::lsystem
