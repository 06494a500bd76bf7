// SPDX-License-Identifier: Apache-2.0
#include "forest/io/comments.h"

#include <algorithm>

#include <fmt/format.h>

namespace forest::io {

std::string comment_lines(const Annotations& annotations, std::string_view mark) {
  std::string text;
  for (const auto& [key, value] : annotations) {
    std::string line = key == "comment" ? value : key + ' ' + value;
    for (char& c : line) c = c >= ' ' && c <= '~' ? c : c == '\n' || c == '\r' || c == '\t' ? ' ' : '?';
    line.resize(std::min<std::size_t>(line.size(), 500));
    text += fmt::format("{} {}\n", mark, line);
  }
  return text;
}

}  // namespace forest::io
