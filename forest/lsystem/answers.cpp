// SPDX-License-Identifier: Apache-2.0
#include "forest/lsystem/answers.h"

#include <algorithm>
#include <limits>

#include "forest/lsystem/turtle.h"

namespace forest::lsystem {
namespace {

using Place = GrowingWord::Place;

bool is_turtles(const Grammar& grammar, Symbol s) { return grammar.drawn_as[s] < turtle_symbols().size(); }

// Symbols whose modules some productions rewrite, at last into what is the turtle's.
std::vector<bool> loose_symbols(const Grammar& grammar) {
  std::vector<bool> loose(grammar.symbols.size());
  for (bool more = true; more;) {
    more = false;
    for (const Production& p : grammar.productions) {
      const Symbol s = p.predecessor.symbol;
      if (loose[s]) continue;
      loose[s] = is_turtles(grammar, s) || std::ranges::any_of(p.successor, [&](const Shape& one) {
                   return loose[one.symbol] || is_turtles(grammar, one.symbol);
                 });
      more |= loose[s];
    }
  }
  return loose;
}

bool may_have_soma(const Grammar& grammar) {
  const auto has_soma = [&](const std::vector<Shape>& word) {
    return std::ranges::any_of(word, [&](const Shape& s) {
      return is_turtles(grammar, s.symbol) &&
             turtle_symbols()[grammar.drawn_as[s.symbol]].action == Action::soma;
    });
  };
  return has_soma(grammar.axiom) ||
         std::ranges::any_of(grammar.productions, [&](const Production& p) { return has_soma(p.successor); });
}

}  // namespace

Answers::Answers(const Grammar& grammar, const cortex::Site& site)
    : grammar_(grammar), site_(site), loose_(loose_symbols(grammar)), bodies_(may_have_soma(grammar)) {}

void Answers::begin() {
  stands_.clear();
  settled_ = false;
}

void Answers::fill(GrowingWord& word) {
  before_.clear();
  before_.swap(stands_);
  if (settled_) {
    for (const Stand& stand : before_) {
      wanderer_->return_to(stand.stance);
      walk(word, stand.place);
    }
    return;
  }
  wanderer_.emplace(grammar_, site_);
  walk(word, word.begin());
}

// To the end of the branch. Whatever follows a loose module there is answered anew in the next step; branches that leave
// before it keep what they have, and have stands of their own.
void Answers::walk(GrowingWord& word, Place n) {
  constexpr int nowhere = std::numeric_limits<int>::max();
  int depth = 0, loose = nowhere;  // the depth of a branch whose rest is loose
  for (; n != GrowingWord::none; n = word[n].next) {
    const Symbol symbol = word[n].symbol;
    if (symbol == GrowingWord::blank) continue;
    if (loose == nowhere && loose_[symbol]) {
      // Places are counted from a soma, also by those who stand before it: until it is there none is kept.
      if (stands_.empty() && !settled_) settled_ = !bodies_ || wanderer_->has_soma();
      stands_.push_back({n, wanderer_->stance()});
      loose = depth;
    }
    if (symbol == Symbol(Action::push)) ++depth;
    if (symbol == Symbol(Action::pop)) {
      if (depth == 0) return;
      if (--depth < loose) loose = nowhere;
    }
    wanderer_->act(symbol, word.of(n));
  }
}

void Answers::follow(const std::vector<Place>& now) {
  for (Stand& stand : stands_) stand.place = now[stand.place];
  std::erase_if(stands_, [](const Stand& stand) { return stand.place == GrowingWord::none; });
}

}  // namespace forest::lsystem
