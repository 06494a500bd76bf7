// SPDX-License-Identifier: Apache-2.0
#include "forest/lsystem/grammar.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <set>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include "forest/core/error.h"
#include "forest/lsystem/derive.h"

#include "tests/refused.h"

namespace forest::lsystem {
namespace {

// The value of an expression, by way of a production.
double value_of(const std::string& expression, const std::string& declarations = "") {
  const Grammar g = parse(declarations + "axiom: A(3, 4)\ng: A(x, y) -> B(" + expression + ")\n", "test");
  return derive(g, 0, 0, 1).parameters.at(0);
}

TEST(Expression, BindsAsInMathematics) {
  EXPECT_EQ(value_of("1 + 2 * 3 ^ 2"), 19.);
  EXPECT_EQ(value_of("2 ^ 3 ^ 2"), 512.);
  EXPECT_EQ(value_of("-x ^ 2"), -9.);
  EXPECT_EQ(value_of("2 ^ -1"), .5);
  EXPECT_EQ(value_of("10 - 4 - 3"), 3.);
  EXPECT_EQ(value_of("(10 - 4) / x / 2"), 1.);
  EXPECT_EQ(value_of("7 % 4 + mod(-1, 4)"), 6.);
  EXPECT_EQ(value_of("1 < 2 & 2 < 1 | 1"), 1.);
  EXPECT_EQ(value_of("!(x == 3) || y >= 4 && x != y"), 1.);
  EXPECT_EQ(value_of("1.5e2 + .5"), 150.5);
}

TEST(Expression, HasFunctionsInDegrees) {
  EXPECT_NEAR(value_of("sin(30) + cos(60) + tan(45)"), 2., 1e-12);
  EXPECT_NEAR(value_of("acos(0) + asin(1) + atan2(1, 1)"), 225., 1e-12);
  EXPECT_NEAR(value_of("exp(log(x)) * sqrt(y) + abs(-1)"), 7., 1e-12);
  EXPECT_EQ(value_of("min(x, y) + max(x, y) + floor(1.9) + ceil(1.1) + round(1.5) + sign(-y) + pow(x, 2)"),
            20.);
}

TEST(Expression, EvaluatesOnlyTheChosenPart) {
  EXPECT_EQ(value_of("if(x > y, 1 / 0, x)"), 3.);
  EXPECT_EQ(value_of("if(x < y, if(0, 1, 2), 3) + 10"), 12.);
}

TEST(Expression, CallsFunctionsTablesAndConstants) {
  const std::string declarations =
      "#define half 1 / 2\n"
      "function square(v) = v * v\n"
      "function hypotenuse(a, b) = sqrt(square(a) + square(b)) * 2 * half\n"
      "table steps_of = -1: 5, 2: 10, 8: 20\n";
  EXPECT_EQ(value_of("hypotenuse(x, y)", declarations), 5.);
  EXPECT_EQ(value_of("hypotenuse(hypotenuse(3, y), square(2) * 3)", declarations), 13.);
  EXPECT_EQ(value_of("steps_of(-7)", declarations), 5.);
  EXPECT_EQ(value_of("steps_of(-1)", declarations), 5.);
  EXPECT_EQ(value_of("steps_of(2.5)", declarations), 20.);
  EXPECT_EQ(value_of("steps_of(99)", declarations), 20.);
}

// A parameter that is a name or a number where it is called is not kept; what is worked out or drawn is, once.
TEST(Expression, ArgumentsAreWorkedOutOnce) {
  const std::string declarations =
      "function less(a, b) = a - b\n"
      "function swapped(a, b) = less(b, a) * 100 + less(a, b)\n"
      "function chosen(a, b) = if(a > b, less(a, b), if(b == 4, swapped(b, a), less(7, b)))\n"
      "distribution drawn(a, b) = swapped(uniform(a, b), a) + 0 * b\n"
      "cell size = swapped(2, 5)\n";
  EXPECT_EQ(value_of("swapped(x, y)", declarations), 99.);
  EXPECT_EQ(value_of("swapped(y, 2 * x) - swapped(b=x, a=10)", declarations), 198. - -693.);
  EXPECT_EQ(value_of("swapped(swapped(x, y), less(x, 1))", declarations), -97. * 99.);
  EXPECT_EQ(value_of("chosen(x, y) + chosen(y, x) + chosen(1, 2)", declarations), -99. + 1. + 5.);
  EXPECT_EQ(value_of("size", declarations), 297.);
  const double once = value_of("drawn(1, 2)", declarations);  // 99 (1 − u), where u is from 1 to 2
  EXPECT_LT(once, 0.);
  EXPECT_GT(once, -99.);
}

// What is called by names, beside the same in order; behind it declarations, before it the word that it grows.
TEST(Expression, ArgumentsHaveNames) {
  const std::string declarations =
      "function less(a, b) = a - b\n"
      "sample twigs(kind =, reach ~ 1 -> part) = 3 10 -> 0.25 | 0 1 0 1: 0 6 0 2, 0 9 1 2; 4 20 -> 0.5 | 0 1 "
      "0 1: 0 2 0 "
      "1\n"
      "module Tip(length, order)\n"
      "total tips(order) = Tip(length, order) : length\n";
  const auto grown = [&](const std::string& word) {
    const Grammar g = parse(declarations + "axiom: A(1)\ng: A(x) -> " + word + "\n", "test");
    return to_string(derive(g, 0, 0, 1), g);
  };
  const auto message = [&](const std::string& word) -> std::string {
    try {
      return grown(word);
    } catch (const InputError& error) {
      return error.what();
    }
  };
  const std::pair<std::string, std::string> alike[] = {
      {"A(less(b = 2, a = x * 7))", "A(less(7, 2))"},
      {"A(less(9, b = if(x == 1, 2, 3)))", "A(7)"},  // and == compares
      {"A(twigs.part(twigs(reach = 20, kind = 4)))", "A(0.5)"},
      {"A(tips(order = 2))", "A(tips(2))"},
      {"Tip(order = 3, length = 4)", "Tip(4, 3)"},
      {"F(2, diameter = 1) T(strength = 1)", "F(2, 1) T(1)"},
      {"Trace(twigs, 0, 0)", "Trace(branch = 0, row = 0, sample = twigs)"},
      {"Trace(twigs, 0, 0, bent = 3)", "Trace(twigs, 0, 0, 1, 0, 1, 3)"},
      {"Trace(twigs, 0, 0, x = 2, mirror = 1)", "Trace(twigs, 0, 0, 1, 1, 1, 1, -1, 1, 0, 2)"},
  };
  for (const auto& [named, ordered] : alike) EXPECT_EQ(grown(named), grown(ordered)) << named;
  const std::pair<std::string, std::string> refused[] = {
      {"Trace(twigs, 0, 0, length = 3)",
       "Trace has no parameter 'length'; it has sample, row, branch, scale"},
      {"Trace(twigs, 0, 0, sample = 3)", "column 31: the parameter 'sample' of Trace is given twice"},
      {"Trace(twigs, 0, 0, x = 1, x = 2)", "the parameter 'x' of Trace is given twice"},
      {"Trace(sample = twigs, 0, 0)", "an argument in order stands before those by name"},
      {"Trace(twigs, 0, x = 1)", "the parameter 'branch' of Trace is missing"},
      {"T(strength = 1, z = 1)", "the parameter 'x' of T is missing"},
      {"Tip(order = 1)", "the parameter 'length' of Tip is missing"},
      {"Tip(length = 1)", "module Tip has 2 parameters, 1 given"},
      {"A(less(a = 1))", "less takes 2 arguments, 1 given"},
      {"A(sin(angle = 1))", "sin has no parameters with names; give its arguments in order"},
      {"A(angle = 1)", "A has no parameters with names"},
      {"F(length = )", "a number, a name or a parenthesis is missing here"},
  };
  for (const auto& [word, says] : refused)
    EXPECT_NE(message(word).find(says), std::string::npos) << message(word);
}

TEST(Expression, DrawsAreRepeatedByTheSameSeedOnly) {
  const Grammar g =
      parse("distribution size = gamma(2, 3)\naxiom: A\ng: A -> B(size(), size(), normal(0, 1))\n", "test");
  const Word word = derive(g, 7, 1, 1);
  EXPECT_EQ(word.parameters, derive(g, 7, 1, 1).parameters);
  EXPECT_NE(word.parameters, derive(g, 7, 2, 1).parameters);
  EXPECT_NE(word.parameters, derive(g, 8, 1, 1).parameters);
  EXPECT_NE(word.parameters[0], word.parameters[1]);
}

struct Drawing {
  const char* expression;
  double mean, variance;
};
TEST(Expression, DistributionsHaveTheirMomentsAndLimits) {
  const double below = std::exp(1. + .08), lognormal_variance = (std::exp(.16) - 1) * below * below;
  const Drawing drawings[] = {
      {"uniform(2, 8)", 5, 3},
      {"normal(4, 2)", 4, 4},
      {"truncnormal(0, 1, -1, 1)", 0, .2911},
      {"truncnormal(0, 1, 1, 2)", 1.3832, .0724},
      {"lognormal(1, 0.4)", below, lognormal_variance},
      {"gamma(3, 2)", 6, 12},
      {"exponential(5)", 5, 25},
      {"weibull(2, 10)", 8.8623, 21.4602},
      {"vonmises(0, 4)", 0, 979.026},
      {"poisson(4.5)", 4.5, 4.5},
      {"poisson(70)", 70, 70},
      {"poisson(1001)", 1001, 1001},
      {"poisson(1000000)", 1e6, 1e6},
      {"chance(0.3)", .3, .21},
  };
  for (const Drawing& d : drawings) {
    const Grammar g = parse(std::string("axiom: A\ng: A -> B(") + d.expression + ")\n", "test");
    Deriver deriver(g);
    double sum = 0., squares = 0.;
    constexpr int count = 40000;
    for (int i = 0; i < count; ++i) {
      const double x = deriver.derive(1, std::uint64_t(i), 1).parameters[0];
      sum += x, squares += x * x;
    }
    const double mean = sum / count;
    EXPECT_NEAR(mean, d.mean, 5 * std::sqrt(d.variance / count)) << d.expression;
    EXPECT_NEAR((squares / count - mean * mean) / d.variance, 1., .08) << d.expression;
  }
}

// How often each count comes, on both sides of where another method takes over.
TEST(Expression, PoissonCountsComeAsOftenAsTheyShould) {
  for (const double mean : {999.5, 1000.5, 30'000.}) {
    const Grammar g = parse(fmt::format("axiom: A\ng: A -> B(poisson({}))\n", mean), "test");
    Deriver deriver(g);
    constexpr int draws = 40'000, bins = 24;
    // Bins a quarter of a standard deviation wide; the first and last hold what lies beyond.
    const double width = std::round(std::sqrt(mean) / 4.), low = std::floor(mean) - width * bins / 2;
    const auto bin = [&](double count) {
      return std::size_t(std::clamp((count - low) / width, 0., bins - 1.));
    };
    std::vector<double> seen(bins), expected(bins);
    for (int i = 0; i < draws; ++i) ++seen[bin(deriver.derive(3, std::uint64_t(i), 1).parameters[0])];
    for (double count = std::floor(mean / 2.); count < 2. * mean; ++count)
      expected[bin(count)] += draws * std::exp(count * std::log(mean) - mean - std::lgamma(count + 1.));
    double chi2 = 0.;
    for (std::size_t i = 0; i < bins; ++i) chi2 += std::pow(seen[i] - expected[i], 2) / expected[i];
    EXPECT_LT(chi2, 49.73) << mean;  // 23 degrees of freedom, p = .001
  }
}

// Every block of n neurons has each card once, and every neuron each card as often over many seeds.
TEST(Expression, CardsAreDealt) {
  constexpr int cards = 7;
  const Grammar g = parse("axiom: A\ng: A -> B(dealt(7), dealt(1), dealt(7))\n", "test");
  Deriver deriver(g);
  std::map<std::pair<int, int>, int> seen;  // place in the block, card
  constexpr int seeds = 3000;
  for (int seed = 0; seed < seeds; ++seed) {
    std::set<double> block;
    for (int place = 0; place < cards; ++place) {
      const Word& word = deriver.derive(std::uint64_t(seed), std::uint64_t(cards * (seed % 3) + place), 1);
      EXPECT_EQ(word.parameters[0], word.parameters[2]);
      EXPECT_EQ(word.parameters[1], 0.);
      block.insert(word.parameters[0]);
      ++seen[{place, int(word.parameters[0])}];
    }
    EXPECT_EQ(block.size(), std::size_t(cards));
  }
  double chi2 = 0.;
  constexpr double expected = double(seeds) / cards;
  for (int place = 0; place < cards; ++place)
    for (int card = 0; card < cards; ++card) chi2 += std::pow(seen[{place, card}] - expected, 2) / expected;
  EXPECT_LT(chi2, 67.985);  // 36 degrees of freedom, p = .001
  for (const char* none : {"dealt(0)", "dealt(2.5)", "dealt(2000000)"})
    EXPECT_THROW(value_of(none), Error) << none;
}

// The first neurons of a block, however many, take cards evenly from all around the ring. Were they drawn at random, how many of n / 2
// lie in half of the ring would have a variance of about n / 16.
TEST(Expression, CardsAreDealtEvenlyAroundTheRing) {
  for (const int cards : {16, 37, 100, 1000}) {
    const Grammar g = parse(fmt::format("axiom: A\ng: A -> B(dealt({}))\n", cards), "test");
    Deriver deriver(g);
    double squares = 0.;
    int arcs = 0;
    for (std::uint64_t block = 0; block < 4; ++block)
      for (const int neurons : {cards / 3, cards / 2}) {
        std::vector<int> taken(std::size_t(cards), 0);
        for (int place = 0; place < neurons; ++place)
          ++taken[std::size_t(
              deriver.derive(5, block * std::uint64_t(cards) + std::uint64_t(place), 1).parameters[0])];
        for (int first = 0; first < cards; ++first, ++arcs) {
          int here = 0;
          for (int i = 0; i < cards / 2; ++i) here += taken[std::size_t((first + i) % cards)];
          squares += std::pow(here - neurons * double(cards / 2) / cards, 2);
        }
      }
    EXPECT_LT(squares / arcs, .6 + .1 * std::log2(cards)) << cards;
  }
}

TEST(Grammar, BindingsUseADrawTwice) {
  const Grammar g =
      parse("axiom: A(10)\ng: A(d) { r = uniform(0, 1), s = r * d } -> B(r, s) [C(d - s)]\n", "test");
  const Word word = derive(g, 3, 0, 1);
  EXPECT_EQ(word.parameters[1], word.parameters[0] * 10);
  EXPECT_EQ(word.parameters[2], 10 - word.parameters[1]);
}

TEST(Grammar, CellValuesAreDrawnOnceANeuron) {
  const Grammar g = parse(
      "cell size = normal(100, 10)\ncell twice = 2 * size\naxiom: A\ng: A -> B(size, twice) A\n", "test");
  const Word word = derive(g, 3, 0, 3);
  EXPECT_EQ(word.parameters[0], word.parameters[4]);
  EXPECT_EQ(word.parameters[1], 2 * word.parameters[0]);
  EXPECT_NE(word.parameters[0], derive(g, 3, 1, 3).parameters[0]);
}

TEST(Grammar, TakesTheLongestNameAndJoinsIndentedLines) {
  const Grammar g = parse(
      "# a comment\ntitle: a test\n/* another\n   one */\nmodule Tip(d), TipOfTips(d)\n\n"
      "axiom: TipOfTips(1)Tip(2)Z\n  Tip(3)  # here\ngo: Tip(d) ->\n\n  a_r aB\n",
      "folder/x.lsys");
  EXPECT_EQ(g.title, "a test");
  EXPECT_EQ(g.name, "x");
  EXPECT_EQ(to_string(derive(g, 0, 0, 1), g), "TipOfTips(1)a_raBZa_raB");
}

// Modules whose names begin alike, and a word of them without blanks, beside the rule as it is said.
RC_GTEST_PROP(Grammar, TheLongestNameThatFitsIsTaken, ()) {
  const auto letters = rc::gen::elementOf(std::string("abc"));
  std::set<std::string> names{"a", "b", "c"};
  for (const auto& name :
       *rc::gen::container<std::vector<std::string>>(rc::gen::container<std::string>(letters)))
    if (name.size() > 1) names.insert(name);
  const std::string word = "a" + *rc::gen::container<std::string>(letters);
  std::string text;
  for (const std::string& name : names)
    if (name.size() > 1) text += "module " + name + "\n";
  const Grammar g = parse(text + "axiom: " + word + "\np: z -> z\n", "names");
  std::size_t at = 0;
  for (const Shape& s : g.axiom) {
    std::string longest;
    for (const std::string& name : names)
      if (name.size() > longest.size() && word.compare(at, name.size(), name) == 0) longest = name;
    RC_ASSERT(g.symbols[s.symbol] == longest);
    at += longest.size();
  }
  RC_ASSERT(at == word.size());
}

// Each of them took a time that grew with its square: minutes.
TEST(Grammar, LongTextsAreRead) {
  EXPECT_EQ(parse("axiom: " + std::string(1'000'000, 'F') + "\nf: F -> F\n", "letters").axiom.size(),
            1'000'000u);
  std::string modules = "module Tip0", word = "axiom:", productions;
  for (int i = 1; i < 4000; ++i) modules += fmt::format(", Tip{}", i);
  for (int i = 0; i < 100'000; ++i) word += fmt::format(" Tip{}", i % 4000);
  for (int i = 0; i < 50'000; ++i) productions += fmt::format("p{}: Tip{} -> FFFF\n", i, i % 4000);
  const Grammar g = parse(modules + '\n' + word + '\n' + productions, "modules");
  EXPECT_EQ(g.axiom.size(), 100'000u);
  EXPECT_EQ(g.productions.back().line, 50'002u);
}

struct Bad {
  const char* text;
  std::size_t line;
  const char* says;
};
TEST(Grammar, ErrorsNameLineColumnAndRemedy) {
  const Bad table[] = {
      {"", 1, "no axiom"},
      {"axiom: A\n", 2, "no production"},
      {"axiom: A(1\np: A(x) -> B\n", 1, "column 11: a ')' is missing"},
      {"axiom: A\np: A -> B(x)\n", 2, "column 11: 'x' is not known"},
      {"axiom: A\np: A -> [B\n", 2, "not closed"},
      {"axiom: A\np: A -> B]\n", 2, "closes nothing"},
      {"axiom: A\np: A(x) -> B(sin(x, 2))\n", 2, "column 14: sin takes 1 argument, 2 given"},
      {"axiom: A\np: A(x) -> B(foo(x))\n", 2, "column 14: there is no function 'foo'"},
      {"axiom: A\np: AB -> C\n", 2, "one module"},
      {"axiom: A\np: A -> C\np: A -> D\n", 3, "production p already"},
      {"axiom: A\np: A(x) : x = 3 -> C\n", 2, "column 13: write =="},
      {"axiom: A\np: A(x, x) -> C\n", 2, "has a meaning already"},
      {"axiom: A\np: A B\n", 2, "one module"},
      {"axiom: A\np: A : 1\n", 2, "'->' is missing"},
      {"module Tip(d)\naxiom: Tip(1, 2)\np: Tip(d) -> C\n", 2,
       "column 8: module Tip has 1 parameter, 2 given"},
      {"axiom: A\np: A -> F(1, 2, 3)\n", 2, "module F has 0 to 2 parameters, 3 given"},
      {"#define x uniform(0, 1)\naxiom: A\np: A -> B\n", 1, "must be a constant"},
      {"function f(x) = uniform(0, x)\naxiom: A\np: A -> B\n", 1, "may not draw"},
      {"distribution f(x) = x\naxiom: A\np: A -> B\n", 1, "does not draw"},
      {"table t = 1: 2, 1: 3\naxiom: A\np: A -> B\n", 1, "must increase"},
      {"steps: 0.5\naxiom: A\np: A -> B\n", 1, "whole number"},
      {"axiom: A\nfoo A -> B\n", 2, "column 1: a statement cannot begin with 'foo'"},
      {"axiom: A\naxiom: B\np: A -> B\n", 2, "an axiom already"},
      {"axiom: A\np: A -> B : 0.5 0.5\n", 2, "should end here"},
      {"axiom: A /* open\np: A -> B\n", 1, "column 10: the comment is not closed"},
      {"axiom: A\n\n  \np: A ->\n  B\n  C(1 +)\n", 6, "column 8: a number, a name"},
      {"axiom: A\np: [ -> B\n", 2, "bracket"},
      {"axiom: A(1)\np: A(x) { r = x } -> B : r\n", 2, "column 26: 'r' is a binding"},
      {"axiom: A\np: A -> F_x(10, 1, 5, 7)\n", 2, "module F_x has 0 to 2 parameters, 4 given"},
      {"axiom: \xff\np: A -> B\n", 1, "no module"},
  };
  for (const Bad& bad : table) {
    try {
      parse(bad.text, "bad.lsys");
      ADD_FAILURE() << "was read: " << bad.text;
    } catch (const InputError& error) {
      EXPECT_EQ(error.line(), bad.line) << error.what();
      EXPECT_NE(std::string(error.what()).find(bad.says), std::string::npos)
          << error.what() << "\nfor " << bad.text;
      EXPECT_TRUE(std::string(error.what()).starts_with("bad.lsys:")) << error.what();
      EXPECT_NE(std::string(error.what()).find("column "), std::string::npos) << error.what();
    }
  }
}

TEST(Grammar, TextsOfWideLettersAreToldAsSuch) {
  const std::string text = "axiom: A\ng: A -> F(1) A\n";
  std::string wide;
  for (const char c : text) wide += {c, '\0'};
  for (const std::string& one : {wide, "\xff\xfe" + wide, "\xfe\xff" + std::string(1, '\0') + wide})
    EXPECT_EQ(refused<InputError>([&] { parse(one, "wide.lsys"); }),
              "wide.lsys:1: is written in UTF-16; save it as plain text (UTF-8 or ASCII)");
}

// A name that was not declared is a module for each of its letters, as in the book; it is said where nothing is done with them.
TEST(Grammar, DoubtsWhatLooksLikeAModule) {
  const auto doubts = [](const std::string& text) { return parse(text + "steps: 1\n", "g").doubts; };
  EXPECT_EQ(doubts("axiom: Soma(9) basal A\ng: A -> F(1)\n"),
            (std::vector<std::string>{
                "g:1: 'basal' is read as 5 modules of one letter, and nothing is done with b, a, s, l; "
                "declare it, module basal(…), if it is one"}));
  EXPECT_EQ(doubts("axiom: A\ng: A -> F(1)\nh: B ->\nforward: C -> Forward(10)\n").size(), 1u);
  EXPECT_TRUE(doubts("axiom: ABC\na: A -> AB\nb: B -> C\nc: C -> A\n").empty());
  EXPECT_TRUE(doubts("axiom: FFFF\nf: F -> FFF\n").empty());
  EXPECT_TRUE(doubts("axiom: ABC\nb: A < B > C -> BAB\n").empty());  // the others are looked for
  EXPECT_TRUE(doubts("axiom: A ?P(0, 0, 0)\na: A > ?P(x, y, z) -> F(y)\n").empty());
  EXPECT_EQ(doubts("axiom: A ?D(0, 0)\na: A > ?D(depth, layer, above, below) -> F(depth)\n"),
            (std::vector<std::string>{
                "g:2: production a asks ?D with 4 parameters, and no word has it so, so that it "
                "never fits; write as many of them in both"}));
  EXPECT_TRUE(doubts("module Tip(x)\naxiom: Tip(1)F\nt: Tip(x) -> Soma(1)BasalTip(x)\n").empty());
}

TEST(Grammar, DoubtsProductionsThatNoStepUses) {
  const std::string text = "axiom: A F(1)\n\ngrow: A -> F(1) A\n";
  EXPECT_EQ(parse(text, "g").doubts,
            (std::vector<std::string>{
                "g:3: no production is used, since it is not said how many steps to derive; write "
                "it, for example steps: 10"}));
  EXPECT_TRUE(parse(text + "steps: 1\n", "g").doubts.empty());
}

TEST(Grammar, DeepNestingIsRefusedNotSuffered) {
  const std::string deep(100000, '(');
  EXPECT_THROW(parse("axiom: A\np: A -> B(" + deep + "1\n", "deep"), InputError);
  const std::string minus(100000, '-');
  EXPECT_THROW(parse("axiom: A\np: A -> B(" + minus + "1)\n", "deep"), InputError);
}

// Each function calls the one above it twice, so that it is twice as long when it is written out.
TEST(Grammar, FunctionsThatGrowBeyondMeasureAreRefused) {
  std::string text = "function f0(x) = x + 1\n";
  for (int i = 1; i < 60; ++i) text += fmt::format("function f{0}(x) = f{1}(x) + f{1}(x + 1)\n", i, i - 1);
  const std::string why =
      refused<InputError>([&] { parse(text + "axiom: A\np: A -> F(f59(1))\n", "deep.lsys"); });
  EXPECT_NE(why.find("more than 100000 instructions"), why.npos) << why;
  EXPECT_TRUE(why.starts_with("deep.lsys:1")) << why;
}

// Each expression is short enough, but there are many; and one of many arguments and no instructions.
TEST(Grammar, FunctionsThatFillTheMemoryTogetherAreRefused) {
  std::string text = "function f0(x) = x + 1\n", many = "function g0(", arguments, word;
  for (int i = 1; i < 14; ++i) text += fmt::format("function f{0}(x) = f{1}(x) + f{1}(x + 1)\n", i, i - 1);
  for (int i = 0; i < 500; ++i) many += fmt::format("a{}, ", i), arguments += "1, ";
  many += "z) = z\nfunction g1(x) = g0(" + arguments + "x)\n";
  for (int i = 0; i < 4; ++i) {
    many += fmt::format("function g{}(x) = 0", i + 2);
    for (int k = 0; k < 20; ++k) many += fmt::format(" + g{}(x)", i + 1);
    many += '\n';
  }
  for (int i = 0; i < 500; ++i) word += " B(f13(1))";
  for (const std::string& grammar :
       {text + "axiom: A\np: A ->" + word + "\n", many + "axiom: A\np: A -> B(g5(1))\n"}) {
    const std::string why = refused<InputError>([&] { parse(grammar, "many.lsys"); });
    EXPECT_NE(why.find("the grammar has more than 2000000 instructions"), why.npos) << why;
  }
  const Grammar read = parse(text + "axiom: A\np: A -> B(f13(1)) B(f13(1))\n", "two.lsys");
  EXPECT_EQ(derive(read, 0, 0, 1).parameters.size(), 2u);
}

// Cut anywhere, with anything put in: a value or an InputError, never anything else.
RC_GTEST_PROP(Grammar, AnyTextIsReadOrRefused, ()) {
  static const std::string whole =
      parse_file(std::string(FOREST_SOURCE_DIR) + "/data/grammars/pyramidal.lsys").text;
  std::string text = whole.substr(*rc::gen::inRange<std::size_t>(0, whole.size()));
  text.resize(*rc::gen::inRange<std::size_t>(0, text.size() + 1));
  if (!text.empty()) text[*rc::gen::inRange<std::size_t>(0, text.size())] = *rc::gen::arbitrary<char>();
  try {
    parse(text, "cut");
  } catch (const InputError&) {
  }
}

TEST(Declaration, StandsAloneWithAllItNeeds) {
  const Grammar g = parse(
      "#define half 0.5\n"
      "#define other 2\n"
      "table mean = 1: 0.9, 2: 0.7\n\n"
      "# about the ratio, which\n"
      "cell shift = normal(0, half)\n"
      "function at(order) = mean(order) +\n  shift\n"
      "distribution ratio(order) = normal(at(order), 0.1)  # of diameters\n"
      "distribution tilt = uniform(-1, 1)  /* a long\n comment */\n"
      "axiom: A\ngrow: A -> F(ratio(1)) +(tilt())\n",
      "test");
  std::vector<std::string> distributions;
  for (const Declaration& d : g.declarations)
    if (d.draws) distributions.push_back(text_of(d, g));
  ASSERT_EQ(distributions.size(), 2u);
  EXPECT_EQ(distributions[0],
            "#define half 0.5\ntable mean = 1: 0.9, 2: 0.7\ncell shift = normal(0, half)\n"
            "function at(order) = mean(order) +\n  shift\n"
            "distribution ratio(order) = normal(at(order), 0.1)  # of diameters\n");
  EXPECT_EQ(distributions[1], "distribution tilt = uniform(-1, 1)\n");
  EXPECT_EQ(g.declarations.front().name, "half");
  for (const char* name : {"motoneuron", "purkinje", "pyramidal"}) {
    const Grammar real = parse_file(fmt::format("{}/data/grammars/{}.lsys", FOREST_SOURCE_DIR, name));
    std::size_t count = 0;
    for (const Declaration& d : real.declarations) {
      const Grammar alone = parse(text_of(d, real) + "axiom: A\ngrow: A -> F\n", "alone");
      EXPECT_EQ(alone.declarations.back().name, d.name);
      EXPECT_EQ(text_of(alone.declarations.back(), alone), text_of(d, real));
      count += d.draws;
    }
    EXPECT_GT(count, 2u) << name;
  }
}

TEST(Word, IsWrittenAndReadBackExactly) {
  const Grammar g = parse_file(std::string(FOREST_SOURCE_DIR) + "/data/grammars/purkinje.lsys");
  for (std::uint64_t i = 0; i < 5; ++i) {
    const Word word = derive(g, 1, i, 30);
    const Word back = parse_word(to_string(word, g), g);
    EXPECT_EQ(back.parameters, word.parameters);
    ASSERT_EQ(back.modules.size(), word.modules.size());
    for (std::size_t k = 0; k < word.modules.size(); ++k)
      EXPECT_EQ(back.modules[k].symbol, word.modules[k].symbol);
  }
  EXPECT_THROW(parse_word("Bud(uniform(0, 1), 2)", g), InputError);
  EXPECT_THROW(parse_word("Q(1)", g), InputError);
}

}  // namespace
}  // namespace forest::lsystem
