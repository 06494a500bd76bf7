// SPDX-License-Identifier: Apache-2.0
#include "forest/circuit/toml_node.h"

#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/refused.h"

namespace forest::circuit {
namespace {

using testing::HasSubstr;

std::string dots(int count) {
  std::string text = "a";
  for (int i = 0; i < count; ++i) text += ".a";
  return text;
}

std::string told(const std::string& text) {
  return refused<InputError>([&] { parse_toml(text, "recipe.toml"); });
}

TEST(Toml, RefusesKeysThatNestWithoutEnd) {
  for (const std::string before :
       {"", "x = \"text\"\n", "x = 'a\\'\n", "x = \"\\\"\"\n", "# \"\n", "x = '''a''''\n",
        "x = \"\"\"a\n\"b\"\"\"\"\"\n", "x = \"\"\n", "x = '''\n'''\n"})
    for (const int count : {257, 100'000})
      EXPECT_THAT(told(before + "y = 1\n" + dots(count) + " = 1"), HasSubstr("too many parts")) << before;
  EXPECT_THAT(told("x = {a = \"\"\"b\"\"\"\"\", " + dots(257) + " = 1}"), HasSubstr("too many parts"));
  EXPECT_THAT(told("x = {a = '', " + dots(257) + " = 1}"), HasSubstr("too many parts"));
}

TEST(Toml, DotsOfTextsAndCommentsAreNoKeys) {
  for (const std::string& text :
       {"x = \"" + dots(400) + "\"", "x = '" + dots(400) + "'", "# " + dots(400) + "\nx = 1",
        "x = \"\"\"\n" + dots(400) + "\n\"\"\"", "x = \"\\\"" + dots(400) + "\""})
    EXPECT_EQ(told(text), "") << text.substr(0, 20);
}

}  // namespace
}  // namespace forest::circuit
