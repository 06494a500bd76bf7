// SPDX-License-Identifier: Apache-2.0
#include "forest/scene/targets.h"

#include <algorithm>
#include <array>
#include <numeric>

#include <fmt/format.h>

#include "forest/core/error.h"

namespace forest::scene {
namespace {

using circuit::Attribute;
using circuit::Members;

std::vector<std::uint32_t> of_types(const Forest& f) { return {f.types().begin(), f.types().end()}; }

template <class Value>
Attribute of_type(const Forest& f, Value value) {
  Attribute a{{}, of_types(f), {}};
  for (const circuit::CellType& type : f.circuit().types) a.words.push_back(value(type));
  return a;
}

Attribute type_name(const Forest& f) {
  return of_type(f, [](const circuit::CellType& t) { return t.name; });
}

template <float frame::Instance::*axis>
Attribute place(const Forest& f) {
  Attribute a;
  for (const frame::Instance& i : f.instances()) a.numbers.push_back(double(i.*axis));
  return a;
}

// What node sets may ask for.
struct Row {
  std::string_view name;
  Attribute (*of)(const Forest&);
};
constexpr std::array<Row, 14> attributes{{
    {"population",
     [](const Forest& f) {
       Attribute a{f.nodes().populations, {}, {}};
       for (const circuit::NodeRun& run : f.nodes().runs)
         a.index.insert(a.index.end(), run.count, run.population);
       return a;
     }},
    {"node_id",
     [](const Forest& f) {
       Attribute a;
       for (const circuit::NodeRun& run : f.nodes().runs)
         for (std::uint64_t i = 0; i < run.count; ++i) a.numbers.push_back(double(run.first_node + i));
       return a;
     }},
    {"layer",
     [](const Forest& f) {
       Attribute a{{}, {f.layers().begin(), f.layers().end()}, {}};
       for (const circuit::Layer& layer : f.circuit().layers) a.words.push_back(layer.name);
       return a;
     }},
    {"mtype", type_name},
    {"pop_name", type_name},
    {"model_name", type_name},
    {"morphology",
     [](const Forest& f) {
       Attribute a{f.circuit().morphologies, {}, {}};
       for (const frame::Instance& i : f.instances()) a.index.push_back(i.morphology);
       return a;
     }},
    {"synapse_class",
     [](const Forest& f) {
       return of_type(f, [](const circuit::CellType& t) {
         return std::string(t.glia ? "GLIA" : t.excitatory ? "EXC" : "INH");
       });
     }},
    {"ei",
     [](const Forest& f) {
       return of_type(f, [](const circuit::CellType& t) {
         return std::string(t.glia ? "none" : t.excitatory ? "e" : "i");
       });
     }},
    {"source_population",
     [](const Forest& f) { return of_type(f, [](const circuit::CellType& t) { return t.population; }); }},
    {"model_type",
     [](const Forest& f) {
       return Attribute{{"biophysical"}, std::vector<std::uint32_t>(f.instances().size()), {}};
     }},
    {"x", place<&frame::Instance::x>},
    {"y", place<&frame::Instance::y>},
    {"z", place<&frame::Instance::z>},
}};

// The names that a forest has by itself: each a word of an attribute.
struct Family {
  std::string_view name, attribute;
};
constexpr std::array<Family, 4> families{
    {{"type", "mtype"}, {"layer", "layer"}, {"population", "population"}, {"sign", "synapse_class"}}};

std::string_view shown_word(std::string_view word) {
  return word == "EXC" ? "excitatory" : word == "INH" ? "inhibitory" : word == "GLIA" ? "glia" : word;
}

Members with_word(const Attribute& a, std::string_view word) {
  std::vector<bool> meant;
  for (const std::string& w : a.words) meant.push_back(shown_word(w) == word);
  Members members;
  for (std::uint32_t i = 0; i < a.index.size(); ++i)
    if (meant[a.index[i]]) members.push_back(i);
  return members;
}

Attribute attribute_of(const Forest& forest, std::string_view name) {
  return std::ranges::find(attributes, name, &Row::name)->of(forest);
}

bool has_word(const Attribute& a, std::string_view word) {
  return std::ranges::find(a.words, word, shown_word) != a.words.end();
}

}  // namespace

circuit::NodeTable node_table(const Forest& forest) {
  std::string known;
  const auto add = [&](std::string_view name) { known += (known.empty() ? "" : ", ") + std::string(name); };
  for (const Row& row : attributes) add(row.name);
  for (const circuit::NodeAttribute& told : forest.nodes().attributes)
    if (std::ranges::find(attributes, told.name, &Row::name) == attributes.end()) add(told.name);
  return {forest.instances().size(),
          [forest](std::string_view name) -> std::optional<Attribute> {
            // What the circuit's files say goes before what we would conclude.
            const auto& told = forest.nodes().attributes;
            if (const auto own = std::ranges::find(told, name, &circuit::NodeAttribute::name);
                own != told.end())
              return own->of;
            const auto row = std::ranges::find(attributes, name, &Row::name);
            return row == attributes.end() ? std::nullopt : std::optional(row->of(forest));
          },
          known};
}

Targets::Targets(Forest forest, circuit::NodeSets sets)
    : forest_(std::move(forest)), table_(node_table(forest_)), sets_(std::move(sets)) {}

void Targets::use(circuit::NodeSets sets) {
  sets_ = std::move(sets);
  known_sets_.clear(), known_.clear();
}

const Members& Targets::find(const std::string& expression) const {
  // A name that is there as it stands, whatever words are in it, is no expression.
  if (sets_.find(expression)) return circuit::members(sets_, expression, table_, known_sets_);
  if (const auto found = known_.find(expression); found != known_.end()) return found->second;
  const bool is_name = std::ranges::any_of(families, [&](const Family& family) {
    return has_word(attribute_of(forest_, family.attribute), expression);
  });
  Members members = is_name ? named(expression)
                            : circuit::evaluate(
                                  expression, [this](const std::string& name) { return named(name); },
                                  forest_.instances().size());
  return known_.emplace(expression, std::move(members)).first->second;
}

Members Targets::named(const std::string& name) const {
  if (sets_.find(name)) return circuit::members(sets_, name, table_, known_sets_);
  if (name.starts_with("set:")) return circuit::members(sets_, name.substr(4), table_, known_sets_);
  if (name == "all" || name == "all:all") {
    Members all(forest_.instances().size());
    std::iota(all.begin(), all.end(), 0u);
    return all;
  }
  std::vector<std::string> meanings;
  std::optional<Members> meant;
  for (const Family& family : families) {
    const std::string prefix = std::string(family.name) + ":";
    const bool said = name.starts_with(prefix);
    const std::string word = said ? name.substr(prefix.size()) : name;
    const Attribute attribute = attribute_of(forest_, family.attribute);
    if (!has_word(attribute, word)) continue;
    Members members = with_word(attribute, word);
    if (said) return members;
    meanings.push_back(prefix + word);
    if (meant && *meant != members)
      throw Error(fmt::format("'{}' may mean {} or {}; say which", name, meanings[0], meanings.back()));
    meant = std::move(members);
  }
  if (!meant)
    throw Error(fmt::format("there is no target '{}' in this forest, which has {}", name, some_names()));
  return *meant;
}

std::string Targets::some_names() const {
  constexpr std::size_t few = 12;
  std::vector<std::string> names;
  for (const circuit::NodeSet& set : sets_.sets) names.push_back(set.name);
  for (const Family& family : families)
    for (const std::string& word : attribute_of(forest_, family.attribute).words)
      if (const std::string shown(shown_word(word)); std::ranges::find(names, shown) == names.end())
        names.push_back(shown);
  names.emplace_back("all");
  const std::size_t more = names.size() > few ? names.size() - few : 0;
  names.resize(names.size() - more);
  return fmt::format("{}{}", fmt::join(names, ", "), more ? fmt::format(" and {} more", more) : "");
}

std::vector<TargetFacts> Targets::list() const {
  std::vector<TargetFacts> facts;
  const auto add = [&](const std::string& name, std::string_view origin, const std::string& asked) {
    TargetFacts f{name, std::string(origin), 0, ""};
    try {
      f.count = find(asked).size();
    } catch (const Error& error) {
      f.problem = error.what();
    }
    facts.push_back(std::move(f));
  };
  for (const circuit::NodeSet& set : sets_.sets) add(set.name, "node set", set.name);
  for (const Family& family : families) {
    const Attribute attribute = attribute_of(forest_, family.attribute);
    std::vector<std::size_t> counts(attribute.words.size());
    for (const std::uint32_t i : attribute.index) ++counts[i];
    std::map<std::string_view, std::size_t> seen;  // two types may be excitatory
    for (std::size_t i = 0; i < counts.size(); ++i) {
      const std::string_view word = shown_word(attribute.words[i]);
      if (const auto [at, first] = seen.try_emplace(word, facts.size()); first)
        facts.push_back({std::string(word), std::string(family.name), counts[i], ""});
      else
        facts[at->second].count += counts[i];
    }
  }
  facts.push_back({"all", "all", forest_.instances().size(), ""});
  return facts;
}

}  // namespace forest::scene
