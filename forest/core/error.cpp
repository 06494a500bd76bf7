// SPDX-License-Identifier: Apache-2.0
#include "forest/core/error.h"

#include <algorithm>

#include <fmt/format.h>

namespace forest {
namespace {

std::string place(const std::string& file, std::size_t line) {
  std::string text = file.empty() ? "input" : file;
  if (line) text += ":" + std::to_string(line);
  return text;
}

}  // namespace

InputError::InputError(std::string file, std::size_t line, const std::string& sentence)
    : Error(place(file, line) + ": " + sentence), file_(std::move(file)), line_(line), sentence_(sentence) {}

InputError no_json(std::string_view text, std::size_t byte, const std::string& source,
                   std::string_view remedy) {
  const std::string_view before = text.substr(0, byte ? byte - 1 : 0);
  const std::size_t line = std::size_t(std::ranges::count(before, '\n')) + 1;
  const std::size_t column = before.size() - (before.rfind('\n') + 1) + 1;  // npos + 1 == 0
  return {source, line, fmt::format("is no JSON from column {} on; {}", column, remedy)};
}

}  // namespace forest
