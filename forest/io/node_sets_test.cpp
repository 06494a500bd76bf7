// SPDX-License-Identifier: Apache-2.0
#include "forest/io/node_sets.h"

#include <fstream>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "forest/core/error.h"

#include "tests/real_data.h"
#include "tests/refused.h"

namespace forest::io {
namespace {

using circuit::NodeSets;
using testing::HasSubstr;

constexpr const char* everything = R"({
  "L5": {"layer": ["5", 5]},
  "mix": {"population": "biophysical", "model_type": "point", "node_id": [1, 2, 3]},
  "high": {"y": {"$gt": 3, "$lte": 4.5}, "mtype": {"$regex": "^[s]o \"me\"$"}},
  "nobody": {"node_id": []},
  "all of it": {},
  "both": ["L5", "mix"],
  "nothing": []
})";

TEST(NodeSetsFile, WhatIsWrittenIsReadAgain) {
  const NodeSets sets = parse_node_sets(everything, "sets.json");
  ASSERT_EQ(sets.sets.size(), 7u);
  EXPECT_EQ(sets.sets[2].clauses.size(), 3u);
  EXPECT_TRUE(sets.sets[6].compound);
  EXPECT_FALSE(sets.sets[4].compound);
  const NodeSets again = parse_node_sets(to_json(sets), "sets.json");
  EXPECT_EQ(again.sets, sets.sets);
  EXPECT_EQ(to_json(again), to_json(sets));
  EXPECT_EQ(parse_node_sets("{}", "x").sets.size(), 0u);
  EXPECT_EQ(parse_node_sets(to_json({}), "x").sets.size(), 0u);
}

std::string refused(const std::string& json) {
  return forest::refused<InputError>([&] { parse_node_sets(json, "sets.json"); });
}

TEST(NodeSetsFile, AForestBringsItsOwn) {
  EXPECT_TRUE(node_sets_of({}).sets.empty());
  const NodeSets sets = parse_node_sets(everything, "sets.json");
  EXPECT_EQ(node_sets_of({.populations = {}, .runs = {}, .sets = to_json(sets)}).sets, sets.sets);
  EXPECT_THAT(forest::refused<InputError>([] { node_sets_of({.populations = {}, .runs = {}, .sets = "{"}); }),
              HasSubstr("the forest's own node sets:1: is no JSON"));
}

TEST(NodeSetsFile, WhatIsNoneIsRefusedInOneSentence) {
  EXPECT_THAT(refused("{\n\"a\": {\"layer\": 5},\n oops}"),
              HasSubstr("sets.json:3: is no JSON from column 2 on"));
  const std::pair<const char*, const char*> wrong[] = {
      {"", "is no JSON"},
      {"[]", "one JSON object"},
      {"3", "one JSON object"},
      {R"({"a": 3})", "'a' must be an object"},
      {R"({"a": null})", "'a' must be an object"},
      {R"({"": {}})", "without a name"},
      {R"({"a": ["b", 3]})", "names of other sets"},
      {R"({"a": {"node_id": "b"}})", "'node_id' must be a whole number"},
      {R"({"a": {"node_id": [1, -2]}})", "whole numbers from 0"},
      {R"({"a": {"node_id": 1.5}})", "whole numbers from 0"},
      {R"({"a": {"population": 3}})", "'population' must be a name"},
      {R"({"a": {"layer": null}})", "'layer' must be a word"},
      {R"({"a": {"layer": [["5"]]}})", "'layer' must be a word"},
      {R"({"a": {"layer": {}}})", "asks for nothing"},
      {R"({"a": {"layer": {"$near": 3}}})", "'$near'; known are"},
      {R"({"a": {"y": {"$gt": "3"}}})", "number behind $gt"},
      {R"({"a": {"y": {"$regex": 3}}})", "text behind $regex"},
      {R"({"a": {"layer": 1}, "a": {"layer": 2}})", "has 'a' twice"},
  };
  for (const auto& [json, words] : wrong) EXPECT_THAT(refused(json), HasSubstr(words)) << json;
  EXPECT_THAT(refused("{\"a\": " + std::string(100'000, '[')), HasSubstr("brackets"));
  EXPECT_THAT(refused(std::string((64 << 20) + 1, ' ')),
              HasSubstr("has 64 MB, and node sets are read up to 64"));
  EXPECT_THAT(refused("{\"a\": " + std::string(1000, '[') + std::string(1000, ']') + "}"),
              HasSubstr("brackets"));
}

TEST(NodeSetsFile, CutOffAnywhereItIsRefused) {
  const std::string whole = everything;
  for (std::size_t length = 0; length < whole.size(); ++length)
    EXPECT_THAT(refused(whole.substr(0, length)), HasSubstr("is no JSON")) << length;
}

/// Kept inputs of the fuzzer: each once did harm or leads far into the reader.
TEST(NodeSetsFile, TheFuzzersCorpusIsReadOrRefused) {
  std::size_t read = 0;
  for (const auto& entry : std::filesystem::directory_iterator(FOREST_SOURCE_DIR "/fuzz/corpus/node_sets")) {
    SCOPED_TRACE(entry.path().filename().string());
    try {
      const NodeSets sets = read_node_sets(entry.path());
      EXPECT_EQ(to_json(parse_node_sets(to_json(sets), "again")), to_json(sets));
      ++read;
    } catch (const InputError&) {
    }
  }
  EXPECT_GE(read, 2u);
}

TEST(NodeSetsFile, ThoseOfOtherProgramsAreRead) {
  const auto folder = real_data("sonata");
  if (!folder) GTEST_SKIP() << "real data is not here";
  std::size_t sets = 0;
  for (const char* file :
       {"libsonata_tests/node_sets.json", "snap_tests/node_sets.json", "snap_tests/node_sets_file.json",
        "obi_tiny_circuits/tiny_circuits/nbS1-O1-E2Sst-maxNsyn-HEX0-L5/node_sets.json",
        "allen_sonata_examples/300_cells/node_sets.json"}) {
    const NodeSets read = read_node_sets(*folder / file);
    EXPECT_EQ(parse_node_sets(to_json(read), "again").sets, read.sets) << file;
    sets += read.sets.size();
  }
  EXPECT_GT(sets, 90u);
}

}  // namespace
}  // namespace forest::io
