// SPDX-License-Identifier: Apache-2.0
// The first half of reading SWC: bytes to rows. What the rows mean is found in swc.cpp.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "forest/io/oddity.h"
#include "forest/morphology/morphology.h"

namespace forest::io {

/// The rows of the table swc_oddities(), in its order.
enum class SwcOddity : std::uint8_t {
  byte_order_mark,
  padding,
  line_ends,
  text_header,
  blank_line,
  late_comment,
  trailing_comment,
  trailing_text,
  typography,
  tabs,
  commas,
  decimal_commas,
  extra_columns,
  decimal_integer,
  exponent,
  unknown_radius,
  negative_radius,
  zero_radius,
  unknown_place,
  precision,
  first_id,
  id_order,
  negative_id,
  repeated_row,
  duplicate_id,
  child_first,
  root_marker,
  self_parent,
  missing_parent,
  several_roots,
  type_undefined,
  type_custom,
  type_negative,
  type_change,
  cnic_types,
  soma_under_neurite,
  soma_inside_neurite,
  several_somata,
  soma_three_points_turned,
  soma_three_points_inexact,
  soma_three_points_off,
  soma_three_points_attachment,
  soma_contour,
  soma_branches,
  all_soma,
  units,
  count
};

inline constexpr std::int32_t swc_soma_type = 1;
inline SectionKind swc_kind(std::int32_t type) {
  return type < 0 || type > 7 || type == swc_soma_type ? SectionKind::custom : SectionKind(type);
}

/// The number a section is written with: its tag where that says its kind.
inline std::int32_t swc_type(const Section& section) {
  const bool fits = swc_kind(section.tag) == section.kind && section.tag != swc_soma_type;
  return fits ? section.tag : std::int32_t(section.kind);
}

/// The first line of a file that write_swc wrote. It is read to the letter: nothing is guessed about types
/// and soma.
inline constexpr std::string_view swc_marker = "Brain Forest SWC 1 (INCF v1)";

/// What SWC has no word for, as comment lines of such a file.
inline constexpr std::string_view swc_node_key = "FOREST_NODE";        // id: this row begins a section
inline constexpr std::string_view swc_outline_key = "FOREST_OUTLINE";  // contour x y z r: of the soma
inline constexpr std::string_view swc_spine_key =
    "FOREST_SPINE";  // section position head xyz, diameters, shape
inline bool swc_own_key(std::string_view key) {
  return key == swc_node_key || key == swc_outline_key || key == swc_spine_key;
}

struct SwcRows {
  // One entry a row. An unknown radius or coordinate is NaN.
  std::vector<std::int64_t> ids, parents;
  std::vector<std::int32_t> types;
  std::vector<Point> points;

  Annotations
      annotations;  // comment lines; those between "start synapse" and "end synapse" under the key "synapse"
  bool to_the_letter = false, without_points = false;  // as a file of ours says
  std::vector<std::int64_t> nodes;                     // ids of rows that begin a section
  std::vector<Point> outline;                          // of the soma
  std::vector<std::uint32_t> outline_starts;
  std::vector<Spine> spines;

  bool consecutive = true;  // ids are first, first + 1, …
  bool unknown_numbers = false;
  std::vector<std::size_t> zero_radii;  // lines

  std::size_t size() const { return ids.size(); }
  std::size_t line(std::size_t row) const;  // 1-based

  struct Jump {
    std::size_t row, lines_before;  // from this row on, line = row + lines_before + 1
  };
  std::vector<Jump> jumps;
};

/// The key and the value of a comment, ("comment", text) when it has none.
std::pair<std::string_view, std::string_view> swc_comment(std::string_view text);

/// Throws InputError at the first line that is no row, no comment and not blank.
SwcRows scan_swc(std::string_view bytes, const std::string& name, OddityList<SwcOddity>& oddities);

}  // namespace forest::io
