// SPDX-License-Identifier: Apache-2.0
// The answers to ?P, ?H and their like in a word that grows. Where a turtle comes to on its way from the root stays as it
// is once nothing before can change any more; it is remembered there, and the next step is answered from there on, so that a
// step costs what grows in it, not what has grown before. Private to this room.
#pragma once

#include <optional>
#include <vector>

#include "forest/lsystem/growing_word.h"
#include "forest/lsystem/wanderer.h"

namespace forest::lsystem {

class Answers {
 public:
  /// Both must outlive it.
  Answers(const Grammar& grammar, const cortex::Site& site);

  /// A word begins that was not seen before.
  void begin();
  /// Answers all questions of the word that productions could look at. It must be the one of the last call with its active
  /// modules rewritten, or begin() was called since. Throws as interpret() does.
  void fill(GrowingWord& word);
  /// After GrowingWord::compact(), with what it gave.
  void follow(const std::vector<GrowingWord::Place>& now);

 private:
  // Where what a turtle meets may still change; up to here it is settled.
  struct Stand {
    GrowingWord::Place place;
    Stance stance;
  };
  void walk(GrowingWord& word, GrowingWord::Place from);

  const Grammar& grammar_;
  const cortex::Site& site_;
  std::vector<bool> loose_;  // by symbol: a production may come to move the turtle there, or to ask
  bool bodies_ = false;      // a soma may come
  std::optional<Wanderer> wanderer_;
  std::vector<Stand> stands_, before_;
  bool settled_ = false;  // stands_ hold from now on
};

}  // namespace forest::lsystem
