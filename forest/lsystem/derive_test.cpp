// SPDX-License-Identifier: Apache-2.0
#include "forest/lsystem/derive.h"

#include <gtest/gtest.h>

namespace forest::lsystem {
namespace {

std::string derived(std::string_view text, int steps) {
  const Grammar g = parse(text, "test");
  return to_string(derive(g, 0, 0, steps), g);
}

// Section 1.2: Lindenmayer's alga.
TEST(Book, AlgaeGrow) {
  const char* algae = "axiom: b\np1: a -> ab\np2: b -> a\n";
  const char* words[] = {"b", "a", "ab", "aba", "abaab", "abaababa"};
  for (int i = 0; i < 6; ++i) EXPECT_EQ(derived(algae, i), words[i]);
}

// Section 1.10.1: the parametric L-system of page 41 and its first words.
TEST(Book, ParametersAreRewritten) {
  const char* text =
      "axiom: B(2)A(4,4)\n"
      "p1: A(x,y) : y <= 3 -> A(x*2,x+y)\n"
      "p2: A(x,y) : y > 3 -> B(x)A(x/y,0)\n"
      "p3: B(x) : x < 1 -> C\n"
      "p4: B(x) : x >= 1 -> B(x-1)\n";
  const char* words[] = {"B(2)A(4,4)", "B(1)B(4)A(1,0)", "B(0)B(3)A(2,1)", "CB(2)A(4,3)", "CB(1)A(8,7)"};
  for (int i = 0; i < 5; ++i) EXPECT_EQ(derived(text, i), words[i]);
}

}  // namespace
}  // namespace forest::lsystem
