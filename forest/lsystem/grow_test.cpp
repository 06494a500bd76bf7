// SPDX-License-Identifier: Apache-2.0
#include "forest/lsystem/grow.h"

#include <gtest/gtest.h>

#include "forest/core/parallel.h"

namespace forest::lsystem {
namespace {

constexpr const char* builtin[] = {"motoneuron", "purkinje", "pyramidal"};

Grammar grammar(const std::string& name) {
  return parse_file(std::string(FOREST_SOURCE_DIR) + "/data/grammars/" + name + ".lsys");
}

TEST(Grow, IsTheSameAtAnyNumberOfThreads) {
  for (const auto name : builtin) {
    const Grammar g = grammar(name);
    const auto many = grow_population(g, 12, 3);
    const ThreadLimit one(1);
    EXPECT_EQ(many, grow_population(g, 12, 3));
    EXPECT_EQ(many[7], grow(g, 3, 7));
  }
}

TEST(Grow, NeuronsDiffer) {
  for (const auto name : builtin) {
    const Grammar g = grammar(name);
    EXPECT_NE(grow(g, 1, 0), grow(g, 1, 1));
    EXPECT_NE(grow(g, 1, 0), grow(g, 2, 0));
  }
}

}  // namespace
}  // namespace forest::lsystem
