// SPDX-License-Identifier: Apache-2.0
#include "forest/io/swc.h"

#include <gtest/gtest.h>

#include "forest/core/error.h"
#include "forest/morphology/measure.h"

namespace forest::io {
namespace {

TEST(Swc, ReadsSomaStemAndBranches) {
  const auto [m, warnings] = read_swc(
      "# CREATURE rat\n1 1 0 0 0 5 -1\n2 4 0 5 0 1 1\n3 4 0 15 0 .5 2\n4 4 3 19 0 .5 3\n5 4 -3 19 0 .5 3\n",
      "cell.swc");
  EXPECT_TRUE(warnings.empty());
  EXPECT_EQ(m.soma().kind, SomaKind::sphere);
  ASSERT_EQ(m.sections().size(), 3u);
  EXPECT_EQ(m.section(SectionId(0)).soma_point, 0);
  EXPECT_EQ(m.section(SectionId(2)).kind, SectionKind::apical);
  EXPECT_DOUBLE_EQ(total_length(m), 20.);
  EXPECT_EQ(m.annotations(), (Annotations{{"CREATURE", "rat"}}));
  EXPECT_EQ(read_swc(write_swc(m), "again").morphology, m);
}

TEST(Swc, AnErrorNamesFileLineAndRemedy) {
  try {
    read_swc("1 1 0 0 0 5 -1\n2 3 0 abc 0 1 1\n", "cell.swc");
    FAIL();
  } catch (const InputError& error) {
    EXPECT_STREQ(error.what(),
                 "cell.swc:2: column 4 (y) is \"abc\", not a number; a row is: id type x y z radius parent");
  }
}

}  // namespace
}  // namespace forest::io
