// SPDX-License-Identifier: Apache-2.0
#include "forest/repository/names.h"

#include <cstdint>
#include <span>

#include <fmt/format.h>

#include "forest/core/hash.h"

namespace forest::repository {
namespace {

using Byte = unsigned char;

/// Length in bytes of the well-formed UTF-8 character that `text` begins with (RFC 3629, section 4); 0 when
/// there is none.
std::size_t character(std::string_view text) {
  const auto at = [&](std::size_t i) { return i < text.size() ? Byte(text[i]) : Byte(0); };
  const Byte first = at(0);
  const std::size_t length = first < 0x80   ? 1
                             : first < 0xc2 ? 0
                             : first < 0xe0 ? 2
                             : first < 0xf0 ? 3
                             : first < 0xf5 ? 4
                                            : 0;
  for (std::size_t i = 1; i < length; ++i)
    if ((at(i) & 0xc0) != 0x80) return 0;
  const Byte second = at(1);  // too long for its value, a surrogate, or beyond U+10FFFF
  if ((first == 0xe0 && second < 0xa0) || (first == 0xed && second > 0x9f) ||
      (first == 0xf0 && second < 0x90) || (first == 0xf4 && second > 0x8f))
    return 0;
  return text.empty() ? 0 : length;
}

/// C0, delete, and C1 (which UTF-8 writes as C2 80 … C2 9F).
bool is_control(std::string_view character) {
  const Byte first = Byte(character[0]);
  return first < 0x20 || first == 0x7f || (first == 0xc2 && Byte(character[1]) < 0xa0);
}

/// Copies `bytes`; what `keep` refuses, or is no UTF-8, is written byte by byte as `mark` and two hexadecimal
/// digits.
template <class Keep>
std::string replaced(std::string_view bytes, const char* mark, Keep keep) {
  std::string text;
  text.reserve(bytes.size());
  while (!bytes.empty()) {
    const std::size_t length = character(bytes);
    const std::string_view next = bytes.substr(0, length ? length : 1);
    if (length && keep(next))
      text += next;
    else
      for (const char c : next) text += fmt::format("{}{:02X}", mark, Byte(c));
    bytes.remove_prefix(next.size());
  }
  return text;
}

int hex(char c) { return c >= '0' && c <= '9' ? c - '0' : c >= 'A' && c <= 'F' ? c - 'A' + 10 : -1; }

}  // namespace

bool is_name(std::string_view text) {
  if (text.empty() || text.size() > max_name) return false;
  for (std::size_t length; !text.empty(); text.remove_prefix(length)) {
    length = character(text);
    if (!length || is_control(text)) return false;
  }
  return true;
}

std::size_t utf8_bytes(std::string_view text) {
  std::size_t at = 0;
  while (const std::size_t length = character(text.substr(at))) at += length;
  return at;
}

std::string escaped(std::string_view bytes) {
  std::string doubled;
  for (const char c : bytes) doubled.append(c == '\\' ? 2 : 1, c);
  return replaced(doubled, "\\x", [](std::string_view c) { return !is_control(c); });
}

std::string escaped_lines(std::string_view bytes) {
  const auto kept = [](std::string_view c) { return !is_control(c) || c == "\n" || c == "\r" || c == "\t"; };
  std::string doubled;  // only the backslashes that would be read as the mark of something
  for (std::size_t i = 0; i < bytes.size(); ++i) {
    doubled += bytes[i];
    const std::string_view next = bytes.substr(i + 1);
    if (bytes[i] != '\\' || next.empty()) continue;
    const std::size_t length = character(next);
    if (next[0] == '\\' || next[0] == 'x' || !length || !kept(next.substr(0, length))) doubled += '\\';
  }
  return replaced(doubled, "\\x", kept);
}

std::string unescaped(std::string_view text) {
  std::string bytes;
  bytes.reserve(text.size());
  for (std::size_t i = 0; i < text.size(); ++i) {
    const bool mark = text[i] == '\\';
    if (mark && i + 3 < text.size() && text[i + 1] == 'x' && hex(text[i + 2]) >= 0 && hex(text[i + 3]) >= 0) {
      bytes += char(hex(text[i + 2]) * 16 + hex(text[i + 3]));
      i += 3;
    } else {
      bytes += text[i];
      if (mark && i + 1 < text.size() && text[i + 1] == '\\') ++i;
    }
  }
  return bytes;
}

std::string one_line(std::string_view bytes) {
  std::string line;
  for (std::size_t i = 0; i < bytes.size(); ++i)
    if (bytes[i] == '\n')
      line += "␤";
    else if (bytes.substr(i, 2) != "\r\n")
      line += bytes[i];
  return replaced(line, "\\x", [](std::string_view c) { return !is_control(c); });
}

std::string shown(std::string_view text) {
  const bool cut = text.size() > 80;
  return "'" + escaped(text.substr(0, 80)) + (cut ? "…'" : "'");
}

std::string file_name(std::string_view name) {
  std::string file = replaced(name, "%", [](std::string_view c) {
    return !is_control(c) && std::string_view("/\\%*?\"<>|:").find(c) == std::string_view::npos;
  });
  if (file.starts_with('.') || file.starts_with('-')) file.replace(0, 1, file[0] == '.' ? "%2E" : "%2D");
  if (file.empty()) file = "%";
  if (file.size() > 200) {  // most file systems end at 255 bytes, and an extension is to follow
    std::size_t end = 160;
    while ((Byte(file[end]) & 0xc0) == 0x80) --end;
    file = file.substr(0, end) + "%" + hash_hex(std::as_bytes(std::span(name)));
  }
  return file;
}

}  // namespace forest::repository
