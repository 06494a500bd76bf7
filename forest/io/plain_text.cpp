// SPDX-License-Identifier: Apache-2.0
#include "forest/io/plain_text.h"

#include <algorithm>

#include "forest/core/byte_order_mark.h"
#include "forest/core/error.h"

namespace forest::io {

PlainText plain_text(std::string_view bytes, const std::string& name) {
  must_be_plain(bytes, name);
  PlainText result{.text = without_byte_order_mark(bytes)};
  result.byte_order_mark = result.text.size() < bytes.size();
  while (!result.text.empty() && (result.text.back() == '\0' || result.text.back() == '\x1a')) {
    result.padding = true;
    result.text.remove_suffix(1);
  }
  return result;
}

std::string first_element(std::string_view file) {
  std::string bytes(file.substr(0, 1 << 16));
  std::erase(bytes, '\0');
  const std::size_t before = bytes.find_first_not_of(" \t\r\n\xef\xbb\xbf\xff\xfe");
  if (before == bytes.npos || bytes[before] != '<') return {};  // a log that quotes one
  for (std::size_t at = bytes.find('<'); at != bytes.npos; at = bytes.find('<', at)) {
    const std::string_view rest = std::string_view(bytes).substr(at);
    if (rest.starts_with("<!--")) {
      at = std::min(bytes.find("-->", at), bytes.size());
    } else if (rest.starts_with("<?") || rest.starts_with("<!")) {
      ++at;
    } else {
      const std::size_t end = rest.find_first_of(" \t\r\n/>", 1);
      if (end == rest.npos) return {};
      const std::string_view name = rest.substr(1, end - 1);
      return std::string(name.substr(name.find(':') + 1));  // npos + 1 == 0
    }
  }
  return {};
}

}  // namespace forest::io
