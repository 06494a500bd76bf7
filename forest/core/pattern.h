// SPDX-License-Identifier: Apache-2.0
// Regular expressions of users, who may mean no harm and still write (a+)+.
#pragma once

#include <regex>
#include <string>

namespace forest {

inline constexpr std::size_t longest_pattern = 1000;  // characters

/// An ECMAScript pattern that is searched without backtracking: no word takes longer than its length times the pattern's. It cannot
/// say "what was found before" (\1). Throws std::regex_error, also for longer patterns.
inline std::regex linear_pattern(const std::string& text) {
  if (text.size() > longest_pattern) throw std::regex_error(std::regex_constants::error_space);
  return std::regex(text, std::regex::ECMAScript | std::regex_constants::__polynomial);
}

}  // namespace forest
