// SPDX-License-Identifier: Apache-2.0
// Only modules that some production rewrites are visited, so that a step costs what it changes, not what has grown before.
// A step first evaluates all successors beside the old word, which contexts still see unchanged, and then links them in.
#include "forest/lsystem/derive.h"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "forest/core/error.h"
#include "forest/lsystem/answers.h"
#include "forest/lsystem/growing_word.h"
#include "forest/lsystem/turtle.h"

namespace forest::lsystem {
namespace {

using Place = GrowingWord::Place;
constexpr Place none = GrowingWord::none;
constexpr std::uint32_t candidate_stream = 0x63616e64;  // "cand"
constexpr auto push_symbol = Symbol(Action::push), pop_symbol = Symbol(Action::pop);

struct Change {
  Place old, begin;
  std::uint32_t count;  // modules of the successor; they lie at begin, none when it stays
};

struct Candidate {
  const Production* production;
  double weight;
};

}  // namespace

struct Deriver::State {
  const Grammar& grammar;
  cortex::Site site;
  GrowingWord growing;
  Answers answers;
  std::vector<Place> active, later;  // modules that productions may rewrite, in the order of the word
  std::vector<Change> changes;
  std::vector<double> slots, stack, cell;
  std::vector<Candidate> candidates;
  std::vector<std::size_t> written;  // modules, by production
  std::vector<Place> seen;           // modules matched by contexts
  Word word;

  State(const Grammar& g, const cortex::Site& where)
      : grammar(g),
        site(where),
        answers(g, site),
        slots(g.slots + 1),
        stack(g.stack + 1),
        cell(g.cell_values),
        written(g.productions.size()) {}

  bool rewritten(Place n) const {
    return growing[n].symbol != GrowingWord::blank && !grammar.productions_of[growing[n].symbol].empty();
  }

  [[noreturn]] void fail(const Production& p, std::string_view what) const {
    throw InputError(grammar.file, p.line, fmt::format("production {} {}", p.id, what));
  }

  // Of the statement in this line.
  double* evaluate(const Program& program, std::size_t line, Random& random) {
    try {
      return run(program, slots.data(), cell, grammar.lookups, random, stack.data());
    } catch (const Error& error) {
      throw InputError(grammar.file, line, error.what());
    }
  }

  // The first of these modules that would have a parameter on the stack that is not a finite number.
  const Shape* unfit(std::span<const Shape> shapes) const {
    const double* value = stack.data();
    for (const Shape& s : shapes)
      for (std::uint16_t i = 0; i < s.count; ++i)
        if (!std::isfinite(*value++)) return &s;
    return nullptr;
  }

  void begin(Random& random, std::uint32_t candidate) {
    growing.clear(), answers.begin(), active.clear();
    std::ranges::fill(written, 0);
    evaluate(grammar.cell, grammar.cell_line, random);
    std::copy_n(slots.begin(), cell.size(), cell.begin());
    for (const Total& t : grammar.totals) cell[t.place] = 0.;
    if (candidate > 0) random = Random(random.seed(), random.item(), candidate_stream + candidate);
    evaluate(grammar.axiom_values, grammar.axiom_line, random);
    if (unfit(grammar.axiom))
      throw InputError(grammar.file, grammar.axiom_line,
                       "the axiom has a parameter that is not a finite number; mend its expression");
    growing.lay(grammar.axiom, stack.data());
    growing.start();
    if (growing.modules() > grammar.limit) runaway();
    for (Place n = growing.begin(); n != none; n = growing[n].next)
      if (rewritten(n)) active.push_back(n);
  }

  bool passed_over(Place n) const {
    return growing[n].symbol == GrowingWord::blank || grammar.ignored[growing[n].symbol];
  }

  // From a bracket to its partner, forwards or backwards.
  Place partner(Place n, Symbol open, Symbol close, Place GrowingWord::Node::*onward) const {
    for (int depth = 0; n != none; n = growing[n].*onward) {
      if (growing[n].symbol == open) ++depth;
      if (growing[n].symbol == close && --depth == 0) return n;
    }
    return none;
  }

  bool fits(Place n, const Shape& s) const {
    return n != none && growing[n].symbol == s.symbol && growing[n].count == s.count;
  }

