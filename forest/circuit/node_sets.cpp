// SPDX-License-Identifier: Apache-2.0
#include "forest/circuit/node_sets.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <numeric>
#include <regex>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "forest/core/distinct.h"
#include "forest/core/error.h"
#include "forest/core/lower.h"
#include "forest/core/number.h"
#include "forest/core/pattern.h"

namespace forest::circuit {
namespace {

constexpr std::size_t deepest = 64;         // sets within sets, parentheses within parentheses
constexpr std::size_t longest_word = 1000;  // characters of it that are searched
constexpr std::size_t longest_expression = 100'000;

Members united(const Members& a, const Members& b) {
  Members result;
  result.reserve(a.size() + b.size());
  std::ranges::set_union(a, b, std::back_inserter(result));
  return result;
}

Members common(const Members& a, const Members& b) {
  Members result;
  std::ranges::set_intersection(a, b, std::back_inserter(result));
  return result;
}

Members all(std::size_t count) {
  Members result(count);
  std::iota(result.begin(), result.end(), 0u);
  return result;
}

// Text for a sentence: one line, not endless.
std::string quoted(std::string_view text) {
  std::string shown = "'";
  for (const char c : text.substr(0, 60)) shown += std::iscntrl(static_cast<unsigned char>(c)) ? '?' : c;
  return shown + (text.size() > 60 ? "…'" : "'");
}

class Resolver {
 public:
  Resolver(const NodeSets& sets, const NodeTable& table, KnownSets& known)
      : sets_(sets), table_(table), known_(known) {}

  const KnownSet& of(std::string_view name) {
    // One that is too deep here is gone down into all the same, to say where.
    if (const auto known = known_.find(name);
        known != known_.end() && path_.size() + known->second.depth <= deepest)
      return known->second;
    const NodeSet* set = sets_.find(name);
    if (!set)
      refuse(path_.empty()
                 ? fmt::format("there is no node set {}", quoted(name))
                 : fmt::format("the node set {} names {}, which is not there; add it or take the name out",
                               quoted(path_.back()), quoted(name)));
    if (const auto before = std::ranges::find(path_, name); before != path_.end()) {
      std::string circle;
      for (auto at = before; at != path_.end(); ++at) circle += quoted(*at) + " → ";
      refuse(fmt::format("node sets name one another in a circle, {}{}; take one of the names out", circle,
                         quoted(name)));
    }
    if (path_.size() >= deepest)
      refuse(fmt::format("more than {} node sets stand within one another, down to {}; name fewer", deepest,
                         quoted(name)));
    path_.push_back(name);
    KnownSet result = set->compound ? of_others(*set) : KnownSet{of_clauses(*set)};
    path_.pop_back();
    return known_.emplace(set->name, std::move(result)).first->second;
  }

 private:
  [[noreturn]] void refuse(const std::string& sentence) const { throw InputError(sets_.source, 0, sentence); }

  KnownSet of_others(const NodeSet& set) {
    KnownSet result;
    Members& nodes = result.members;
    for (const std::string& other : set.of) {
      const KnownSet& more = of(other);
      result.depth = std::max(result.depth, more.depth + 1);
      nodes.insert(nodes.end(), more.members.begin(), more.members.end());
      if (nodes.size() > 2 * table_.count) nodes = distinct(std::move(nodes));
    }
    nodes = distinct(std::move(nodes));
    return result;
  }

  Members of_clauses(const NodeSet& set) const {
    std::vector<bool> inside(table_.count, true);
    for (const Clause& clause : set.clauses) {
      const auto attribute = table_.attribute(clause.attribute);
      if (!attribute)
        refuse(fmt::format("the node set {} asks for {}, which is not known of these neurons; known are {}",
                           quoted(set.name), quoted(clause.attribute), table_.known));
      const std::vector<bool> holds = tested(set, clause, *attribute);
      for (std::size_t i = 0; i < table_.count; ++i) {
        const std::size_t at = attribute->words.empty() ? i : attribute->index[i];
        inside[i] = inside[i] && at != Attribute::unknown && holds[at];
      }
    }
    Members result;
    for (std::uint32_t i = 0; i < table_.count; ++i)
      if (inside[i]) result.push_back(i);
    return result;
  }

