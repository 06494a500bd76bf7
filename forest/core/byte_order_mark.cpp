// SPDX-License-Identifier: Apache-2.0
#include "forest/core/byte_order_mark.h"

#include "forest/core/error.h"

namespace forest {

void must_be_plain(std::string_view bytes, const std::string& name) {
  // Of a text that begins without a mark in Latin letters every second byte is zero.
  const auto zero = [&](std::size_t at) { return at < bytes.size() && bytes[at] == '\0'; };
  const bool halves = bytes.size() >= 4 && zero(0) == zero(2) && zero(1) == zero(3) && zero(0) != zero(1);
  if (bytes.starts_with(std::string_view("\xff\xfe\0\0", 4)) ||
      bytes.starts_with(std::string_view("\0\0\xfe\xff", 4)))
    throw InputError(name, 1, "is written in UTF-32; save it as plain text (UTF-8 or ASCII)");
  if (bytes.starts_with("\xff\xfe") || bytes.starts_with("\xfe\xff") || halves)
    throw InputError(name, 1, "is written in UTF-16; save it as plain text (UTF-8 or ASCII)");
}

}  // namespace forest
