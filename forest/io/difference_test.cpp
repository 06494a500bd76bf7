// SPDX-License-Identifier: Apache-2.0
#include "forest/io/difference.h"

#include <gtest/gtest.h>

#include "forest/core/random.h"

namespace forest::io {
namespace {

TEST(Difference, NamesWhatStaysAndTellsWhatIsNew) {
  const auto passages = difference("a\nb\nc\nd\n", "a\nB\nc\nd");
  EXPECT_EQ(passages, (std::vector<Passage>{{0, 1, {}}, {0, 0, "B\n"}, {2, 1, {}}, {0, 0, "d"}}));
}

TEST(Difference, OfEqualTextsIsOnePassage) {
  EXPECT_EQ(difference("x\ny\n", "x\ny\n"), (std::vector<Passage>{{0, 2, {}}}));
  EXPECT_EQ(difference("\n\n\n", "\n\n\n").size(), 1u);
  EXPECT_TRUE(difference("x\n", "").empty());
}

TEST(Difference, AnyTextIsRebuiltFromAnyOther) {
  Random random(7, 0, 9);
  for (int trial = 0; trial < 3000; ++trial) {
    const auto text = [&] {
      std::string made;
      for (std::uint32_t i = 0, count = random.below(30); i < count; ++i)
        made += "abcdefgh\n\n\r"[random.below(11)];
      return made;
    };
    const std::string from = text(), to = text();
    EXPECT_EQ(rebuilt(from, difference(from, to)), to);
  }
}

}  // namespace
}  // namespace forest::io
