// SPDX-License-Identifier: Apache-2.0
// What hangs together (disjoint sets: Galler & Fischer 1964, with the halved paths of van Leeuwen & van der Weide 1977).
#pragma once

#include <cstdint>
#include <numeric>
#include <vector>

namespace forest {

/// Numbers from 0, each a set of its own until it is joined to others.
class Unions {
 public:
  explicit Unions(std::size_t count) : parent_(count) { std::iota(parent_.begin(), parent_.end(), 0u); }

  /// The number that stands for the set: the same for all of it.
  std::uint32_t root(std::uint32_t i) {
    while (parent_[i] != i) i = parent_[i] = parent_[parent_[i]];
    return i;
  }
  /// One set of two; the root of the first stands for it.
  void join(std::uint32_t into, std::uint32_t from) { parent_[root(from)] = root(into); }

 private:
  std::vector<std::uint32_t> parent_;
};

}  // namespace forest
