// SPDX-License-Identifier: Apache-2.0
// Words that tracing programs put on a point (how a branch ends, whose colour a tree has) live in a neuron as annotations
// that end in the place of the point, "Incomplete 1.5 0 -3". By the place a writer puts them back.
#pragma once

#include <cstddef>
#include <deque>
#include <string>
#include <string_view>
#include <unordered_map>

#include "forest/io/numbers.h"
#include "forest/morphology/morphology.h"

namespace forest::io {

/// "x y z", of float precision; a zero has no sign.
inline std::string place_text(const Point& p) {
  std::string text;
  append_number(text, p.x + 0.f), text += ' ';
  append_number(text, p.y + 0.f), text += ' ';
  append_number(text, p.z + 0.f);
  return text;
}

class PlacedWords {
 public:
  /// A point that may take a word.
  void offer(const Point& point) { ++places_[place_text(point)].free; }

  /// Lets the word wait for a point offered at this place; false when there is none left.
  bool add(const std::string& place, std::string word) {
    const auto found = places_.find(place);
    if (found == places_.end() || found->second.free == 0) return false;
    --found->second.free, ++waiting_;
    found->second.words.push_back(std::move(word));
    return true;
  }

  /// The next word that waits at this place; empty when none does.
  std::string take(const Point& point) {
    if (waiting_ == 0) return {};
    const auto found = places_.find(place_text(point));
    if (found == places_.end() || found->second.words.empty()) return {};
    std::string word = std::move(found->second.words.front());
    found->second.words.pop_front(), --waiting_;
    return word;
  }

  bool offered() const { return !places_.empty(); }

 private:
  struct Place {
    std::size_t free = 0;
    std::deque<std::string> words;
  };
  std::unordered_map<std::string, Place> places_;
  std::size_t waiting_ = 0;
};

}  // namespace forest::io
