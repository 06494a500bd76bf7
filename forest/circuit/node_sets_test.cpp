// SPDX-License-Identifier: Apache-2.0
#include "forest/circuit/node_sets.h"

#include <cmath>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "forest/core/error.h"

#include "tests/refused.h"

namespace forest::circuit {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using Ask = Clause::Test;

// Six nodes: layers 2 2 3 3 4 4, types a b a b a b, heights 0 10 20 30 40 50.
NodeTable six() {
  return {6,
          [](std::string_view name) -> std::optional<Attribute> {
            if (name == "layer") return Attribute{{"2", "3", "4"}, {0, 0, 1, 1, 2, 2}, {}};
            if (name == "mtype") return Attribute{{"L2_a", "L2_b"}, {0, 1, 0, 1, 0, 1}, {}};
            if (name == "y") return Attribute{{}, {}, {0, 10, 20, 30, 40, 50}};
            if (name == "node_id") return Attribute{{}, {}, {0, 1, 2, 3, 4, 5}};
            if (name == "some") return Attribute{{}, {}, {1, NAN, 3, NAN, 5, NAN}};
            if (name == "class")
              return Attribute{{"x", "y"}, {0, Attribute::unknown, 1, 1, Attribute::unknown, 0}, {}};
            return std::nullopt;
          },
          "layer, mtype, node_id, y, some, class"};
}

Members of(std::vector<Clause> clauses) {
  NodeSets sets;
  sets.put({.name = "set", .clauses = std::move(clauses), .of = {}});
  return members(sets, "set", six());
}

TEST(NodeSets, EveryClauseMustHoldAndOneOfItsValues) {
  EXPECT_THAT(of({}), ElementsAre(0, 1, 2, 3, 4, 5));
  EXPECT_THAT(of({{"mtype", Ask::any_of, {"L2_a"}, {}}}), ElementsAre(0, 2, 4));
  EXPECT_THAT(of({{"layer", Ask::any_of, {"2", "4"}, {}}, {"mtype", Ask::any_of, {"L2_b"}, {}}}),
              ElementsAre(1, 5));
  EXPECT_THAT(of({{"layer", Ask::any_of, {}, {2, 3}}}), ElementsAre(0, 1, 2, 3));
  EXPECT_THAT(of({{"node_id", Ask::any_of, {}, {2, 0, 0, 99}}}), ElementsAre(0, 2));
  EXPECT_THAT(of({{"node_id", Ask::any_of, {}, {}}}), IsEmpty());
  EXPECT_THAT(of({{"mtype", Ask::any_of, {"none of this name"}, {}}}), IsEmpty());
}

TEST(NodeSets, NumbersAreComparedAndWordsMeetPatterns) {
  EXPECT_THAT(of({{"y", Ask::greater, {}, {20}}}), ElementsAre(3, 4, 5));
  EXPECT_THAT(of({{"y", Ask::at_least, {}, {20}}, {"y", Ask::less, {}, {40}}}), ElementsAre(2, 3));
  EXPECT_THAT(of({{"y", Ask::at_most, {}, {10}}}), ElementsAre(0, 1));
  EXPECT_THAT(of({{"mtype", Ask::regex, {"^L[23].*b$"}, {}}}), ElementsAre(1, 3, 5));
  EXPECT_THAT(of({{"mtype", Ask::regex, {"_a"}, {}}}), ElementsAre(0, 2, 4));
}

TEST(NodeSets, ANodeWithoutTheAttributeIsInNoSetThatAsksForIt) {
  EXPECT_THAT(of({{"some", Ask::less, {}, {99}}}), ElementsAre(0, 2, 4));
  EXPECT_THAT(of({{"some", Ask::greater, {}, {-99}}}), ElementsAre(0, 2, 4));
  EXPECT_THAT(of({{"some", Ask::any_of, {}, {0, 3, 7}}}), ElementsAre(2));
  EXPECT_THAT(of({{"class", Ask::any_of, {"x", "y"}, {}}}), ElementsAre(0, 2, 3, 5));
  EXPECT_THAT(of({{"class", Ask::regex, {""}, {}}}), ElementsAre(0, 2, 3, 5));
}

std::string refused(const NodeSets& sets, std::string_view name) {
  return forest::refused<InputError>([&] { members(sets, name, six()); });
}

TEST(NodeSets, CompoundsAreUnionsAndCirclesAreNamed) {
  NodeSets sets{.source = "sets.json", .sets = {}};
  sets.put({.name = "two", .clauses = {{"layer", Ask::any_of, {"2"}, {}}}, .of = {}});
  sets.put({.name = "a", .clauses = {{"mtype", Ask::any_of, {"L2_a"}, {}}}, .of = {}});
  sets.put({.name = "both", .clauses = {}, .of = {"two", "a", "two"}, .compound = true});
  sets.put({.name = "none", .clauses = {}, .of = {}, .compound = true});
  EXPECT_THAT(members(sets, "both", six()), ElementsAre(0, 1, 2, 4));
  EXPECT_THAT(members(sets, "none", six()), IsEmpty());
  sets.put({.name = "x", .clauses = {}, .of = {"two", "y"}, .compound = true});
  sets.put({.name = "y", .clauses = {}, .of = {"z"}, .compound = true});
  sets.put({.name = "z", .clauses = {}, .of = {"x"}, .compound = true});
  EXPECT_THAT(refused(sets, "y"), HasSubstr("'y' → 'z' → 'x' → 'y'"));
  EXPECT_THAT(refused(sets, "missing"), HasSubstr("sets.json: there is no node set 'missing'"));
  sets.put({.name = "z", .clauses = {}, .of = {"gone"}, .compound = true});
  EXPECT_THAT(refused(sets, "x"), HasSubstr("'z' names 'gone'"));
  EXPECT_THAT(members(sets, "both", six()),
              ElementsAre(0, 1, 2, 4));  // what is wrong elsewhere does not matter
}

TEST(NodeSets, MayBeManyAndAreAddedAndTakenOut) {
  constexpr std::size_t many = 100'000;
  NodeSets sets;
  NodeSet whole{.name = "whole", .clauses = {}, .of = {}, .compound = true};
  for (std::size_t i = 0; i < many; ++i) {  // of each of which a walk through all would take minutes
    sets.put(
        {.name = std::to_string(i), .clauses = {{"node_id", Ask::any_of, {}, {double(i % 6)}}}, .of = {}});
    whole.of.push_back(std::to_string(i));
  }
  sets.sets.push_back(whole);
  EXPECT_EQ(members(sets, "whole", six()).size(), 6u);
  for (std::size_t i = 0; i < many; ++i) ASSERT_EQ(sets.find(std::to_string(i)), &sets.sets[i]);
  EXPECT_TRUE(sets.remove("3"));
  EXPECT_FALSE(sets.remove("3"));
  EXPECT_EQ(sets.find("3"), nullptr);
  EXPECT_EQ(sets.find("4"), &sets.sets[3]);
}

TEST(NodeSets, ThatManyShareAreLookedAtOnce) {
  constexpr std::size_t many = 3000;
  NodeSets sets;
  NodeSet shared{.name = "shared", .clauses = {}, .of = {}, .compound = true};
  for (std::size_t i = 0; i < many; ++i) {
    const std::string name = std::to_string(i);
    sets.put({.name = name, .clauses = {{"node_id", Ask::any_of, {}, {double(i % 6)}}}, .of = {}});
    sets.put({.name = "with " + name, .clauses = {}, .of = {name, "shared"}, .compound = true});
    shared.of.push_back(name);
  }
  sets.put(shared);
  std::size_t asked = 0;
  NodeTable table = six();
  table.attribute = [&asked, known = table.attribute](std::string_view name) { return ++asked, known(name); };
  KnownSets known;
  for (const NodeSet& set : sets.sets)
    EXPECT_EQ(members(sets, set.name, table, known).size(), set.compound ? 6u : 1u) << set.name;
  EXPECT_EQ(asked, many);
}

TEST(NodeSets, TooDeepIsTheSameInWhateverOrderTheyAreAskedFor) {
  NodeSets sets;
  sets.put({.name = "0", .clauses = {}, .of = {}});
  for (int i = 1; i < 66; ++i)
    sets.put({.name = std::to_string(i), .clauses = {}, .of = {std::to_string(i - 1)}, .compound = true});
  KnownSets known;
  for (int i = 0; i < 64; ++i) EXPECT_EQ(members(sets, std::to_string(i), six(), known).size(), 6u) << i;
  for (const char* deep : {"64", "65"}) {
    const std::string alone = refused(sets, deep);
    EXPECT_THAT(alone, HasSubstr("within one another"));
    EXPECT_EQ(forest::refused<InputError>([&] { members(sets, deep, six(), known); }), alone);
  }
}

TEST(NodeSets, HostileOnesEndWithASentence) {
  NodeSets sets;
  for (int i = 0; i < 5000; ++i)  // a chain
    sets.sets.push_back(
        {.name = std::to_string(i), .clauses = {}, .of = {std::to_string(i + 1)}, .compound = true});
  EXPECT_THAT(refused(sets, "0"), HasSubstr("within one another"));
  sets.sets.clear();
  sets.put({.name = "0", .clauses = {}, .of = {}});
  for (int i = 1; i < 60; ++i)  // 2^60 ways down
    sets.put({.name = std::to_string(i),
              .clauses = {},
              .of = {std::to_string(i - 1), std::to_string(i - 1)},
              .compound = true});
  EXPECT_EQ(members(sets, "59", six()).size(), 6u);
  for (const char* pattern : {"(a", "[", "*", "\\1(a)"}) {
    sets.put({.name = "p", .clauses = {{"mtype", Ask::regex, {pattern}, {}}}, .of = {}});
    EXPECT_THAT(refused(sets, "p"), HasSubstr("pattern")) << pattern;
  }
  sets.put({.name = "slow", .clauses = {{"mtype", Ask::regex, {"(a+)+(a+)+(a+)+$"}, {}}}, .of = {}});
  NodeTable table = six();
  table.attribute = [](std::string_view) {
    return std::optional(Attribute{{std::string(300, 'a') + "b"}, std::vector<std::uint32_t>(6, 0), {}});
  };
  EXPECT_THAT(members(sets, "slow", table), IsEmpty());
  sets.put({.name = "w", .clauses = {{"mtype", Ask::greater, {}, {3}}}, .of = {}});
  EXPECT_THAT(refused(sets, "w"), HasSubstr("it is a word"));
  sets.put({.name = "n", .clauses = {{"y", Ask::regex, {"3"}, {}}}, .of = {}});
  EXPECT_THAT(refused(sets, "n"), HasSubstr("is a number"));
  sets.put({.name = "u", .clauses = {{"mood", Ask::any_of, {"bad"}, {}}}, .of = {}});
  EXPECT_THAT(refused(sets, "u"), HasSubstr("known are layer, mtype"));
}

Members say(std::string_view expression) {
  return evaluate(
      expression,
      [](const std::string& name) -> Members {
        if (name == "L5") return {0, 1, 2, 3};
        if (name == "L5 pyramidal") return {0, 1};
        if (name == "inhibitory") return {1, 3, 5};
        if (name == "this and that") return {5};
        throw Error("unknown " + name);
      },
      6);
}

TEST(Expression, SaysWhatItMeans) {
  EXPECT_THAT(say("L5"), ElementsAre(0, 1, 2, 3));
  EXPECT_THAT(say("L5 and not inhibitory"), ElementsAre(0, 2));
  EXPECT_THAT(say("L5 pyramidal or inhibitory"), ElementsAre(0, 1, 3, 5));
  EXPECT_THAT(say("not L5 or L5 pyramidal and inhibitory"), ElementsAre(1, 4, 5));
  EXPECT_THAT(say("NOT (L5 or inhibitory)"), ElementsAre(4));
  EXPECT_THAT(say("not not L5   pyramidal"), ElementsAre(0, 1));
  EXPECT_THAT(say("'this and that' or (L5 pyramidal)"), ElementsAre(0, 1, 5));
  EXPECT_EQ(union_of("L5 or 'this and that'"), (std::vector<std::string>{"L5", "this and that"}));
  EXPECT_EQ(union_of("L5 and inhibitory"), std::nullopt);
  EXPECT_EQ(union_of("not L5"), std::nullopt);
}

TEST(Expression, WhatIsNoneIsOneSentence) {
  for (const char* wrong : {"", "  ", "and", "L5 and", "L5 or or L5", "(L5", "L5)", "not", "L5 (inhibitory)",
                            "'L5", "()", "L5 and no such name"})
    EXPECT_THROW(say(wrong), Error) << wrong;
  EXPECT_THROW(say(std::string(5000, '(') + "L5"), Error);
  std::string nots;
  for (int i = 0; i < 10000; ++i) nots += "not ";
  EXPECT_EQ(say(nots + "L5").size(), 4u);
  EXPECT_THROW(say(std::string(1'000'000, 'x')), Error);
}

}  // namespace
}  // namespace forest::circuit
