// SPDX-License-Identifier: Apache-2.0
#include "forest/repository/insert.h"

namespace forest::repository {

std::size_t Insert::run(std::size_t count) {
  if (count == 0) return 0;
  if (!statement_) statement_ = database_->prepare_insert(table_, columns_);
  return statement_->run(count);
}

std::string hexadecimal(const std::string& bytes) {
  constexpr char digits[] = "0123456789abcdef";
  std::string text(2 * bytes.size(), '0');
  for (std::size_t i = 0; i < bytes.size(); ++i) {
    const auto byte = static_cast<unsigned char>(bytes[i]);
    text[2 * i] = digits[byte >> 4], text[2 * i + 1] = digits[byte & 15];
  }
  return text;
}

std::string from_hexadecimal(const std::string& text) {
  const auto digit = [](char c) { return c <= '9' ? c - '0' : (c | 32) - 'a' + 10; };
  std::string bytes(text.size() / 2, '\0');
  for (std::size_t i = 0; i < bytes.size(); ++i)
    bytes[i] = char(digit(text[2 * i]) << 4 | digit(text[2 * i + 1]));
  return bytes;
}

}  // namespace forest::repository
