// SPDX-License-Identifier: Apache-2.0
// TOML that people write, read key by key; every complaint names its line. Of this room alone.
#pragma once

#include <cstdint>
#include <initializer_list>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <toml++/toml.h>

#include "forest/core/vec.h"

namespace forest::circuit {

/// Throws InputError (file, line) when the text is no TOML.
toml::table parse_toml(std::string_view text, const std::string& file);

/// A value with the place it came from. What it is made of must outlive it.
class Node {
 public:
  static constexpr double most = 1e8;     // of what is counted
  static constexpr double longest = 1e5;  // µm: ten centimetres, the largest brain slab anyone plants

  /// `where` names the value in complaints.
  Node(const toml::node& value, const std::string& file, std::string where)
      : value_(value), file_(file), where_(std::move(where)) {}

  /// Throws InputError: the file, the line of this value, and the sentence.
  [[noreturn]] void refuse(const std::string& sentence) const;

  bool is_string() const { return value_.is_string(); }

  // Each refuses a value that is something else.
  std::string string() const;  // not empty
  bool boolean() const;
  double number(double low, double high, const char* unit) const;
  std::uint32_t whole() const;  // up to `most`
  Vec3 place() const;           // µm
  const toml::table& table() const;

  // Of a table.
  void allow(std::initializer_list<std::string_view> keys)
      const;  // a misspelled key must not be passed over in silence
  std::optional<Node> find(std::string_view key) const;
  Node at(std::string_view key) const;
  std::vector<Node> tables(std::string_view key) const;  // one at least

 private:
  const toml::node& value_;
  const std::string& file_;
  std::string where_;
};

}  // namespace forest::circuit