  // Of each word, or of each node's number.
  std::vector<bool> tested(const NodeSet& set, const Clause& clause, const Attribute& attribute) const {
    const bool words = !attribute.words.empty();
    std::vector<bool> holds(words ? attribute.words.size() : attribute.numbers.size());
    if (clause.test == Clause::Test::any_of) {
      std::vector<double> numbers = clause.numbers;
      for (const std::string& word : clause.words)
        if (const auto number = number_of<double>(word); number && !words) numbers.push_back(*number);
      std::ranges::sort(numbers);
      for (std::size_t i = 0; i < holds.size(); ++i)
        if (words) {
          const auto number = number_of<double>(attribute.words[i]);
          holds[i] = std::ranges::find(clause.words, attribute.words[i]) != clause.words.end() ||
                     (number && std::ranges::binary_search(numbers, *number));
        } else {
          holds[i] =
              !std::isnan(attribute.numbers[i]) && std::ranges::binary_search(numbers, attribute.numbers[i]);
        }
      return holds;
    }
    if (words != (clause.test == Clause::Test::regex))
      refuse(fmt::format(
          "the node set {} asks of {} {}", quoted(set.name), quoted(clause.attribute),
          words ? "to be a number, but it is a word; give words or \"$regex\""
                : "to meet a pattern, but it is a number; compare it with \"$gt\", \"$gte\", \"$lt\" or "
                  "\"$lte\""));
    if (words) {
      try {
        const std::regex pattern = linear_pattern(clause.words.at(0));
        for (std::size_t i = 0; i < holds.size(); ++i)
          holds[i] = std::regex_search(attribute.words[i].substr(0, longest_word), pattern);
      } catch (const std::regex_error&) {
        refuse(fmt::format("the node set {} has a pattern that cannot be used, {}; correct it",
                           quoted(set.name), quoted(clause.words.at(0))));
      }
      return holds;
    }
    const double limit = clause.numbers.at(0);
    for (std::size_t i = 0; i < holds.size(); ++i) {
      const double value = attribute.numbers[i];
      holds[i] = clause.test == Clause::Test::greater    ? value > limit
                 : clause.test == Clause::Test::less     ? value < limit
                 : clause.test == Clause::Test::at_least ? value >= limit
                                                         : value <= limit;
    }
    return holds;
  }

  const NodeSets& sets_;
  const NodeTable& table_;
  KnownSets& known_;
  std::vector<std::string_view> path_;
};

// Reads an expression: or-terms of and-terms of factors.
class Reader {
 public:
  Reader(std::string_view text, const std::function<Members(const std::string&)>& find, std::size_t count)
      : text_(text), find_(find), count_(count) {
    if (text.size() > longest_expression)
      throw Error(
          fmt::format("an expression of {} characters is too long; define parts of it by name", text.size()));
    next();
  }

  Members whole() {
    Members result = either();
    if (what_ != End) fail("'and' or 'or' is missing before");
    return result;
  }
  bool only_unions() const { return only_unions_; }

 private:
  enum What { End, Name, And, Or, Not, Open, Close };

  [[noreturn]] void fail(const char* sentence) const {
    throw Error(fmt::format("{} is no set of neurons: {} {}", quoted(text_), sentence,
                            what_ == End ? "its end" : quoted(word_)));
  }

  Members either() {
    if (++depth_ > deepest)
      throw Error(fmt::format("{} has too many parentheses within one another", quoted(text_)));
    Members result = both();
    while (what_ == Or) next(), result = united(result, both());
    --depth_;
    return result;
  }
  Members both() {
    Members result = one();
    while (what_ == And) next(), only_unions_ = false, result = common(result, one());
    return result;
  }
  Members one() {
    bool turned = false;
    while (what_ == Not) next(), only_unions_ = false, turned = !turned;
    Members result;
    if (what_ == Open) {
      next();
      result = either();
      if (what_ != Close) fail("')' is missing before");
      next();
    } else if (what_ == Name) {
      result = find_(word_);
      next();
    } else {
      fail("a name is missing before");
    }
    if (!turned) return result;
    Members rest;
    std::ranges::set_difference(all(count_), result, std::back_inserter(rest));
    return rest;
  }