  // The modules between the root and this one, past the branches that leave on the way.
  bool left_matches(Place n, const std::vector<Shape>& pattern) {
    for (std::size_t i = pattern.size(); i-- > 0;) {
      for (n = growing[n].previous; n != none; n = growing[n].previous) {
        if (growing[n].symbol == pop_symbol) {
          n = partner(n, pop_symbol, push_symbol, &GrowingWord::Node::previous);
          if (n == none) return false;
        } else if (growing[n].symbol != push_symbol && !passed_over(n)) {
          break;
        }
      }
      if (!fits(n, pattern[i])) return false;
      seen[i] = n;
    }
    return true;
  }

  // The modules that follow on this branch; a bracketed part of the pattern is matched with the branch that
  // stands there.
  bool right_matches(Place n, const std::vector<Shape>& pattern, std::size_t offset) {
    const auto onward = [&] {
      do n = growing[n].next;
      while (n != none && passed_over(n));
    };
    onward();
    for (std::size_t i = 0; i < pattern.size(); ++i) {
      const Symbol wanted = pattern[i].symbol;
      if (wanted == pop_symbol) {  // the rest of the branch does not matter
        for (int depth = 1; n != none; n = growing[n].next) {
          if (growing[n].symbol == push_symbol) ++depth;
          if (growing[n].symbol == pop_symbol && --depth == 0) break;
        }
      } else if (wanted != push_symbol) {
        while (n != none && growing[n].symbol == push_symbol) {
          n = partner(n, push_symbol, pop_symbol, &GrowingWord::Node::next);
          if (n != none) onward();
        }
      }
      if (!fits(n, pattern[i])) return false;
      seen[offset + i] = n;
      onward();
    }
    return true;
  }

  // Whether the production fits at the node; then its formal parameters have their values.
  bool matches(const Production& p, std::uint32_t n) {
    if (growing[n].count != p.predecessor.count) return false;
    if (p.left.empty() && p.right.empty()) {
      std::ranges::copy(growing.of(n), slots.begin());
      return true;
    }
    seen.resize(p.left.size() + 1 + p.right.size());
    if (!left_matches(n, p.left) || !right_matches(n, p.right, p.left.size() + 1)) return false;
    seen[p.left.size()] = n;
    auto slot = slots.begin();
    for (const Place s : seen) slot = std::ranges::copy(growing.of(s), slot).out;
    return true;
  }

  bool holds(const Production& p, Random& random) {
    const double value = p.condition.empty() ? 1. : evaluate(p.condition, p.line, random)[-1];
    if (std::isnan(value)) fail(p, "has a condition that is no number; keep its expressions in their domain");
    return value != 0.;
  }

  // The production that rewrites the node; its parameters are in the slots. Null when the node stays as it
  // is.
  const Production* choose(Place n, Random& random) {
    const Production *certain = nullptr, *last = nullptr;
    candidates.clear();
    double total = 0.;
    for (const std::uint32_t index : grammar.productions_of[growing[n].symbol]) {
      const Production& p = grammar.productions[index];
      if ((certain && p.weight.empty()) || !matches(p, n)) continue;
      last = &p;
      if (!holds(p, random)) continue;
      if (p.weight.empty()) {
        certain = &p;
        continue;
      }
      const double weight = evaluate(p.weight, p.line, random)[-1];
      if (!(weight >= 0. && std::isfinite(weight)))
        fail(p, fmt::format("has probability {}; keep it between 0 and 1", weight));
      candidates.push_back({&p, weight});
      total += weight;
    }
    const Production* chosen = certain;
    if (!candidates.empty()) {
      constexpr double rounding = 1e-12;
      double left = random.uniform() * (total > 1. - rounding ? total : 1.);
      const auto c =
          std::ranges::find_if(candidates, [&](const Candidate& one) { return (left -= one.weight) < 0.; });
      if (c != candidates.end()) chosen = c->production;
    }
    if (chosen && chosen != last) matches(*chosen, n);  // its own parameters again
    return chosen;
  }

  // What productions ask of the word as a whole.
  void sum(Random& random) {
    for (const Total& t : grammar.totals) {
      const std::size_t keys = t.key < 0 ? 1 : std::size_t(total_keys);
      std::fill_n(cell.begin() + std::ptrdiff_t(t.place), keys, 0.);
      for (const Place n : active) {
        if (!fits(n, t.module)) continue;
        std::ranges::copy(growing.of(n), slots.begin());
        const double key = t.key < 0 ? 0. : slots[std::size_t(t.key)],
                     value = evaluate(t.value, t.line, random)[-1];
        if (key >= 0. && key < double(keys) && key == std::floor(key))
          cell[t.place + std::size_t(key)] += value;
      }
    }
  }

