// SPDX-License-Identifier: Apache-2.0
// Words that are the same in small letters and in large ones.
#pragma once

#include <string>
#include <string_view>

namespace forest {

/// A to Z as small letters, in every country; all else, letters beyond ASCII too, as it is.
inline std::string lower(std::string_view text) {
  std::string result(text);
  for (char& c : result)
    if (c >= 'A' && c <= 'Z') c = char(c - 'A' + 'a');
  return result;
}

}  // namespace forest
