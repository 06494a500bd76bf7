// SPDX-License-Identifier: Apache-2.0
// Regular expressions of users, who may mean no harm and still write (a+)+.
#pragma once

#include <regex>
#include <string>

namespace forest {

/// An ECMAScript pattern that is searched without backtracking: no word takes longer than its length times the pattern's. It cannot
/// say "what was found before" (\1). Throws std::regex_error, also for patterns of more than 1,000 characters.
inline std::regex linear_pattern(const std::string& text) {
  constexpr std::size_t longest = 1000;
  if (text.size() > longest) throw std::regex_error(std::regex_constants::error_space);
  return std::regex(text, std::regex::ECMAScript | std::regex_constants::__polynomial);
}

}  // namespace forest
