// SPDX-License-Identifier: Apache-2.0
// Names as the repository keeps them. A database wants text in UTF-8; files and their comments hold any
// bytes.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>

namespace forest::repository {

inline constexpr std::size_t max_name = 1100;  // bytes; the longest file name, escaped, is one

/// A name: 1 to max_name bytes of UTF-8 without control characters. Everything else is allowed, quotes and
/// semicolons too.
bool is_name(std::string_view text);

/// How many bytes are well-formed UTF-8 before the first that are not.
std::size_t utf8_bytes(std::string_view text);

/// Bytes as text that can be stored and read by a person: what is no UTF-8 and control characters become
/// \xHH, and a backslash becomes \\ so that nothing is lost.
std::string escaped(std::string_view bytes);
/// The same of a text of many lines: ends of lines, tabs and most backslashes stay as they are.
std::string escaped_lines(std::string_view bytes);
std::string unescaped(std::string_view text);  // the inverse of both

/// A text on one line, to be looked at: an end of a line is ␤, what is no UTF-8 and other control characters are \xHH.
std::string one_line(std::string_view bytes);

/// The start of a long or strange text, to be quoted in a sentence.
std::string shown(std::string_view text);

/// A file name (without folder) that is different for different names: what a file system or shell dislikes
/// becomes %HH, names too long for a file are cut and end on their hash.
std::string file_name(std::string_view name);

}  // namespace forest::repository
