// SPDX-License-Identifier: Apache-2.0
// TOML that people write, read key by key; every complaint names its line. Of this room alone.
#pragma once

#include <algorithm>
#include <cmath>
#include <initializer_list>
#include <optional>
#include <string>
#include <string_view>
#include <toml.hpp>
#include <vector>

#include <fmt/format.h>

#include "forest/core/error.h"
#include "forest/core/vec.h"

namespace forest::circuit {

/// Throws InputError (file, line) when the text is no TOML.
toml::value parse_toml(std::string_view text, const std::string& file);

/// A value with the place it came from.
class Node {
 public:
  static constexpr double most = 1e8;     // of what is counted
  static constexpr double longest = 1e5;  // µm: ten centimetres, the largest brain slab anyone plants

  Node(const toml::value& value, const std::string& file, std::string where)
      : value_(value), file_(file), where_(std::move(where)) {}

  [[noreturn]] void refuse(const std::string& sentence) const {
    throw InputError(file_, value_.location().line(), sentence);
  }

  /// A table may hold these keys and no others; a misspelled key must not be passed over in silence.
  void allow(std::initializer_list<std::string_view> keys) const {
    const auto* offender = static_cast<const toml::value*>(nullptr);
    std::string name;
    for (const auto& [key, value] : table()) {
      if (std::ranges::find(keys, std::string_view(key)) != keys.end()) continue;
      // The table is unordered: name the first in the file.
      if (!offender || value.location().line() < offender->location().line()) offender = &value, name = key;
    }
    if (offender)
      Node(*offender, file_, where_)
          .refuse(fmt::format("{} has no key \"{}\"; its keys are {}", where_, name, fmt::join(keys, ", ")));
  }

  std::optional<Node> find(const std::string& key) const {
    const auto& all = table();
    const auto found = all.find(key);
    if (found == all.end()) return std::nullopt;
    return Node(found->second, file_, where_ + "'s " + key);
  }
  Node at(const std::string& key) const {
    if (auto node = find(key)) return *node;
    refuse(fmt::format("{} lacks \"{}\"; add it", where_, key));
  }

  std::string string() const {
    if (!value_.is_string()) refuse(where_ + " must be a text in quotation marks");
    std::string text = value_.as_string().str;
    if (text.empty()) refuse(where_ + " is empty; give it a name");
    return text;
  }
  bool boolean() const {
    if (!value_.is_boolean()) refuse(where_ + " must be true or false");
    return value_.as_boolean();
  }
  double number(double low, double high, const char* unit) const {
    const double x = value_.is_integer()    ? double(value_.as_integer())
                     : value_.is_floating() ? value_.as_floating()
                                            : std::nan("");
    if (!(x >= low && x <= high))
      refuse(fmt::format("{} must be a number from {:g} to {:g}{}{}", where_, low, high, *unit ? " " : "",
                         unit));
    return x;
  }
  std::uint32_t whole() const {
    if (!value_.is_integer() || value_.as_integer() < 0 || double(value_.as_integer()) > most)
      refuse(fmt::format("{} must be a whole number from 0 to {:.0f}", where_, most));
    return std::uint32_t(value_.as_integer());
  }
  Vec3 place() const {
    Vec3 place;
    if (!value_.is_array() || value_.as_array().size() != 3)
      refuse(where_ + " must be three numbers of µm, [x, y, z]");
    for (std::size_t i = 0; i < 3; ++i)
      place[Eigen::Index(i)] =
          float(Node(value_.as_array()[i], file_, where_).number(-longest, longest, "µm"));
    return place;
  }
  const toml::table& table() const {
    if (!value_.is_table()) refuse(where_ + " must be a table of keys and values");
    return value_.as_table();
  }
  std::vector<Node> tables(const std::string& key) const {
    const Node list = at(key);
    if (!list.value_.is_array() || list.value_.as_array().empty())
      list.refuse(fmt::format("write each {} as a table of its own, headed [[{}]]", key, key));
    std::vector<Node> nodes;
    for (const toml::value& value : list.value_.as_array())
      nodes.emplace_back(value, file_, fmt::format("{} {}", key, nodes.size() + 1));
    return nodes;
  }

 private:
  const toml::value& value_;
  const std::string& file_;
  std::string where_;
};

}  // namespace forest::circuit
