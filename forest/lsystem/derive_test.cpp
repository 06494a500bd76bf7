// SPDX-License-Identifier: Apache-2.0
#include "forest/lsystem/derive.h"

#include <map>

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include "forest/core/error.h"

#include "tests/refused.h"

namespace forest::lsystem {
namespace {

std::string derived(const std::string& text, int steps, std::uint64_t index = 0) {
  const Grammar g = parse(text, "test");
  return to_string(derive(g, 1, index, steps), g);
}

// Words of a, b and c, and for each letter what it becomes.
struct Rules {
  std::string axiom;
  std::map<char, std::string> successor;
};
Rules any_rules() {
  const auto word = [](int least, int most) {
    return *rc::gen::resize(
        most, rc::gen::suchThat(rc::gen::container<std::string>(rc::gen::elementOf(std::string("abc"))),
                                [=](const std::string& w) { return int(w.size()) >= least; }));
  };
  return {word(1, 6), {{'a', word(0, 3)}, {'b', word(0, 3)}, {'c', word(0, 2)}}};
}

// Rewriting as the book defines it, letter by letter, as a reference.
std::string rewritten(const std::string& word, const std::map<char, std::string>& successor) {
  std::string next;
  for (const char letter : word) next += successor.at(letter);
  return next;
}

RC_GTEST_PROP(Derivation, RewritesAllLettersAtOnce, ()) {
  const Rules rules = any_rules();
  std::string text = "axiom: " + rules.axiom + "\n", word = rules.axiom;
  for (const auto& [letter, successor] : rules.successor)
    text += std::string("p_") + letter + ": " + letter + " -> " + successor + "\n";
  for (int n = 0; n < 5; ++n) {
    RC_ASSERT(derived(text, n) == word);
    word = rewritten(word, rules.successor);
  }
}

// With contexts: a letter is replaced where the one before and the one after are as said, seen in the old
// word.
RC_GTEST_PROP(Derivation, ContextsSeeTheWordBeforeTheStep, ()) {
  const Rules rules = any_rules();
  const std::string letters = "abc";
  struct Production {
    char left, middle, right;
    std::string successor;
  };
  std::vector<Production> productions;
  std::string text = "axiom: " + rules.axiom + "\n";
  for (int i = 0; i < 4; ++i) {
    const auto any = [&] { return *rc::gen::elementOf(letters); };
    productions.push_back({any(), any(), any(), rules.successor.at(any())});
    const Production& p = productions.back();
    text += "p" + std::to_string(i) + ": " + p.left + " < " + p.middle + " > " + p.right + " -> " +
            p.successor + "\n";
  }
  std::string word = rules.axiom;
  for (int n = 0; n < 5; ++n) {
    RC_ASSERT(derived(text, n) == word);
    std::string next;
    for (std::size_t i = 0; i < word.size(); ++i) {
      std::string become(1, word[i]);
      for (const Production& p : productions)
        if (i > 0 && i + 1 < word.size() && word[i - 1] == p.left && word[i] == p.middle &&
            word[i + 1] == p.right) {
          become = p.successor;
          break;
        }
      next += become;
    }
    word = next;
  }
}

TEST(Derivation, EndsWhenNothingIsLeftToRewrite) {
  EXPECT_EQ(derived("axiom: A(3)\np: A(n) : n > 0 -> F A(n-1)\nq: A(n) ->\n", 1000), "FFF");
}

TEST(Derivation, UsesTheGrammarsStepsWhenNoneAreGiven) {
  const Grammar g = parse("steps: 4\naxiom: A\np: A -> BA\n", "test");
  EXPECT_EQ(to_string(derive(g), g), "BBBBA");
}

TEST(Derivation, ProductionsFitBySymbolAndNumberOfParameters) {
  EXPECT_EQ(derived("axiom: A A(1) A(1,2)\np: A(x) -> B\n", 1), "ABA(1,2)");
}

TEST(Derivation, TheFirstCertainProductionThatFitsIsUsed) {
  EXPECT_EQ(derived("axiom: A(5)\np: A(x) : x > 3 -> B\nq: A(x) : x > 1 -> C\n", 1), "B");
}

TEST(Derivation, WhatProbabilitiesLeaveGoesToTheCertainOrKeepsTheModule) {
  const auto share = [](const std::string& text, const std::string& word) {
    const Grammar g = parse(text, "test");
    Deriver deriver(g);
    int seen = 0;
    for (std::uint64_t i = 0; i < 10000; ++i) seen += to_string(deriver.derive(2, i, 1), g) == word;
    return seen / 10000.;
  };
  EXPECT_NEAR(share("axiom: A\np: A -> B : 0.2\nq: A -> C\n", "C"), .8, .02);
  EXPECT_NEAR(share("axiom: A\np: A -> B : 0.2\n", "A"), .8, .02);
  EXPECT_NEAR(share("axiom: A\np: A -> B : 3\nq: A -> C : 1\n", "B"), .75, .02);
  EXPECT_NEAR(share("axiom: A(0.3)\np: A(x) -> B : x\nq: A(x) -> C : 1 - x\n", "B"), .3, .02);
  EXPECT_EQ(share("axiom: A\np: A -> B : 0\nq: A -> C : 0\n", "A"), 1.);
}

// A later production that fits but for its condition leaves no trace, whatever its context and its functions put where.
TEST(Derivation, AProductionHasItsOwnParametersWhateverOthersAreAsked) {
  for (const char* two :
       {"two: M(a) < A(d) : a > 100 -> B(1)\n", "two: A(d) : sum(8, 9 + d, 7) < 0 -> B(1)\n"})
    EXPECT_EQ(derived(std::string("function sum(x, y, z) = y * z + x * y\naxiom: M(7) A(2)\n"
                                  "one: A(d) -> B(10 * d) : 0.99999999999\n") +
                          two,
                      1),
              "M(7)B(20)")
        << two;
}

TEST(Derivation, ARunawayProductionIsStoppedAndNamed) {
  const Grammar g =
      parse("limit: 1000\nsteps: 100\naxiom: AB\nquiet: B -> B\nrabbits: A -> AA\n", "runaway.lsys");
  try {
    derive(g);
    FAIL() << "grew for ever";
  } catch (const LimitError& error) {
    const std::string what = error.what();
    EXPECT_NE(what.find("runaway.lsys:5"), std::string::npos) << what;
    EXPECT_NE(what.find("production rabbits"), std::string::npos) << what;
    EXPECT_NE(what.find("1000 modules"), std::string::npos) << what;
  }
}

TEST(Derivation, AnAxiomBeyondTheLimitIsNamedItself) {
  for (const int steps : {0, 1})
    for (const char* axiom : {"BBBBBBBBBB", "AAAAAAAAA", "AAAAAAAA B"}) {
      const Grammar g = parse(fmt::format("limit: 8\n\naxiom: {}\np: A -> AB\n", axiom), "long.lsys");
      const std::string why = refused<LimitError>([&] { derive(g, 0, 0, steps); });
      EXPECT_TRUE(why.starts_with(
          "long.lsys:3: the word has more than 8 modules, most of them written by the axiom; "))
          << why;
    }
  // As many as are allowed are; what a production adds then is still mostly the axiom's.
  const Grammar g = parse("limit: 8\naxiom: AAAAAAAB\np: A -> AB\n", "full.lsys");
  EXPECT_EQ(derive(g, 0, 0, 0).modules.size(), 8u);
  EXPECT_TRUE(refused<LimitError>([&] { derive(g, 0, 0, 1); }).starts_with("full.lsys:2: "));
}

TEST(Derivation, WhatIsNoNumberIsAnErrorThatNamesTheProduction) {
  for (const char* successor :
       {"B(log(-x))", "B(1/0*x)", "B(truncnormal(0, -1, 0, 1))", "B(gamma(-x, 1))", "B(normal(0, -x))",
        "B(lognormal(0, -x))", "B(exponential(-x))", "B(poisson(-x))", "B(gamma(1, -x))", "B(weibull(1, -x))",
        "B(chance(log(-x)))", "B(sign(log(-x)))"}) {
    const Grammar g = parse(std::string("axiom: A(1)\nculprit: A(x) -> ") + successor + "\n", "test");
    EXPECT_NE(refused([&] { derive(g, 0, 0, 1); }).find("production culprit"), std::string::npos)
        << successor;
  }
  EXPECT_THROW(derived("axiom: A\np: A -> B : -1\n", 1), Error);
  EXPECT_THROW(derived("axiom: A(0/0)\np: A -> B\n", 1), Error);
}

TEST(Derivation, AConditionThatIsNoNumberIsAnErrorWithItsLine) {
  for (const char* condition : {"log(-x)", "!log(-x)", "x & log(-x)", "log(-x) | 0", "t(log(-x))",
                                "if(log(-x), 1, 1)", "if(!t(0/0 * x), 1, 1)"}) {
    const Grammar g =
        parse(std::string("table t = 1: 5\naxiom: A(1)\nculprit: A(x) : ") + condition + " -> B\n", "test");
    const std::string why = refused([&] { derive(g, 0, 0, 1); });
    EXPECT_NE(why.find("test:3: "), why.npos) << condition << ": " << why;
    EXPECT_NE(why.find("no number; "), why.npos) << condition << ": " << why;
  }
  // What does not hang on it is as it was, and comparisons with it are false.
  for (const char* condition : {"!(log(-x) > 0)", "x | log(-x)", "log(-x) | x", "!(0 & log(-x))"})
    EXPECT_EQ(derived(std::string("axiom: A(1)\np: A(x) : ") + condition + " -> B\n", 1), "B") << condition;
}

TEST(Derivation, LongHistoriesTakeNoMemoryOfTheirOwn) {
  // 300,000 rewritings of a word of two modules; the arena is compacted on the way, with the same result.
  EXPECT_EQ(derived("axiom: A(300000)B\np: A(n) : n > 0 -> A(n-1)\n", 300000), "A(0)B");
}

// Each step adds one A for every two there are; B counts only in its own tree.
TEST(Derive, TotalsAreSumsOverTheWordBeforeEachStep) {
  const Grammar g = parse(
      "module Count(n, m, w)\ntotal many = A(tree, x) : 1\ntotal weight(tree) = A(tree, x) : x * 2\n"
      "function both(t) = many + weight(t)\n"
      "axiom: A(0, 1) A(1, 10) A(1, 20) R(0)\n"
      "grow: A(tree, x) -> A(tree, x + many)\nread: R(i) : i < 2 -> Count(many, weight(i), both(1)) R(i + "
      "1)\n",
      "test");
  const Word word = derive(g, 0, 0, 3);
  EXPECT_EQ(to_string(word, g), "A(0,10)A(1,19)A(1,29)Count(3,2,63)Count(3,72,75)R(2)");
  EXPECT_EQ(derive(g, 0, 0, 3).parameters, word.parameters);
  Deriver again(g);  // memory is kept, sums are not
  again.derive(0, 0, 3);
  EXPECT_EQ(again.derive(0, 0, 3).parameters, word.parameters);
}

TEST(Derive, TotalsSayWhatIsWrongWithThem) {
  const auto refused = [](const std::string& text, const std::string& why) {
    try {
      parse(text + "axiom: A(1)\ng: A(x) -> A(x)\n", "t");
      FAIL() << text;
    } catch (const InputError& error) {
      EXPECT_NE(std::string(error.what()).find(why), std::string::npos) << error.what();
    }
  };
  refused("total n = A(x) B(y) : 1\n", "one module");
  refused("total n = [ : 1\n", "one module");
  refused("total n(y) = A(x) : 1\n", "no parameter y");
  refused("total n = A(x) : uniform(0, x)\n", "neither draws");
  refused("total n = A(x) : 1\ntotal m = A(x) : n\n", "neither draws");
  refused("total n = A(x) : 1\ncell c = n\n", "before there is a word");
  refused("total n = A(x) : 1\nfunction f(x) = n\ncell c = f(1)\n", "before there is a word");
  refused("total n(x) = A(x) : 1\nfunction f(x) = n\n", "wants its arguments");
  refused("total n = A(x)\n", "before what is summed");
  // Beyond its whole numbers a total by a parameter is not a number, which a production says of itself.
  const Grammar g = parse("total n(x) = A(x) : 1\naxiom: A(70)\ng: A(x) -> A(n(x))\n", "t");
  EXPECT_THROW(derive(g, 0, 0, 1), InputError);
  EXPECT_THROW(derived("total n(x) = A(x) : 1\naxiom: A(2.5)\ng: A(x) -> A(n(x))\n", 1), InputError);
}

TEST(Derive, TotalsAreOfWholeNumbers) {
  EXPECT_EQ(derived("total n(x) = A(x) : 1\naxiom: A(2) A(2.7) B\ng: B -> C(n(2))\nh: A(x) -> A(x)\n", 1),
            "A(2)A(2.7)C(1)");
}

}  // namespace
}  // namespace forest::lsystem
