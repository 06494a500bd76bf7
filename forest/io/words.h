// SPDX-License-Identifier: Apache-2.0
// Pieces of a text, for readers of what people and programs wrote.
#pragma once

#include <algorithm>
#include <charconv>
#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

namespace forest::io {

constexpr std::string_view blanks = " \t\v\f";             // within a line
constexpr std::string_view between_words = " \t\v\f\r\n";  // within a text
constexpr std::string_view xml_blanks = " \t\r\n";         // XML 1.0, section 2.3

/// Calls `visit(line, number)` for each line, ended as on any system; stops where it returns false.
template <class Visit>
void each_line(std::string_view text, Visit visit) {
  for (std::size_t begin = 0, number = 1; begin < text.size(); ++number) {
    const std::size_t end = std::min(text.find_first_of("\r\n", begin), text.size());
    if (!visit(text.substr(begin, end - begin), number)) return;
    begin = end + (text.substr(end, 2) == "\r\n" ? 2 : 1);
  }
}

/// The next line of a text, which loses it with its end, a line feed.
inline std::string_view next_line(std::string_view& text) {
  const std::string_view line = text.substr(0, text.find('\n'));
  text.remove_prefix(std::min(line.size() + 1, text.size()));
  return line;
}

/// The next word of a text, which loses it; empty at its end.
inline std::string_view next_word(std::string_view& text, std::string_view between = between_words) {
  text.remove_prefix(std::min(text.find_first_not_of(between), text.size()));
  const std::string_view word = text.substr(0, text.find_first_of(between));
  text.remove_prefix(word.size());
  return word;
}

inline std::vector<std::string_view> words_of(std::string_view text,
                                              std::string_view between = between_words) {
  std::vector<std::string_view> words;
  for (auto word = next_word(text, between); !word.empty(); word = next_word(text, between))
    words.push_back(word);
  return words;
}

/// Whether a text is a word that is given in small letters; its own may be either.
inline bool same_word(std::string_view text, std::string_view lower) {
  return std::ranges::equal(text, lower,
                            [](char a, char b) { return (a >= 'A' && a <= 'Z' ? a - 'A' + 'a' : a) == b; });
}

/// With the bytes that are written %hh; other % are left.
inline std::string percent_decoded(std::string_view text) {
  std::string result;
  for (std::size_t i = 0; i < text.size(); ++i) {
    unsigned value = 0;
    if (text[i] == '%' && i + 2 < text.size() &&
        std::from_chars(text.data() + i + 1, text.data() + i + 3, value, 16).ptr == text.data() + i + 3) {
      result += char(value);
      i += 2;
    } else {
      result += text[i];
    }
  }
  return result;
}

/// Without what stands around it.
inline std::string_view trimmed(std::string_view text, std::string_view around = blanks) {
  const auto first = text.find_first_not_of(around);
  return first == text.npos ? std::string_view{}
                            : text.substr(first, text.find_last_not_of(around) - first + 1);
}

/// For a message: at most so many characters, only printable ASCII.
inline std::string shown(std::string_view text, std::size_t most = 40) {
  std::string result(text.substr(0, most));
  for (char& c : result) c = c < ' ' || c > '~' ? '?' : c;
  return text.size() > most ? result + "…" : result;
}

}  // namespace forest::io
