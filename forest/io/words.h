// SPDX-License-Identifier: Apache-2.0
// Pieces of a line of text, for readers of what people and programs wrote.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>

namespace forest::io {

constexpr std::string_view blanks = " \t\v\f";      // within a line
constexpr std::string_view xml_blanks = " \t\r\n";  // XML 1.0, section 2.3

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
