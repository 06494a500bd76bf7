// SPDX-License-Identifier: Apache-2.0
// The text of a NeuroML file as XML, and what is odd in it. For its readers: cells (neuroml.cpp), their segments, groups of
// segments, and the sections that come of them.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <pugixml.hpp>
#include <string>
#include <string_view>
#include <vector>

#include "forest/core/number.h"
#include "forest/io/oddity.h"
#include "forest/io/words.h"

namespace forest::io::neuroml {

enum class NeuromlOddity : std::uint8_t {
  several_cells,
  several_documents,
  elsewhere,
  include,
  not_kept,
  groups_not_kept,
  duplicate_id,
  missing_parent,
  child_first,
  several_roots,
  missing_proximal,
  unknown_number,
  diameter,
  zero_diameter,
  fraction,
  gap,
  several_somata,
  soma_inside_neurite,
  group,
  names_not_kept,
  count
};

using Oddities = OddityList<NeuromlOddity>;
using pugi::xml_node;

/// The part of an element's name after its namespace's prefix.
inline std::string_view local(const xml_node& node) {
  const std::string_view name = node.name();
  return name.substr(name.find(':') + 1);  // npos + 1 == 0
}

inline std::string_view attribute(const xml_node& node, const char* name) {
  return node.attribute(name).value();
}

template <class T>
bool parse(std::string_view text, T& value) {
  const auto found = number_of<T>(trimmed(text, xml_blanks));
  if (found) value = *found;
  return found.has_value();
}

/// The text as XML, and where its nodes stand.
class Document {
 public:
  /// Throws InputError when it is no XML or no NeuroML 2.
  Document(std::string_view bytes, const std::string& name);

  const xml_node& root() const { return root_; }
  const std::string& name() const { return name_; }
  std::size_t line(const xml_node& node) const { return line_of(node.offset_debug()); }

 private:
  std::size_t line_of(std::ptrdiff_t offset) const {
    return std::size_t(std::ranges::lower_bound(lines_, offset) - lines_.begin()) + 1;
  }

  pugi::xml_document document_;
  const std::string& name_;
  std::vector<std::ptrdiff_t> lines_;  // where they end
  xml_node root_;
};

}  // namespace forest::io::neuroml
