// SPDX-License-Identifier: Apache-2.0
#include "forest/io/node_sets.h"

#include <algorithm>
#include <array>
#include <cmath>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "forest/core/error.h"
#include "forest/core/file.h"
#include "forest/core/json.h"

namespace forest::io {
namespace {

using Json = nlohmann::ordered_json;
using circuit::Clause;
using circuit::NodeSet;
using circuit::NodeSets;
using Test = Clause::Test;

constexpr std::array<std::pair<std::string_view, Test>, 5> operators{{{"$regex", Test::regex},
                                                                      {"$gt", Test::greater},
                                                                      {"$lt", Test::less},
                                                                      {"$gte", Test::at_least},
                                                                      {"$lte", Test::at_most}}};

// What was read: objects as they stand in the text, member behind member. check_json() has seen that no key stands twice, so
// that none need be looked for, which with a hundred thousand sets takes minutes.
template <class Key, class T, class Less, class Allocator>
struct Listed : nlohmann::ordered_map<Key, T, Less, Allocator> {
  using nlohmann::ordered_map<Key, T, Less, Allocator>::ordered_map;
  T& operator[](const Key& key) {
    this->emplace_back(key, T{});
    return this->back().second;
  }
};
using Read = nlohmann::basic_json<Listed>;

constexpr JsonLimits limits{.deepest = 8,  // node sets have three brackets within one another
                            .most_members = std::size_t(-1),
                            .keys_once = true};  // one that is used twice would quietly win or lose
constexpr std::size_t most_bytes = 64
                                   << 20;  // some eight million neurons one by one; a mistake is often larger

struct Place {
  const std::string& source;
  std::string_view set;

  [[noreturn]] void refuse(std::string_view attribute, std::string_view sentence) const {
    throw InputError(source, 0, fmt::format("in the node set '{}', '{}' {}", set, attribute, sentence));
  }
};

void add_value(const Place& place, const std::string& attribute, const Read& value, Clause& clause) {
  if (value.is_string() && attribute != "node_id")
    clause.words.push_back(value.get<std::string>());
  else if (value.is_number() && attribute != "population") {
    const double number = value.get<double>();
    if (attribute == "node_id" && !(number >= 0. && number == std::floor(number)))
      place.refuse(attribute, "must hold whole numbers from 0 on");
    clause.numbers.push_back(number);
  } else if (value.is_boolean() && attribute != "node_id" && attribute != "population") {
    clause.words.push_back(value.get<bool>() ? "true" : "false");
  } else {
    place.refuse(attribute, attribute == "node_id" ? "must be a whole number or a list of them"
                            : attribute == "population"
                                ? "must be a name or a list of names"
                                : "must be a word, a number, a list of them or a comparison as "
                                  "{\"$gt\": 3}");
  }
}

void add_clauses(const Place& place, const std::string& attribute, const Read& value, NodeSet& set) {
  if (!value.is_object()) {
    Clause clause{.attribute = attribute, .test = Test::any_of, .words = {}, .numbers = {}};
    if (value.is_array())
      for (const Read& one : value) add_value(place, attribute, one, clause);
    else
      add_value(place, attribute, value, clause);
    set.clauses.push_back(std::move(clause));
    return;
  }
  if (value.empty())
    place.refuse(attribute, "asks for nothing; give a value or a comparison as {\"$gt\": 3}");
  for (const auto& [word, limit] : value.items()) {
    const auto known = std::ranges::find(operators, word, [](const auto& o) { return std::string(o.first); });
    if (known == operators.end())
      place.refuse(attribute,
                   fmt::format("is compared by '{}'; known are $regex, $gt, $gte, $lt and $lte", word));
    const bool pattern = known->second == Test::regex;
    if (pattern ? !limit.is_string() : !limit.is_number())
      place.refuse(attribute, fmt::format("must have a {} behind {}", pattern ? "text" : "number", word));
    Clause clause{.attribute = attribute, .test = known->second, .words = {}, .numbers = {}};
    if (pattern)
      clause.words.push_back(limit.get<std::string>());
    else
      clause.numbers.push_back(limit.get<double>());
    set.clauses.push_back(std::move(clause));
  }
}

NodeSet set_of(const std::string& source, const std::string& name, const Read& rule) {
  NodeSet set{.name = name, .clauses = {}, .of = {}};
  const Place place{source, name};
  if (rule.is_array()) {
    set.compound = true;
    for (const Read& other : rule) {
      if (!other.is_string())
        throw InputError(source, 0,
                         fmt::format("the node set '{}' must list names of other sets only", name));
      set.of.push_back(other.get<std::string>());
    }
  } else if (rule.is_object()) {
    for (const auto& [attribute, value] : rule.items()) add_clauses(place, attribute, value, set);
  } else {
    throw InputError(
        source, 0, fmt::format("the node set '{}' must be an object of attributes or a list of names", name));
  }
  return set;
}

Read parsed(std::string_view text, const std::string& source) {
  if (text.size() > most_bytes)
    throw InputError(
        source, 0,
        fmt::format("has {} MB, and node sets are read up to {}; name a file of node sets, or ask "
                    "for attributes instead of single neurons",
                    text.size() >> 20, most_bytes >> 20));
  return parse_json<Read>(text, source, "correct it as docs/scene/targets.md shows", limits);
}

Json json_of(const NodeSet& set) {
  if (set.compound) return Json(set.of);
  Json rule = Json::object();
  for (const Clause& clause : set.clauses) {
    Json& value = rule[clause.attribute];
    if (clause.test == Test::any_of) {
      value = Json::array();
      for (const std::string& word : clause.words) value.push_back(word);
      for (const double number : clause.numbers)
        value.push_back(number == std::floor(number) && std::abs(number) < 9e15 ? Json(std::int64_t(number))
                                                                                : Json(number));
      if (value.size() == 1) value = Json(value[0]);
    } else {
      const auto word =
          std::ranges::find(operators, clause.test, [](const auto& o) { return o.second; })->first;
      value[std::string(word)] =
          clause.test == Test::regex ? Json(clause.words.at(0)) : Json(clause.numbers.at(0));
    }
  }
  return rule;
}

}  // namespace

NodeSets parse_node_sets(std::string_view text, const std::string& name) {
  const Read json = parsed(text, name);
  if (!json.is_object())
    throw InputError(name, 0,
                     "must be one JSON object with a node set behind each name; see docs/scene/targets.md");
  NodeSets sets{.source = name, .sets = {}};
  sets.sets.reserve(json.size());
  for (const auto& [key, rule] : json.items()) {
    if (key.empty()) throw InputError(name, 0, "has a node set without a name; name it");
    sets.sets.push_back(set_of(name, key, rule));
  }
  return sets;
}

NodeSets read_node_sets(const std::filesystem::path& file) {
  const MappedFile mapped(file);
  return parse_node_sets(mapped.text(), file.string());
}

NodeSets node_sets_of(const circuit::NodeNames& nodes) {
  return nodes.sets.empty() ? NodeSets{} : parse_node_sets(nodes.sets, "the forest's own node sets");
}

NodeSet parse_node_set(std::string_view json, const std::string& name) {
  return set_of(name, name, parsed(json, name));
}

std::string to_json(const NodeSets& sets) {
  std::string text = "{";
  for (const NodeSet& set : sets.sets)
    text += fmt::format("{}\n  {}: {}", &set == sets.sets.data() ? "" : ",",
                        Json(set.name).dump(-1, ' ', false, Json::error_handler_t::replace),
                        json_of(set).dump(-1, ' ', false, Json::error_handler_t::replace));
  return text + "\n}\n";
}

}  // namespace forest::io