  static bool space(char c) { return std::isspace(static_cast<unsigned char>(c)); }
  static std::optional<What> keyword(std::string_view word) {
    static constexpr std::array<std::pair<std::string_view, What>, 3> words{
        {{"and", And}, {"or", Or}, {"not", Not}}};
    for (const auto& [known, what] : words)
      if (lower(word) == known) return what;
    return std::nullopt;
  }
  std::string_view plain_word(std::size_t at) const {
    std::size_t end = at;
    while (end < text_.size() && !space(text_[end]) && text_[end] != '(' && text_[end] != ')') ++end;
    return text_.substr(at, end - at);
  }
  void skip_space() {
    while (at_ < text_.size() && space(text_[at_])) ++at_;
  }

  void next() {
    skip_space();
    word_.clear();
    if (at_ == text_.size()) {
      what_ = End;
      return;
    }
    const char c = text_[at_];
    if (c == '(' || c == ')') {
      what_ = c == '(' ? Open : Close;
      word_ = c;
      ++at_;
      return;
    }
    if (c == '\'' || c == '"') {
      const std::size_t end = text_.find(c, at_ + 1);
      if (end == std::string_view::npos)
        throw Error(fmt::format("{} has a quote that does not end; close it", quoted(text_)));
      what_ = Name;
      word_ = text_.substr(at_ + 1, end - at_ - 1);
      at_ = end + 1;
      return;
    }
    // Words that follow one another are one name.
    what_ = Name;
    for (std::string_view word; !(word = plain_word(at_)).empty(); skip_space()) {
      if (const auto key = keyword(word)) {
        if (!word_.empty()) break;
        what_ = *key, word_ = word, at_ += word.size();
        return;
      }
      word_ += (word_.empty() ? "" : " ") + std::string(word);
      at_ += word.size();
    }
  }

  std::string_view text_;
  const std::function<Members(const std::string&)>& find_;
  std::size_t count_, at_ = 0, depth_ = 0;
  bool only_unions_ = true;  // so far
  What what_ = End;
  std::string word_;
};

}  // namespace

const NodeSet* NodeSets::find(std::string_view name) const {
  if (places.size() != sets.size()) {
    places.clear();
    for (std::size_t i = 0; i < sets.size(); ++i) places.emplace(sets[i].name, i);
  }
  const auto found = places.find(name);
  return found == places.end() ? nullptr : &sets[found->second];
}

void NodeSets::put(NodeSet set) {
  if (const NodeSet* const there = find(set.name)) {
    sets[std::size_t(there - sets.data())] = std::move(set);
  } else {
    places.emplace(set.name, sets.size());
    sets.push_back(std::move(set));
  }
}

bool NodeSets::remove(std::string_view name) {
  places.clear();
  return std::erase_if(sets, [&](const NodeSet& set) { return set.name == name; }) > 0;
}

Members members(const NodeSets& sets, std::string_view name, const NodeTable& table) {
  KnownSets known;
  return members(sets, name, table, known);
}

const Members& members(const NodeSets& sets, std::string_view name, const NodeTable& table,
                       KnownSets& known) {
  return Resolver(sets, table, known).of(name).members;
}

Members evaluate(std::string_view expression, const std::function<Members(const std::string&)>& find,
                 std::size_t count) {
  return Reader(expression, find, count).whole();
}

std::optional<std::vector<std::string>> union_of(std::string_view expression) {
  std::vector<std::string> names;
  const std::function<Members(const std::string&)> note = [&](const std::string& name) {
    names.push_back(name);
    return Members{};
  };
  Reader reader(expression, note, 0);
  reader.whole();
  return reader.only_unions() ? std::optional(names) : std::nullopt;
}

}  // namespace forest::circuit
