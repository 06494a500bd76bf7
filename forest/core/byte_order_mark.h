// SPDX-License-Identifier: Apache-2.0
// The three bytes that editors of Windows write before a text in UTF-8; they are none of it.
#pragma once

#include <string_view>

namespace forest {

inline constexpr std::string_view byte_order_mark = "\xef\xbb\xbf";

inline std::string_view without_byte_order_mark(std::string_view text) {
  return text.starts_with(byte_order_mark) ? text.substr(byte_order_mark.size()) : text;
}

}  // namespace forest
