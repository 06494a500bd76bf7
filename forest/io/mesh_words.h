// SPDX-License-Identifier: Apache-2.0
// Texts of words and numbers, taken from the front. For the readers of meshes: OBJ, PLY and STL.
#pragma once

#include <algorithm>
#include <charconv>
#include <optional>
#include <string_view>

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

/// The number that a word is, wholly; none otherwise.
template <class Number>
std::optional<Number> number_of(std::string_view word) {
  if (word.starts_with('+')) word.remove_prefix(1);
  Number value{};
  const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), value);
  if (error != std::errc() || end != word.data() + word.size()) return {};
  return value;
}

}  // namespace forest::io
