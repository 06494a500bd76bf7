// SPDX-License-Identifier: Apache-2.0
#include "forest/reports/code.h"

#include <cmath>
#include <limits>

#include <gtest/gtest.h>

#include "forest/core/random.h"

namespace forest::reports {
namespace {

TEST(Code, StaysWithinTheStatedErrorOverTheWholeRange) {
  const Range range;
  EXPECT_LE(range.error(), .3f);
  std::vector<float> values;
  for (int i = 0; i <= 150000; ++i) values.push_back(-100.f + float(i) * .001f);
  std::vector<Code> codes(values.size());
  range.encode(values, codes.data());
  for (std::size_t i = 0; i < values.size(); ++i)
    ASSERT_NEAR(range.value(codes[i]), values[i], double(range.error()) + 1e-4) << values[i];
}

TEST(Code, HoldsTheEndsAndTellsNoValue) {
  const Range range;
  constexpr float inf = std::numeric_limits<float>::infinity();
  const std::vector<float> values{-1e30f, -inf, -100.f, 50.f, 51.f, inf, std::nanf(""), -std::nanf("")};
  std::vector<Code> codes(values.size());
  range.encode(values, codes.data());
  EXPECT_EQ(codes, (std::vector<Code>{0, 0, 0, 254, 254, 254, no_value, no_value}));
  EXPECT_EQ(range.value(0), -100.f);
  EXPECT_NEAR(range.value(254), 50.f, 1e-4);
  EXPECT_TRUE(std::isnan(range.value(no_value)));
}

TEST(Row, ComesBackEqualWhole_AndInPieces) {
  Random random(3);
  for (const unsigned spread : {1u, 2u, 3u, 4u, 5u, 16u, 17u, 100u, 256u})
    for (const std::size_t count : {1u, 2u, 63u, 64u, 65u, 128u, 1000u}) {
      std::vector<Code> codes(count);
      const unsigned low = random.below(257 - spread);
      for (Code& code : codes) code = Code(low + random.below(spread));
      std::vector<std::byte> row;
      pack_row(codes, row);
      ASSERT_TRUE(is_row(row, count));
      std::vector<Code> back(count);
      unpack(row, count, 0, back);
      ASSERT_EQ(back, codes) << spread << " " << count;
      for (int k = 0; k < 20; ++k) {
        const std::size_t first = random.below(std::uint32_t(count));
        std::vector<Code> piece(random.below(std::uint32_t(count - first + 1)));
        unpack(row, count, first, piece);
        ASSERT_TRUE(std::equal(piece.begin(), piece.end(), codes.begin() + std::ptrdiff_t(first)));
      }
      EXPECT_FALSE(is_row(std::span(row).first(row.size() - 1), count));
      row.push_back({});
      EXPECT_FALSE(is_row(row, count));
    }
}

TEST(Row, OfASilentNeuronTakesTwoBytesAGroup) {
  std::vector<std::byte> row;
  pack_row(std::vector<Code>(640, 51), row);
  EXPECT_EQ(row.size(), 20u);
}

TEST(Row, RaisedHasTheGreaterAndNoValueGivesWay) {
  std::vector<Code> codes{1, 200, no_value, no_value, 0};
  raise(codes, std::vector<Code>{2, 100, 7, no_value, no_value});
  EXPECT_EQ(codes, (std::vector<Code>{2, 200, 7, no_value, 0}));
}

}  // namespace
}  // namespace forest::reports
