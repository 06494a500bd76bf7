// SPDX-License-Identifier: Apache-2.0
// How a text is encoded, as its first bytes tell: the three that editors of Windows write before one in UTF-8 are none of it, and
// what has two or four bytes a letter is no text that we read.
#pragma once

#include <string>
#include <string_view>

namespace forest {

inline constexpr std::string_view byte_order_mark = "\xef\xbb\xbf";

inline std::string_view without_byte_order_mark(std::string_view text) {
  return text.starts_with(byte_order_mark) ? text.substr(byte_order_mark.size()) : text;
}

/// Throws InputError when the bytes are UTF-16 or UTF-32.
/// @param name  of the file
void must_be_plain(std::string_view bytes, const std::string& name);

}  // namespace forest
