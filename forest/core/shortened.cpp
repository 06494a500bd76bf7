// SPDX-License-Identifier: Apache-2.0
#include "forest/core/shortened.h"

#include <algorithm>

namespace forest {
namespace {

bool begins(char c) { return (c & 0xc0) != 0x80; }  // a character of UTF-8

}  // namespace

std::size_t characters(std::string_view text) { return std::size_t(std::ranges::count_if(text, begins)); }

std::string shortened(std::string_view text, std::size_t most) {
  const std::size_t all = characters(text);
  if (all <= most) return std::string(text);
  const std::size_t kept = std::max<std::size_t>(most, 3) - 1, head = kept - kept / 2, tail = kept / 2;
  std::string out;
  std::size_t at = 0;  // of characters
  for (const char c : text) {
    at += begins(c);
    if (at == head + 1 && begins(c)) out += "…";
    if (at <= head || at > all - tail) out += c;
  }
  return out;
}

}  // namespace forest
