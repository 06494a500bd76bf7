// SPDX-License-Identifier: Apache-2.0
#include "forest/circuit/toml_node.h"

#include <algorithm>
#include <cstddef>
#include <exception>
#include <sstream>

namespace forest::circuit {
namespace {

// toml11 draws its message over several lines with a picture of the source; the first line holds the reason.
std::string reason(const std::exception& error) {
  std::string text = error.what();
  text.erase(std::min(text.find('\n'), text.size()));
  for (const std::string_view prefix : {"[error] ", "toml::"})
    if (text.starts_with(prefix)) text.erase(0, prefix.size());
  if (const auto colon = text.find(": "); colon != std::string::npos && text.find(' ') > colon)
    text.erase(0, colon + 2);
  return text.empty() ? "it cannot be parsed" : text;
}

// The parser recurses; text that opens brackets without end would exhaust the stack.
void refuse_deep_nesting(std::string_view text, const std::string& file) {
  constexpr int deepest = 64;
  int depth = 0;
  std::size_t line = 1;
  for (const char c : text) {
    if (c == '\n') ++line;
    if (c == '[' || c == '{') ++depth;
    if (c == ']' || c == '}') depth = std::max(0, depth - 1);
    if (depth > deepest) throw InputError(file, line, "brackets are nested too deeply; close them");
  }
}

// Of a text the first byte that belongs to no character of UTF-8 (RFC 3629: shortest forms, no surrogates, up to 10FFFF).
std::size_t valid_utf8(std::string_view text) {
  const auto byte = [&](std::size_t i) { return i < text.size() ? static_cast<unsigned char>(text[i]) : 0u; };
  std::size_t i = 0;
  while (i < text.size()) {
    const unsigned lead = byte(i);
    const std::size_t more = lead < 0x80                    ? 0
                             : lead >= 0xc2 && lead <= 0xdf ? 1
                             : lead >= 0xe0 && lead <= 0xef ? 2
                                                            : 3;
    if (more == 3 && (lead < 0xf0 || lead > 0xf4)) return i;
    const unsigned low = lead == 0xe0   ? 0xa0
                         : lead == 0xf0 ? 0x90
                                        : 0x80,
                   high = lead == 0xed   ? 0x9f
                          : lead == 0xf4 ? 0x8f
                                         : 0xbf;  // of the second byte
    for (std::size_t k = 1; k <= more; ++k)
      if (byte(i + k) < (k == 1 ? low : 0x80) || byte(i + k) > (k == 1 ? high : 0xbf)) return i;
    i += more + 1;
  }
  return i;
}

// The parser, when it tells where a text is not UTF-8, reads beyond it (toml11 3.7, parse_literal_string).
void refuse_other_than_utf8(std::string_view text, const std::string& file) {
  const std::size_t end = valid_utf8(text);
  if (end == text.size()) return;
  const auto line = 1 + std::count(text.begin(), text.begin() + std::ptrdiff_t(end), '\n');
  throw InputError(file, std::size_t(line),
                   "this is not TOML: a byte belongs to no character of UTF-8; save it as UTF-8");
}

}  // namespace

toml::value parse_toml(std::string_view text, const std::string& file) {
  refuse_other_than_utf8(text, file);
  refuse_deep_nesting(text, file);
  try {
    std::istringstream stream{std::string(text)};
    return toml::parse(stream, file);
  } catch (const toml::exception& error) {
    throw InputError(file, error.location().line(), "this is not TOML: " + reason(error) + "; correct it");
  } catch (const std::exception& error) {
    throw InputError(file, 0, "this is not TOML: " + reason(error) + "; correct it");
  }
}

}  // namespace forest::circuit
