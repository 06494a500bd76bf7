// SPDX-License-Identifier: Apache-2.0
// The segments of a <morphology>: what hangs on what, and where each begins and ends.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <unordered_map>
#include <utility>
#include <vector>

#include "forest/io/neuroml_document.h"
#include "forest/morphology/morphology.h"

namespace forest::io::neuroml {

// What a group says of its segments, in rising order of what wins where several do.
enum class Meaning : std::uint8_t { none, dendrite, basal, apical, axon, soma };

constexpr std::size_t none = std::size_t(-1);

struct Segment {
  xml_node node;
  std::int64_t id = 0;
  std::size_t parent = none;
  float fraction = 1.f;
  bool has_parent = false, has_proximal = false;
  Point proximal, distal;
  // Of its groups (neuroml_groups.h).
  Meaning meaning = Meaning::none;
  std::optional<std::pair<SectionKind, std::int32_t>> kind;  // as our own groups say
  std::size_t section = none;                                // the group that marks it
  // Of what hangs on it (neuroml_sections.h).
  std::vector<float> splits = {};  // fractions at which children hang, in (0, 1)
};

struct Segments {
  const Document& document;
  Oddities& oddities;
  bool to_the_letter;  // a file of ours

  std::vector<Segment> list = {};
  std::vector<std::size_t> order = {};                       // parents first
  std::unordered_map<std::int64_t, std::size_t> by_id = {};  // of several the first

  /// The one of this number; none when it is not there.
  std::size_t find(std::string_view id) const;
  std::size_t line(const Segment& s) const { return document.line(s.node); }
  /// Throws InputError.
  [[noreturn]] void refuse(const xml_node& node, const std::string& sentence) const;

  /// Where a segment hangs on its parent.
  Point joint(const Segment& s) const;
};

/// All numbers are finite. Throws InputError where segments make no tree.
Segments read_segments(const xml_node& morphology, const Document& document, Oddities& oddities,
                       bool to_the_letter);

/// On the way from one end of a segment to the other; exact at both.
Point between(const Point& a, const Point& b, float t);

}  // namespace forest::io::neuroml
