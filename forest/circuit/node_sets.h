// SPDX-License-Identifier: Apache-2.0
// Named sets of planted neurons, as SONATA's node sets have them (Dai et al. 2020; libsonata adds comparisons and regular
// expressions), and what people say of sets: "L5 and not inhibitory". At rest they are a JSON file (io/node_sets.h).
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace forest::circuit {

/// Instances of a circuit: their indices, ascending, each once.
using Members = std::vector<std::uint32_t>;

/// One thing that a node set asks of a node.
struct Clause {
  enum class Test : std::uint8_t { any_of, regex, greater, less, at_least, at_most };

  std::string attribute;  // "layer", "population", "node_id", …
  Test test = Test::any_of;
  std::vector<std::string>
      words;  // any_of: one of these or of the numbers; regex: one pattern, met anywhere in the word
  std::vector<double> numbers;  // any_of; the comparisons have one

  bool operator==(const Clause&) const = default;
};

/// The nodes for which every clause holds, without clauses all of them; or the union of other sets.
struct NodeSet {
  std::string name;
  std::vector<Clause> clauses;
  std::vector<std::string> of;  // names of other sets
  bool compound = false;        // whether `of` counts

  bool operator==(const NodeSet&) const = default;
};

struct NodeSets {
  std::string source = "node sets";  // the file, for errors
  std::vector<NodeSet> sets;

  const NodeSet* find(std::string_view name) const;  // null: not there; of two the first
  /// Adds a set, or replaces that of its name.
  void put(NodeSet set);
  bool remove(std::string_view name);  // whether it was there

  /// Where find() found each name: there may be a hundred thousand. It sees by their number that sets were added otherwise.
  mutable std::map<std::string, std::size_t, std::less<>> places{};
};

/// What is known of each node by one name: a word (by its index in `words`) or a number.
struct Attribute {
  static constexpr std::uint32_t unknown = 0xffffffffu;

  std::vector<std::string> words;
  std::vector<std::uint32_t> index;  // of each node, when there are words; unknown: it has none
  std::vector<double> numbers;       // of each node, when there are none; NaN: it has none
};

/// What node sets are resolved against.
struct NodeTable {
  std::size_t count = 0;                                                // nodes
  std::function<std::optional<Attribute>(std::string_view)> attribute;  // none: not known
  std::string known;                                                    // their names, for errors
};

/// Sets whose nodes are known, by their names: of the same sets and the same table.
struct KnownSet {
  Members members;
  std::size_t depth = 1;  // sets within one another in it
};
using KnownSets = std::map<std::string, KnownSet, std::less<>>;

/// The nodes of a set. A word and a number are equal when they read the same: the layer "2" is 2.
/// Throws InputError (the source, one sentence): no such set, a circle of sets or 64 within one another, an attribute that
/// the table lacks, a comparison of words or a pattern for numbers, a pattern that is none.
Members members(const NodeSets& sets, std::string_view name, const NodeTable& table);
/// The same for who asks for many: a set that is `known` is not looked for again, and what is met on the way is kept there.
const Members& members(const NodeSets& sets, std::string_view name, const NodeTable& table, KnownSets& known);

/// Runs of nodes that follow one another, as SONATA numbers them in their population.
struct NodeRun {
  std::uint32_t population = 0;      // index in a list of names
  std::uint32_t first_instance = 0;  // of the run
  std::uint64_t first_node = 0;
  std::uint32_t count = 0;

  bool operator==(const NodeRun&) const = default;
};
/// Something that a circuit's files tell of its nodes, by the name that they use.
struct NodeAttribute {
  std::string name;
  Attribute of;  // all instances
};
/// What SONATA calls the instances of a circuit, and sets of them.
struct NodeNames {
  std::vector<std::string> populations;
  std::vector<NodeRun> runs;  // of all instances, in their order
  std::string sets{};  // the circuit's node sets, a JSON text as io/node_sets.h writes it; may be empty
  std::vector<NodeAttribute> attributes{};  // what else is known of them, each name once
};

/// Members of an expression: names joined by "and", "or", "not" and parentheses; "and" binds tighter than "or". A name may
/// have spaces; one that holds such a word or a parenthesis stands in quotes, 'so' or "so".
/// @param find   what a name means; may throw
/// @param count  of all instances, for "not"
/// Throws Error with one sentence.
Members evaluate(std::string_view expression, const std::function<Members(const std::string&)>& find,
                 std::size_t count);

/// An expression that is a union of plain names: those names; none for any other.
std::optional<std::vector<std::string>> union_of(std::string_view expression);

}  // namespace forest::circuit
