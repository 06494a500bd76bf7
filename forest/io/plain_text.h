// SPDX-License-Identifier: Apache-2.0
// What editors and operating systems put around a text: a mark of its encoding before it, padding behind it.
#pragma once

#include <string>
#include <string_view>

namespace forest::io {

struct PlainText {
  std::string_view text;         // without them; its first line is the file's
  bool byte_order_mark = false;  // EF BB BF stood in front
  bool padding = false;          // zero bytes or Ctrl-Z stood behind, as disks and CP/M fill up files
};

/// Throws InputError when the bytes are UTF-16.
PlainText plain_text(std::string_view bytes, const std::string& name);

/// The name of an XML document's first element, without the prefix of its name space; empty when there is none within
/// the first 64 KiB. UTF-16 is seen through. Declaration, comments and instructions may come before it.
std::string first_element(std::string_view bytes);

}  // namespace forest::io