  void step(Random& random) {
    if (!grammar.totals.empty()) sum(random);
    changes.clear(), later.clear();
    std::size_t will_live = growing.modules();
    for (const Place n : active) {
      const Production* p = choose(n, random);
      if (!p) {
        changes.push_back({n, none, 0});
        continue;
      }
      if (!p->bindings.empty()) evaluate(p->bindings, p->line, random);
      if (!p->values.empty()) evaluate(p->values, p->line, random);
      if (const Shape* odd = unfit(p->successor))
        fail(*p, fmt::format(
                     "gives {} a parameter that is not a finite number; keep its expressions in their domain",
                     grammar.symbols[odd->symbol]));
      const auto count = std::uint32_t(p->successor.size());
      changes.push_back({n, growing.lay(p->successor, stack.data()), count});
      written[std::size_t(p - grammar.productions.data())] += count;
      will_live = will_live + count - 1;
      if (will_live > grammar.limit) runaway();
    }
    for (const Change& c : changes) link(c);
    active.swap(later);
    if (growing.sparse()) compact();
  }

  [[noreturn]] void runaway() const {
    const auto most = std::size_t(std::ranges::max_element(written) - written.begin());
    const Production& p = grammar.productions[most];
    const bool axiom = grammar.axiom.size() > written[most];
    throw LimitError(fmt::format(
        "{}:{}: the word has more than {} modules, most of them written by {}, or raise limit:", grammar.file,
        axiom ? grammar.axiom_line : p.line, grammar.limit,
        axiom ? "the axiom; shorten it"
              : fmt::format("production {}; let it branch less, stop it by a condition", p.id)));
  }

  void link(const Change& c) {
    if (c.begin == none) return later.push_back(c.old);
    growing.replace(c.old, c.begin, c.count);
    Place n = c.old;
    for (std::uint32_t i = 0; i < c.count; ++i, n = growing[n].next)
      if (rewritten(n)) later.push_back(n);
  }

  void compact() {
    const std::vector<Place> now = growing.compact();
    for (Place& n : active) n = now[n];
    answers.follow(now);
  }
};

Deriver::Deriver(const Grammar& grammar, const cortex::Site& site)
    : state_(std::make_unique<State>(grammar, site)) {}
Deriver::~Deriver() = default;
Deriver::Deriver(Deriver&&) noexcept = default;
const cortex::Site& Deriver::site() const { return state_->site; }

const Word& Deriver::derive(std::uint64_t seed, std::uint64_t index, std::optional<int> steps,
                            std::uint32_t candidate) {
  Random random(seed, index);
  state_->begin(random, candidate);
  const int count = steps.value_or(state_->grammar.steps);
  for (int i = 0; i < count && !state_->active.empty(); ++i) {
    if (state_->grammar.queries) state_->answers.fill(state_->growing);
    state_->step(random);
  }
  state_->growing.write(state_->word);
  return state_->word;
}

bool Deriver::full_grown() const { return state_->active.empty(); }

double Deriver::liking(const Morphology& neuron) {
  const Grammar& grammar = state_->grammar;
  const std::vector<double> features = grammar.tasted.measure(neuron);
  Random none(0);
  double sum = 0.;
  for (std::size_t i = 0; i < features.size(); ++i) {
    if (std::isnan(features[i])) continue;
    state_->slots[0] = features[i];
    const double value = state_->evaluate(grammar.tastes[i].value, grammar.tastes[i].line, none)[-1];
    if (!std::isfinite(value))
      throw InputError(
          grammar.file, grammar.tastes[i].line,
          fmt::format("how well {} of {} is liked is not a finite number; keep its expression in its "
                      "domain",
                      grammar.tastes[i].feature, features[i]));
    sum += value;
  }
  return sum;
}

Word derive(const Grammar& grammar, std::uint64_t seed, std::uint64_t index, std::optional<int> steps,
            const cortex::Site& site) {
  return Deriver(grammar, site).derive(seed, index, steps);
}

}  // namespace forest::lsystem
