// SPDX-License-Identifier: Apache-2.0
#include "forest/io/node_types.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include "forest/core/error.h"

namespace forest::io {
namespace {

using testing::ElementsAre;

TEST(NodeTypes, AreReadAsPublishedCircuitsHaveThem) {
  const Table table = parse_table(
      "node_type_id ei \"pop name\"\r\n100 e \"L5 pyramidal\"\n\n101 NULL \"\"\n102 i \"a \"\"b\"\"\"", "t");
  EXPECT_THAT(table.columns, ElementsAre("node_type_id", "ei", "pop name"));
  EXPECT_THAT(table.rows, ElementsAre(ElementsAre("100", "e", "L5 pyramidal"), ElementsAre("101", "NULL", ""),
                                      ElementsAre("102", "i", "a \"b\"")));
  EXPECT_EQ(table.column("ei"), 1u);
  EXPECT_EQ(table.column("x"), std::nullopt);
}

TEST(NodeTypes, MistakesAreNamedWithTheirLine) {
  const auto line = [](std::string_view text) {
    try {
      parse_table(text, "t.csv");
      return std::size_t(9999);
    } catch (const InputError& error) {
      return error.line();
    }
  };
  EXPECT_EQ(line("a b\n1 2\n3\n"), 3u);
  EXPECT_EQ(line("a b\n1 2 3\n"), 2u);
  EXPECT_EQ(line("a b\n1 \"2\n3 4\n"), 2u);
  EXPECT_EQ(line(""), 0u);
}

RC_GTEST_PROP(NodeTypes, AnyTextsComeBack, ()) {
  const auto width = *rc::gen::inRange<std::size_t>(1, 4);
  const auto cell = rc::gen::container<std::string>(rc::gen::elementOf(std::string("ab \"'#,\n\t\r1")));
  const auto row = rc::gen::container<std::vector<std::string>>(width, cell);
  Table table{*row, *rc::gen::container<std::vector<std::vector<std::string>>>(row), {}};
  const Table back = parse_table(format_table(table), "t");
  RC_ASSERT(back.columns == table.columns);
  RC_ASSERT(back.rows == table.rows);
}

}  // namespace
}  // namespace forest::io
