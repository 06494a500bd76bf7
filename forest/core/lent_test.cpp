// SPDX-License-Identifier: Apache-2.0
#include "forest/core/lent.h"

#include <gtest/gtest.h>

#include "forest/core/parallel.h"

namespace forest {
namespace {

TEST(Lent, ComesBackAsItWasLeft) {
  const int* before = nullptr;
  {
    Lent<std::vector<int>> numbers;
    numbers->assign(1000, 7);
    before = numbers->data();
  }
  Lent<std::vector<int>> again, another;
  EXPECT_EQ(again->data(), before);
  EXPECT_EQ(again->size(), 1000u);
  EXPECT_TRUE(another->empty());
}

TEST(Lent, IsHeldByOneAtATime) {
  struct Counted {
    int held = 0;
  };
  parallel_for(1000, 1, [&](std::size_t) {
    Lent<Counted> outer;
    EXPECT_EQ(outer->held++, 0);
    {
      Lent<Counted> inner;
      EXPECT_EQ(inner->held++, 0);
      inner->held--;
    }
    outer->held--;
  });
}

}  // namespace
}  // namespace forest
