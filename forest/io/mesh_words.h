// SPDX-License-Identifier: Apache-2.0
// Texts of words and numbers, taken from the front. For the readers of meshes: OBJ, PLY and STL.
#pragma once

#include <algorithm>
#include <optional>
#include <string_view>

#include "forest/core/number.h"

namespace forest::io {

inline constexpr std::string_view between_words = " \t\r";

/// The next word of a line, which loses it; empty at its end.
inline std::string_view next_word(std::string_view& line) {
  line.remove_prefix(std::min(line.find_first_not_of(between_words), line.size()));
  const std::string_view word = line.substr(0, line.find_first_of(between_words));
  line.remove_prefix(word.size());
  return word;
}

/// The next line of a text, which loses it with its end.
inline std::string_view next_line(std::string_view& text) {
  const std::string_view line = text.substr(0, text.find('\n'));
  text.remove_prefix(std::min(line.size() + 1, text.size()));
  return line;
}

}  // namespace forest::io
