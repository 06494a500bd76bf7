// SPDX-License-Identifier: Apache-2.0
// What is remembered of a turtle's way changes no answer: a word grows as one whose way is gone from the root in every step.
#include "forest/lsystem/answers.h"

#include <string>

#include <gtest/gtest.h>

#include "forest/lsystem/derive.h"
#include "forest/lsystem/turtle.h"

namespace forest::lsystem {
namespace {

using cortex::Environment;
using cortex::Site;

const Site& tissue() {
  static const Environment e({{"L1", 2050.f, 2200.f}, {"L5", 600.f, 2050.f}, {"L6", 0.f, 600.f}},
                             {{{20, 1240, 5}, 9.f}, {{-30, 1300, 0}, 8.f}}, {{{100, 900, 0}, 1.f, 120.f}});
  static const Site site{&e, {0, 1200, 0}};
  return site;
}

// The same grammar with a module at the root that might move the turtle and never does: nothing behind it is settled.
std::string unsettled(std::string text) {
  text.insert(text.find("axiom:") + 6, " Z");
  return text + "\nrestless: Z : 0 -> F(1)\n";
}

struct Case {
  std::string name, text;
  int steps;
};

std::vector<Case> cases() {
  std::vector<Case> all{
      {"a tip", "axiom: A ?P(0, 0, 0)\np: A > ?P(x, y, z) -> +(10 + x) F(3) A\n", 20},
      {"forks",
       "axiom: A(0) ?P(0, 0, 0)\np: A(i) > ?P(x, y, z) : i < 6 -> [ +(20 + y) F(3) A(i + 1) ?P(0, 0, 0) ] "
       "-(30 + x) "
       "F(4) A(i + 1)\n",
       9},
      {"what is before grows",
       "axiom: G(1) F(2) A ?P(0, 0, 0)\ng: G(l) -> F(l) +(3) G(l)\n"
       "p: A > ?P(x, y, z) -> &(x) F(2) A\n",
       12},
      {"what is before ends",
       "axiom: G(5) F(2) A ?P(0, 0, 0)\ng: G(l) : l > 0 -> F(l) G(l - 1)\nh: G(l) -> \n"
       "p: A > ?P(x, y, z) -> &(x + y) F(2) A\n",
       12},
      {"segments stretch",
       "axiom: F(1) A ?H(0, 0, 0)\ns: F(l) : l < 3 -> F(1.1 * l)\n"
       "p: A > ?H(x, y, z) -> +(10 * y) F(1) [ -(40) F(1) A ?H(0, 0, 0) ] A\n",
       8},
      {"a clock beats",
       "axiom: T(0.1) C(0) A ?S(0, 0, 0)\nc: C(n) -> C(n + 1)\np: A > ?S(x, y, z) -> +(5 + y) F(2) A\n", 15},
      {"a soma before all", "axiom: f(30) Soma(9) A ?P(0, 0, 0)\np: A > ?P(x, y, z) -> +(y) F(2) A\n", 10},
      {"a soma behind",
       "axiom: [ f(4) A ?P(0, 0, 0) ] f(30) Soma(9) A ?P(0, 0, 0)\np: A > ?P(x, y, z) -> +(y) F(2) A\n", 10},
      {"a soma comes late",
       "axiom: [ f(4) A ?P(0, 0, 0) ] f(30) S(3)\ns: S(i) : i > 0 -> f(1) S(i - 1)\n"
       "t: S(i) -> Soma(9)\np: A > ?P(x, y, z) -> +(y) F(2) A\n",
       10},
      {"a soma grows",
       "axiom: Soma(3) f(4) Avoid(1) A ?P(0, 0, 0)\ns: Soma(d) : d < 20 -> Soma(1.2 * d)\n"
       "p: A > ?P(x, y, z) -> &(160) F(2) A\n",
       10},
      {"a branch is seen from outside",
       "axiom: A(0) [ ?D(0) B(3) ]\nb: B(n) : n > 0 -> F(n) ?D(0) B(n - 1)\np: A(x) > [ ?D(d) ] -> F(1) "
       "A(d)\n",
       6},
      {"questions come and go",
       "axiom: A(0, 0) ?P(0, 0, 0)\nq: ?P(x, y, z) -> A(x, y)\n"
       "p: A(x, y) : y < 40 -> F(3 + x) +(3) A(x, y + 1) ?P(0, 0, 0)\n",
       7},
      {"much is rewritten",
       "axiom: Soma(8) A(0) ?P(0, 0, 0)\nk: K(i) : i > 0 -> K(i - 1) K(0)\nl: K(i) -> \n"
       "p: A(i) > ?P(x, y, z) -> F(1) +(3) [ K(1500) ] A(i + 1)\n",
       400},
      {"somata are kept out of",
       "axiom: Soma(12) f(7) Avoid(1) Shun(0.2, 8) Seek(0.1) A ?N(0)\np: A > ?N(d) -> +(90 / d) F(6, 1) A\n",
       30}};
  for (const char* name : {"tufted", "martinotti", "stellate", "astrocyte"}) {
    const Grammar g = parse_file(std::string(FOREST_SOURCE_DIR) + "/data/grammars/" + name + ".lsys");
    all.push_back({name, g.text, g.steps});
  }
  return all;
}

TEST(Answers, AreThoseOfTheWholeWay) {
  for (const Case& c : cases()) {
    const Grammar quick = parse(c.text, c.name), slow = parse(unsettled(c.text), c.name);
    for (const std::uint64_t seed : {1u, 2u}) {
      const Word word = derive(quick, seed, 0, c.steps, tissue());
      EXPECT_GT(word.modules.size(), 8u) << c.name;
      EXPECT_EQ(interpret(word, quick, {}, tissue()),
                interpret(derive(slow, seed, 0, c.steps, tissue()), slow, {}, tissue()))
          << c.name;
    }
  }
}

}  // namespace
}  // namespace forest::lsystem
