// SPDX-License-Identifier: Apache-2.0
// A word while it grows: a doubly linked list of modules in an arena, so that rewriting one costs what is written, however
// long the word is. Private to this room.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "forest/lsystem/grammar.h"

namespace forest::lsystem {

class GrowingWord {
 public:
  using Place = std::uint32_t;  // of a module; it stays when others are rewritten, until compact()
  static constexpr Place none = 0xffffffffu;
  static constexpr Symbol blank = 0xffff;  // where a module has vanished

  struct Node {
    Symbol symbol = blank;
    std::uint16_t count = 0;
    std::uint32_t first = 0;  // parameter
    Place previous = none, next = none;
  };

  void clear() { nodes_.clear(), parameters_.clear(), live_ = 0; }
  std::size_t modules() const { return live_; }  // but blanks
  Place begin() const { return nodes_.empty() ? none : 0; }
  const Node& operator[](Place n) const { return nodes_[n]; }
  std::span<double> of(Place n) { return std::span(parameters_).subspan(nodes_[n].first, nodes_[n].count); }

  /// Lays modules with these parameters beside the word, where it does not show them yet.
  /// @return the place of the first
  Place lay(std::span<const Shape> shapes, const double* values);
  /// Makes what was laid last the word.
  void start();
  /// Puts `count` modules laid at `begin` where this one is: the first is in its place then. With none it is blank.
  void replace(Place old, Place begin, std::uint32_t count);

  void write(Word& word) const;

  /// Whether much of the arena is of what the word no longer holds.
  bool sparse() const { return nodes_.size() > 100'000 && nodes_.size() > 4 * live_; }
  /// Drops it, and all blanks.
  /// @return where the modules of all places are now; of a blank the next that is not, none at the end
  std::vector<Place> compact();

 private:
  std::vector<Node> nodes_;
  std::vector<double> parameters_;
  std::size_t live_ = 0;
};

}  // namespace forest::lsystem
