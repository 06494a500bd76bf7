// SPDX-License-Identifier: Apache-2.0
// Deviations from a format, gathered while a file is read. A format keeps a table of Oddity rows and an enum
// in the same order; the list tells a few lines of each and counts the rest, so that a long odd file does not
// drown its reader.
#pragma once

#include <algorithm>
#include <array>
#include <concepts>
#include <cstddef>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "forest/io/format.h"

namespace forest::io {

template <class Code>  // an enum that ends in `count`
class OddityList {
 public:
  static constexpr std::size_t told_lines = 20;

  explicit OddityList(std::span<const Oddity> table) : table_(table) {}

  /// @param what  what stands there: a text, or a function that makes it (called only when it is told)
  template <class What>
  void add(Code code, std::size_t line, What&& what) {
    const auto index = static_cast<std::size_t>(code);
    Tally& tally = tallies_[index];
    tally.last_line = std::max(tally.last_line, line);
    if (tally.count++ >= (table_[index].every_line ? told_lines : 1)) return;
    const Oddity& row = table_[index];
    if constexpr (std::invocable<What>)
      warnings_.push_back(
          {line, row.code, fmt::format("{}; {}", what(), row.reading), row.mending, row.lost});
    else
      warnings_.push_back({line, row.code, fmt::format("{}; {}", what, row.reading), row.mending, row.lost});
  }
  bool has(Code code) const { return tallies_[static_cast<std::size_t>(code)].count > 0; }

  /// In the order of lines, with one more warning for each code of which lines were left out.
  std::vector<Warning> take() {
    for (std::size_t i = 0; i < tallies_.size(); ++i)
      if (const Tally& tally = tallies_[i]; table_[i].every_line && tally.count > told_lines)
        warnings_.push_back({tally.last_line, table_[i].code,
                             fmt::format("the same on {} more lines, this the last; {}",
                                         tally.count - told_lines, table_[i].reading),
                             table_[i].mending, table_[i].lost, tally.count - told_lines});
    std::ranges::stable_sort(warnings_, {}, &Warning::line);
    return std::move(warnings_);
  }

 private:
  struct Tally {
    std::size_t count = 0, last_line = 0;
  };
  std::span<const Oddity> table_;
  std::array<Tally, static_cast<std::size_t>(Code::count)> tallies_;
  std::vector<Warning> warnings_;
};

}  // namespace forest::io
