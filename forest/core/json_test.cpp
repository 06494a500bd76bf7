// SPDX-License-Identifier: Apache-2.0
#include "forest/core/json.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "forest/core/error.h"

#include "tests/refused.h"

namespace forest {
namespace {

using testing::HasSubstr;
using testing::StrEq;

std::string refused_json(const std::string& text, const JsonLimits& limits = {}) {
  return refused<InputError>([&] { check_json(text, "a.json", "correct it", limits); });
}
std::string nested(std::size_t brackets) { return std::string(brackets, '[') + std::string(brackets, ']'); }
std::string object_of(std::size_t members) {
  std::string text = "{";
  for (std::size_t i = 0; i < members; ++i) text += (i ? ",\"" : "\"") + std::to_string(i) + "\":[{\"a\":1}]";
  return text + "}";
}

TEST(Json, BreaksOffInALineAndAColumn) {
  EXPECT_THAT(refused_json("{\"a\": 1,\n  oops}"),
              StrEq("a.json:2: is no JSON from column 3 on; correct it"));
  EXPECT_THAT(refused_json(""), HasSubstr("a.json:1: is no JSON"));
  EXPECT_THAT(refused_json("[1,\n1e999]"), HasSubstr("a.json:2: holds a number too large"));
}

TEST(Json, IsRefusedWhenItsBracketsOrMembersDoNotEnd) {
  EXPECT_NO_THROW(check_json(nested(32), "a.json", ""));
  EXPECT_THAT(refused_json(nested(33)), HasSubstr("more than 32 brackets within one another; correct it"));
  EXPECT_THAT(refused_json(std::string(1'000'000, '[')), HasSubstr("brackets"));
  EXPECT_NO_THROW(check_json(object_of(10), "a.json", "", {.most_members = 10}));
  EXPECT_THAT(refused_json(object_of(11), {.most_members = 10}), HasSubstr("more than 10 members"));
}

TEST(Json, MayHaveToUseAKeyOnce) {
  const std::string twice = R"({"a": {"b": 1}, "c": {"b": 1, "\u0062": 2}})";
  EXPECT_NO_THROW(check_json(twice, "a.json", ""));
  EXPECT_THAT(refused_json(twice, {.keys_once = true}), StrEq("a.json: has 'b' twice; take one out"));
  EXPECT_NO_THROW(check_json(R"([{"a": 1}, {"a": {"a": 2}}])", "a.json", "", {.keys_once = true}));
}

}  // namespace
}  // namespace forest
