// SPDX-License-Identifier: Apache-2.0
// How one text follows from another, line by line: what a mended file's log needs so that nothing of the original is lost.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

namespace forest::io {

/// A run of lines of the other text, or lines that are not in it.
struct Passage {
  std::size_t first = 0, count = 0;  // lines of `from`, counted from 0; count 0: `text`
  std::string text;                  // with its line ends

  bool operator==(const Passage&) const = default;
};

/// The passages that, one after the other, are `to`. Lines that stand once in both texts are matched in their order
/// (Cohen's patience difference), and grown by equal neighbours; O(n log n).
std::vector<Passage> difference(std::string_view from, std::string_view to);

/// `to`, of `from` and the passages.
std::string rebuilt(std::string_view from, const std::vector<Passage>& passages);

}  // namespace forest::io
