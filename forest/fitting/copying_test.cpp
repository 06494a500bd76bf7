// SPDX-License-Identifier: Apache-2.0
#include "forest/fitting/copying.h"

#include <gtest/gtest.h>

#include "forest/core/error.h"
#include "forest/lsystem/derive.h"

namespace forest::fitting {
namespace {

std::optional<std::size_t> run_of(const std::string& word) {
  const lsystem::Grammar g = lsystem::parse(
      "sample s(x = -> donor) = 0 -> 7 | 0 1 0 1: 0 3 0 1; 1 -> 8 | 0 1 0 1: 0 3 0 1; 2 -> 7 | 0 1 0 1: 0 3 "
      "0 1\n"
      "sample other(x =) = 0 | 0 1 0 1: 0 3 0 1\naxiom: " +
          word + "\nnothing: z -> z\n",
      "copies");
  return longest_run(lsystem::derive(g, 0, 0, 0), g);
}

TEST(LongestRun, FollowsBranches) {
  EXPECT_EQ(run_of("F(1)"), std::nullopt);
  EXPECT_EQ(run_of("Trace(other, 0, 0)"), std::nullopt);  // nobody knows where it comes from
  EXPECT_EQ(run_of("Trace(s, 0, 0) Trace(s, 1, 0) Trace(s, 0, 0)"), 1u);
  EXPECT_EQ(run_of("Trace(s, 0, 0) Trace(s, 2, 0) Trace(s, 1, 0)"), 2u);  // two rows of one neuron
  EXPECT_EQ(run_of("Trace(s, 0, 0) [ Trace(s, 1, 0) Trace(s, 1, 0) ] Trace(s, 2, 0) Trace(s, 0, 0)"), 3u);
  EXPECT_EQ(run_of("[ Trace(s, 0, 0) ] [ Trace(s, 0, 0) ]"), 1u);  // sisters do not follow one another
  EXPECT_EQ(run_of("Trace(s, 0, 0) At(0, 0, 9) Trace(s, 0, 0)"), 1u);
  EXPECT_THROW((void)run_of("Trace(s, 9, 0)"), Error);
}

}  // namespace
}  // namespace forest::fitting
