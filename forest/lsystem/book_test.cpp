// SPDX-License-Identifier: Apache-2.0
// The standard examples of Prusinkiewicz & Lindenmayer, The Algorithmic Beauty of Plants (1990), with their
// words.
#include <cmath>
#include <map>
#include <numeric>

#include <boost/math/distributions/chi_squared.hpp>
#include <gtest/gtest.h>

#include "forest/lsystem/derive.h"
#include "forest/lsystem/turtle.h"
#include "forest/morphology/measure.h"

namespace forest::lsystem {
namespace {

std::string derived(const std::string& text, int steps, std::uint64_t index = 0) {
  const Grammar g = parse(text, "book");
  return to_string(derive(g, 1, index, steps), g);
}

void expect_words(const std::string& text, const std::vector<std::string>& words) {
  for (std::size_t i = 0; i < words.size(); ++i)
    EXPECT_EQ(derived(text, int(i)), words[i]) << "after " << i << " steps";
}

std::map<std::string, double> letters(const Word& word, const Grammar& g) {
  std::map<std::string, double> counts;
  for (const Module& m : word.modules) ++counts[g.symbols[m.symbol]];
  return counts;
}

// Section 1.9: the number of every letter grows by the matrix of how often a successor has it.
void expect_growth(const std::string& text, int steps) {
  const Grammar g = parse(text, "book");
  std::map<std::string, double> expected;
  for (const Shape& s : g.axiom) ++expected[g.symbols[s.symbol]];
  for (int n = 0; n < steps; ++n) {
    std::map<std::string, double> next;
    for (const auto& [letter, count] : expected) {
      const auto p = std::find_if(g.productions.begin(), g.productions.end(), [&](const Production& one) {
        return g.symbols[one.predecessor.symbol] == letter;
      });
      if (p == g.productions.end()) {
        next[letter] += count;
      } else {
        for (const Shape& s : p->successor) next[g.symbols[s.symbol]] += count;
      }
    }
    expected = next;
  }
  EXPECT_EQ(letters(derive(g, 0, 0, steps), g), expected);
}

// Section 1.2, Lindenmayer's filament and figure 1.4, Anabaena catenula.
TEST(Book, AlgaeGrow) {
  expect_words("axiom: b\np1: a -> ab\np2: b -> a\n", {"b", "a", "ab", "aba", "abaab", "abaababa"});
}

TEST(Book, AnabaenaHasPolarity) {
  expect_words("axiom: a_r\np1: a_r -> a_l b_r\np2: a_l -> b_l a_r\np3: b_r -> a_r\np4: b_l -> a_l\n",
               {"a_r", "a_lb_r", "b_la_ra_r", "a_la_lb_ra_lb_r", "b_la_rb_la_ra_rb_la_ra_r"});
}

TEST(Book, AlgaeHaveFibonacciLengths) {
  const Grammar g = parse("axiom: a\np1: a -> ab\np2: b -> a\n", "book");
  std::size_t before = 1, now = 2;
  for (int n = 1; n < 24; ++n) {
    EXPECT_EQ(derive(g, 0, 0, n).modules.size(), now);
    before = std::exchange(now, before + now);
  }
}

// Section 1.4.2 and figure 1.6: the quadratic Koch island, a closed curve of 4 * 8^n sides.
TEST(Book, KochIslandIsClosed) {
  const std::string island = "axiom: F-F-F-F\np1: F -> F-F+F+FF-F-F+F\nangle: 90\n";
  EXPECT_EQ(derived(island, 1), "F-F+F+FF-F-F+F-F-F+F+FF-F-F+F-F-F+F+FF-F-F+F-F-F+F+FF-F-F+F");
  const Grammar g = parse(island, "book");
  const Morphology m = interpret(derive(g, 0, 0, 3), g);
  ASSERT_EQ(m.sections().size(), 1u);
  EXPECT_EQ(m.segment_count(), 4u * 512u);
  EXPECT_NEAR((m.points().front().position() - m.points().back().position()).norm(), 0.f, 1e-4f);
}

// Figure 1.10: the dragon curve, by edge rewriting; F_l and F_r both draw.
TEST(Book, DragonCurveTurns) {
  const std::string dragon = "axiom: F_l\np1: F_l -> F_l+F_r+\np2: F_r -> -F_l-F_r\nangle: 90\n";
  expect_words(dragon, {"F_l", "F_l+F_r+", "F_l+F_r++-F_l-F_r+"});
  const Grammar g = parse(dragon, "book");
  const Morphology m = interpret(derive(g, 0, 0, 10), g);
  EXPECT_EQ(m.segment_count(), 1024u);
  EXPECT_NEAR((m.points().back().position() - m.points().front().position()).norm(), 32.f,
              1e-3f);  // sqrt(2)^10
}

// Figure 1.24: six plants.
struct Plant {
  const char* text;
  int steps;
};
constexpr Plant plants[] = {
    {"axiom: F\np1: F -> F[+F]F[-F]F\nangle: 25.7\n", 5},
    {"axiom: F\np1: F -> F[+F]F[-F][F]\nangle: 20\n", 5},
    {"axiom: F\np1: F -> FF-[-F+F+F]+[+F-F-F]\nangle: 22.5\n", 4},
    {"axiom: X\np1: X -> F[+X]F[-X]+X\np2: F -> FF\nangle: 20\n", 7},
    {"axiom: X\np1: X -> F[+X][-X]FX\np2: F -> FF\nangle: 25.7\n", 7},
    {"axiom: X\np1: X -> F-[[X]+X]+F[+FX]-X\np2: F -> FF\nangle: 22.5\n", 5},
};

TEST(Book, PlantsHaveTheirStrings) {
  EXPECT_EQ(derived(plants[0].text, 2), "F[+F]F[-F]F[+F[+F]F[-F]F]F[+F]F[-F]F[-F[+F]F[-F]F]F[+F]F[-F]F");
  EXPECT_EQ(derived(plants[4].text, 2), "FF[+F[+X][-X]FX][-F[+X][-X]FX]FFF[+X][-X]FX");
  EXPECT_EQ(derived(plants[5].text, 1), "F-[[X]+X]+F[+FX]-X");
}

TEST(Book, PlantsGrowByTheirMatrix) {
  for (const Plant& plant : plants) expect_growth(plant.text, plant.steps);
}

TEST(Book, PlantsAreDrawnWhole) {
  for (const Plant& plant : plants) {
    const Grammar g = parse(plant.text, "book");
    const Word word = derive(g, 0, 0, plant.steps);
    const Morphology m = interpret(word, g);
    EXPECT_EQ(double(m.segment_count()), letters(word, g)["F"]);
    EXPECT_NEAR(total_length(m), letters(word, g)["F"], 1e-2);
  }
}

// Figure 1.25: a bush in space, with leaves.
TEST(Book, BushGrowsByItsMatrix) {
  expect_growth(
      "axiom: A\n"
      "p1: A -> [&FL!A]/////'[&FL!A]///////'[&FL!A]\n"
      "p2: F -> S/////F\n"
      "p3: S -> FL\n"
      "p4: L -> ['''^^{-f+f+f-|-f+f+f}]\n"
      "angle: 22.5\n",
      7);
}

// Section 1.7 and figure 1.27: a stochastic L-system; its three productions have probabilities 0.33, 0.33,
// 0.34.
TEST(Book, StochasticPlantsChooseWithTheirProbabilities) {
  const std::string text =
      "axiom: F\np1: F -> F[+F]F[-F]F : 0.33\np2: F -> F[+F]F : 0.33\np3: F -> F[-F]F : 0.34\nangle: 30\n";
  const Grammar g = parse(text, "book");
  std::map<std::string, double> seen;
  constexpr int count = 30000;
  Deriver deriver(g);
  for (int i = 0; i < count; ++i) ++seen[to_string(deriver.derive(5, std::uint64_t(i), 1), g)];
  const std::map<std::string, double> expected{{"F[+F]F[-F]F", 0.33}, {"F[+F]F", 0.33}, {"F[-F]F", 0.34}};
  ASSERT_EQ(seen.size(), expected.size());
  double sum = 0.;
  for (const auto& [word, p] : expected) sum += std::pow(seen[word] - p * count, 2) / (p * count);
  EXPECT_GT(boost::math::cdf(boost::math::complement(boost::math::chi_squared(2), sum)), 1e-4);
}

// Section 1.8: a signal along a filament.
TEST(Book, SignalPropagates) {
  expect_words("axiom: baaaaaaaa\np1: b < a -> b\np2: b -> a\n",
               {"baaaaaaaa", "abaaaaaaa", "aabaaaaaa", "aaabaaaaa", "aaaabaaaa"});
}

// Section 1.8: the example of which modules a context sees in a bracketed string.
TEST(Book, ContextsPassOverBranches) {
  EXPECT_EQ(derived("axiom: ABC[DE][SG[HI[JK]L]MNO]\np1: BC < S > G[H]M -> Z\n", 1),
            "ABC[DE][ZG[HI[JK]L]MNO]");
  EXPECT_EQ(derived("axiom: ABC[DE][SG[HI[JK]L]MNO]\np1: BC < S > G[I]M -> Z\n", 1),
            "ABC[DE][SG[HI[JK]L]MNO]");
}

// Figure 1.30: signals towards the tips and towards the root, + and - ignored.
TEST(Book, AcropetalSignalReachesEveryBranch) {
  expect_words("#ignore: +-\naxiom: F_b[+F_a]F_a[-F_a]F_a[+F_a]F_a\np1: F_b < F_a -> F_b\n",
               {"F_b[+F_a]F_a[-F_a]F_a[+F_a]F_a", "F_b[+F_b]F_b[-F_a]F_a[+F_a]F_a",
                "F_b[+F_b]F_b[-F_b]F_b[+F_a]F_a", "F_b[+F_b]F_b[-F_b]F_b[+F_b]F_b"});
}

TEST(Book, BasipetalSignalFollowsTheStem) {
  expect_words("#ignore: +-\naxiom: F_a[+F_a]F_a[-F_a]F_a[+F_a]F_b\np1: F_a > F_b -> F_b\n",
               {"F_a[+F_a]F_a[-F_a]F_a[+F_a]F_b", "F_a[+F_a]F_a[-F_a]F_b[+F_a]F_b",
                "F_a[+F_a]F_b[-F_a]F_b[+F_a]F_b", "F_b[+F_a]F_b[-F_a]F_b[+F_a]F_b"});
}

// Figure 1.31 a: Hogeweg & Hesper (1974); digits are modules, and + and - are rewritten too.
TEST(Book, HogewegAndHesperPlantBranchesWithBalancedBrackets) {
  const std::string text =
      "#ignore: + - F\naxiom: F1F1F1\n"
      "p1: 0 < 0 > 0 -> 0\np2: 0 < 0 > 1 -> 1[+F1F1]\np3: 0 < 1 > 0 -> 1\np4: 0 < 1 > 1 -> 1\n"
      "p5: 1 < 0 > 0 -> 0\np6: 1 < 0 > 1 -> 1F1\np7: 1 < 1 > 0 -> 0\np8: 1 < 1 > 1 -> 0\n"
      "p9: * < + > * -> -\np10: * < - > * -> +\nangle: 22.5\n";
  expect_words(text, {"F1F1F1", "F1F0F1", "F1F1F1F1"});
  const Grammar g = parse(text, "book");
  const Morphology m = interpret(derive(g, 0, 0, 30), g);
  EXPECT_GT(m.sections().size(), 50u);
}

// Section 1.10.1: the parametric L-system of page 42 and its first words.
TEST(Book, ParametersAreRewritten) {
  const std::string text =
      "axiom: B(2)A(4,4)\n"
      "p1: A(x,y) : y <= 3 -> A(x*2,x+y)\n"
      "p2: A(x,y) : y > 3 -> B(x)A(x/y,0)\n"
      "p3: B(x) : x < 1 -> C\n"
      "p4: B(x) : x >= 1 -> B(x-1)\n";
  expect_words(text, {"B(2)A(4,4)", "B(1)B(4)A(1,0)", "B(0)B(3)A(2,1)", "CB(2)A(4,3)", "CB(1)A(8,7)"});
}

// Section 1.10.2: a parametric context, with the values of all three modules.
TEST(Book, ParametricContextsSeeTheirNeighboursValues) {
  const std::string text =
      "axiom: A(2)B(6)C(12)\np1: A(x) < B(y) > C(z) : x + y + z > 10 -> E((x+y)/2) F((y+z)/2)\n";
  EXPECT_EQ(derived(text, 1), "A(2)E(4)F(9)C(12)");
  EXPECT_EQ(derived("axiom: A(2)B(3)C(4)\np1: A(x) < B(y) > C(z) : x + y + z > 10 -> E(x)\n", 1),
            "A(2)B(3)C(4)");
}

// Figure 1.36: a row of trees; one edge becomes four.
TEST(Book, RowOfTreesHasItsLengths) {
  const Grammar g = parse(
      "#define c 1\n#define p 0.3\n#define q c-p\n#define h (p*q)^0.5\nangle: 86\n"
      "axiom: F(1)\np1: F(x) -> F(x*p)+F(x*h)--F(x*h)+F(x*q)\n",
      "book");
  const Word word = derive(g, 0, 0, 8);
  EXPECT_EQ(word.parameters.size(), std::size_t(std::pow(4, 8)));
  const double sum = std::accumulate(word.parameters.begin(), word.parameters.end(), 0.);
  EXPECT_NEAR(sum, std::pow(1. + 2. * std::sqrt(0.21), 8), 1e-6);
}

// Figure 1.37: the pattern of branches whose every order is R times shorter.
TEST(Book, BranchesShortenByTheirRatio) {
  const Grammar g =
      parse("#define R 1.456\nangle: 85\naxiom: A(1)\np1: A(s) -> F(s)[+A(s/R)][-A(s/R)]\n", "book");
  const Morphology m = interpret(derive(g, 0, 0, 10), g);
  EXPECT_EQ(m.sections().size(), 1023u);
  double expected = 0.;
  for (int i = 0; i < 10; ++i) expected += std::pow(2. / 1.456, i);
  EXPECT_NEAR(total_length(m), expected, 1e-3);
}

// Figure 2.6 a: Honda's monopodial tree.
TEST(Book, HondaTreeHasItsTrunkAndAngles) {
  const Grammar g = parse(
      "#define r1 0.9\n#define r2 0.6\n#define a0 45\n#define a2 45\n#define d 137.5\n#define wr 0.707\n"
      "axiom: A(1,10)\n"
      "p1: A(l,w) -> !(w)F(l)[&(a0)B(l*r2,w*wr)]/(d)A(l*r1,w*wr)\n"
      "p2: B(l,w) -> !(w)F(l)[-(a2)$C(l*r2,w*wr)]C(l*r1,w*wr)\n"
      "p3: C(l,w) -> !(w)F(l)[+(a2)$B(l*r2,w*wr)]B(l*r1,w*wr)\n",
      "book");
  const Morphology m = interpret(derive(g, 0, 0, 10), g);
  EXPECT_EQ(m.segment_count(), 1023u);  // 2^10 - 1 internodes
  float height = 0.f;
  for (const Point& p : m.points()) height = std::max(height, p.y);
  EXPECT_NEAR(height, (1 - std::pow(0.9, 10)) / 0.1, 1e-4);  // the trunk is straight up and the highest
  EXPECT_EQ(m.points(SectionId(0))[0].radius, 5.f);
  const auto daughters = m.children(SectionId(0));
  ASSERT_EQ(daughters.size(), 2u);
  const auto branch = m.points(daughters[0]);
  const Vec3 direction = (branch[1].position() - branch[0].position()).normalized();
  EXPECT_NEAR(degrees(std::acos(direction.y())), 45.f, 1e-3f);
  EXPECT_NEAR((branch[1].position() - branch[0].position()).norm(), 0.6f, 1e-6f);
}

// Figure 2.8: a tree whose elongation rate lr and tropism make its shape; here its size after n steps.
TEST(Book, TernaryTreeElongates) {
  const Grammar g = parse(
      "#define d1 94.74\n#define d2 132.63\n#define a 18.95\n#define lr 1.109\n#define vr 1.732\n"
      "axiom: !(1)F(200)/(45)A\n"
      "p1: A -> !(vr)F(50)[&(a)F(50)A]/(d1)[&(a)F(50)A]/(d2)[&(a)F(50)A]\n"
      "p2: F(l) -> F(l*lr)\n"
      "p3: !(w) -> !(w*vr)\n",
      "book");
  const Word word = derive(g, 0, 0, 6);
  double tips = 0., first = 0.;
  for (const Module& m : word.modules) {
    tips += g.symbols[m.symbol] == "A";
    if (first == 0. && g.symbols[m.symbol] == "F") first = word.of(m)[0];
  }
  EXPECT_EQ(tips, 729.);
  EXPECT_NEAR(first, 200. * std::pow(1.109, 6), 1e-9);
}

}  // namespace
}  // namespace forest::lsystem
