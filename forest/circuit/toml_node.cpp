// SPDX-License-Identifier: Apache-2.0
#include "forest/circuit/toml_node.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <string>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "forest/core/error.h"

namespace forest::circuit {
namespace {

std::size_t line(const toml::node& node) { return node.source().begin.line; }

// The parser bounds how deep brackets nest, and not how many tables a dotted key opens; letting go of them recurses. In texts and
// comments dots are dots.
void refuse_deep_keys(std::string_view text, const std::string& file) {
  constexpr int deepest = 256;
  int dots = 0;
  std::size_t line = 1;
  std::string_view open;  // the quotation mark, or three of them, that ends the text around i
  for (std::size_t i = 0; i < text.size(); ++i) {
    const char c = text[i];
    if (c == '\n') {
      ++line, dots = 0;
      if (open.size() == 1) open = {};  // which is no TOML
    } else if (!open.empty()) {
      if (c == '\\' && open[0] == '"' && text.substr(i + 1, 1) != "\n")
        ++i;
      else if (text.substr(i).starts_with(open)) {
        i += open.size() - 1;
        for (int more = 0; open.size() == 3 && more < 2 && text.substr(i + 1, 1) == open.substr(0, 1); ++more)
          ++i;  // of four or five marks in a row the first belong to the text
        open = {};
      }
    } else if (c == '"' || c == '\'') {
      open = text.substr(i, text.substr(i, 3) == std::string(3, c) ? 3 : 1);
      i += open.size() - 1;
    } else if (c == '#') {
      i = std::min(text.find('\n', i), text.size()) - 1;
    } else if (c == ',' || c == '=') {
      dots = 0;
    } else if (c == '.' && (i == 0 || text[i - 1] != '.') && ++dots > deepest) {
      throw InputError(file, line, "a key has too many parts; take dots out of it");
    }
  }
}

}  // namespace

toml::table parse_toml(std::string_view text, const std::string& file) {
  refuse_deep_keys(text, file);
  try {
    return toml::parse(text, std::string_view(file));
  } catch (const toml::parse_error& error) {
    std::string_view reason = error.description();
    if (constexpr std::string_view start = "Error while "; reason.starts_with(start))
      reason.remove_prefix(start.size());
    throw InputError(file, error.source().begin.line,
                     fmt::format("this is not TOML: {}; correct it", reason));
  }
}

void Node::refuse(const std::string& sentence) const { throw InputError(file_, line(value_), sentence); }

std::string Node::string() const {
  const auto* text = value_.as_string();
  if (!text) refuse(where_ + " must be a text in quotation marks");
  if (text->get().empty()) refuse(where_ + " is empty; give it a name");
  return text->get();
}

bool Node::boolean() const {
  const auto* truth = value_.as_boolean();
  if (!truth) refuse(where_ + " must be true or false");
  return truth->get();
}

double Node::number(double low, double high, const char* unit) const {
  const double x = value_.value<double>().value_or(std::nan(""));
  if (!(x >= low && x <= high))
    refuse(
        fmt::format("{} must be a number from {:g} to {:g}{}{}", where_, low, high, *unit ? " " : "", unit));
  return x;
}

std::uint32_t Node::whole() const {
  const auto* number = value_.as_integer();
  if (!number || number->get() < 0 || double(number->get()) > most)
    refuse(fmt::format("{} must be a whole number from 0 to {:.0f}", where_, most));
  return std::uint32_t(number->get());
}

Vec3 Node::place() const {
  const toml::array* numbers = value_.as_array();
  if (!numbers || numbers->size() != 3) refuse(where_ + " must be three numbers of µm, [x, y, z]");
  Vec3 place;
  for (std::size_t i = 0; i < 3; ++i)
    place[Eigen::Index(i)] = float(Node((*numbers)[i], file_, where_).number(-longest, longest, "µm"));
  return place;
}

const toml::table& Node::table() const {
  if (!value_.is_table()) refuse(where_ + " must be a table of keys and values");
  return *value_.as_table();
}

void Node::allow(std::initializer_list<std::string_view> keys) const {
  const auto allowed = [&](std::string_view key) { return std::ranges::find(keys, key) != keys.end(); };
  // The table is in the order of the alphabet: name the first in the file.
  const toml::table& all = table();
  auto offender = all.cend();
  for (auto entry = all.cbegin(); entry != all.cend(); ++entry)
    if (!allowed(entry->first.str()) &&
        (offender == all.cend() || line(entry->second) < line(offender->second)))
      offender = entry;
  if (offender != all.cend())
    Node(offender->second, file_, where_)
        .refuse(fmt::format("{} has no key \"{}\"; its keys are {}", where_, offender->first.str(),
                            fmt::join(keys, ", ")));
}

std::optional<Node> Node::find(std::string_view key) const {
  const toml::node* found = table().get(key);
  if (!found) return std::nullopt;
  return Node(*found, file_, fmt::format("{}'s {}", where_, key));
}

Node Node::at(std::string_view key) const {
  if (auto node = find(key)) return *node;
  refuse(fmt::format("{} lacks \"{}\"; add it", where_, key));
}

std::vector<Node> Node::tables(std::string_view key) const {
  const Node list = at(key);
  const toml::array* all = list.value_.as_array();
  if (!all || all->empty())
    list.refuse(fmt::format("write each {} as a table of its own, headed [[{}]]", key, key));
  std::vector<Node> nodes;
  for (const toml::node& value : *all)
    nodes.emplace_back(value, file_, fmt::format("{} {}", key, nodes.size() + 1));
  return nodes;
}

}  // namespace forest::circuit
