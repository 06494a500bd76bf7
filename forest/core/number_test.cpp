// SPDX-License-Identifier: Apache-2.0
#include "forest/core/number.h"

#include <bit>
#include <cstdint>
#include <string>

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

namespace forest {
namespace {

RC_GTEST_PROP(Number, IsReadAsItWasWritten, (std::uint64_t bits)) {
  const auto wide = std::bit_cast<double>(bits);
  const auto narrow = std::bit_cast<float>(std::uint32_t(bits));
  RC_PRE(!std::isnan(wide) && !std::isnan(narrow));
  RC_ASSERT(number_of<double>(fmt::format("{}", wide)) == wide);
  RC_ASSERT(number_of<float>(fmt::format("{}", narrow)) == narrow);
  RC_ASSERT(number_of<float>(fmt::format("{:.17g}", wide)) == float(wide));
  RC_ASSERT(number_of<std::uint64_t>(fmt::format("{}", bits)) == bits);
  RC_ASSERT(number_of<std::int64_t>(fmt::format("{:+}", std::int64_t(bits))) == std::int64_t(bits));
  RC_ASSERT(!number_of<double>(fmt::format("{}x", wide)) && !number_of<double>(fmt::format(" {}", wide)));
}

TEST(Number, HasTheWordsOfFractions) {
  EXPECT_EQ(number_of<double>("+1.5e3"), 1500.);
  EXPECT_EQ(number_of<double>("-.5"), -.5);
  EXPECT_EQ(number_of<float>("inf"), std::numeric_limits<float>::infinity());
  EXPECT_TRUE(std::isnan(number_of<float>("nan").value()));
}

TEST(Number, BeyondItsTypeIsRoundedOrNone) {
  EXPECT_EQ(number_of<float>("1e-46"), 0.f);
  EXPECT_EQ(number_of<float>("1e39"), std::numeric_limits<float>::infinity());
  EXPECT_EQ(number_of<double>("-1e-400"), 0.);
  EXPECT_TRUE(std::signbit(number_of<double>("-1e-400").value()));
  EXPECT_EQ(number_of<double>("-1e400"), -std::numeric_limits<double>::infinity());
  EXPECT_EQ(number_of<int>("2147483648"), std::nullopt);
  EXPECT_EQ(number_of<unsigned>("-1"), std::nullopt);
}

TEST(Number, IsNoneOfOtherWords) {
  for (const char* word : {"", "+", "-", "+-1", "++1", "--1", "1,5", "1 ", "0x10", "one", "1e", "1..2", "e5"})
    EXPECT_EQ(number_of<double>(word), std::nullopt) << word;
  for (const char* word : {"", "+", "1.0", "1e3", "0x1"})
    EXPECT_EQ(number_of<int>(word), std::nullopt) << word;
}

}  // namespace
}  // namespace forest
