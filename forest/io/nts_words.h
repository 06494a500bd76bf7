// SPDX-License-Identifier: Apache-2.0
// What the reader and the writer of NTS agree upon.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <string_view>

namespace forest::io {

/// The first line of a file that write_nts wrote. Only there a change of the tag along a branch begins a section, and
/// the comment below is understood.
inline constexpr std::string_view nts_marker = "Brain Forest NTS 1";
inline constexpr std::string_view nts_sphere_key =
    "FOREST_SPHERE";  // x y z radius: the outline stands for a sphere

/// What follows an origin that has no name and is attached to nothing: name, attachment, number there.
inline constexpr std::array<std::string_view, 3> nts_no_name{"------", "------", "0"};

/// The text of a comment, without the signs and blanks around it.
inline std::string_view nts_comment(std::string_view text) {
  text.remove_prefix(std::min(text.find_first_not_of("#; \t\v\f"), text.size()));
  return text.substr(0, text.find_last_not_of(" \t\v\f") + 1);
}

enum class NtsRole : std::uint8_t { origin, point, swelling, spine, branch, end, soma, outline, dots };
enum class NtsPart : std::uint8_t { start, on };  // of an outline

struct NtsCode {
  std::string_view code;
  NtsRole role;
  NtsPart part = NtsPart::on;
};

/// The first of a role is the plain one.
inline constexpr std::array<NtsCode, 21> nts_codes{{
    {"MTO", NtsRole::origin},   // in the middle of the slice
    {"TTO", NtsRole::origin},   // at its top: the tree goes on in another slice
    {"BTO", NtsRole::origin},   // at its bottom
    {"CP", NtsRole::point},     // continuation
    {"FS", NtsRole::swelling},  // fibre swelling
    {"SB", NtsRole::spine},     // spine base
    {"BP", NtsRole::branch},    // branch point
    {"NE", NtsRole::end},       // natural end
    {"ES", NtsRole::end},       // end swelling
    {"MAE", NtsRole::end},      // artificial ends, where the slice ends or the stain
    {"TAE", NtsRole::end},     {"BAE", NtsRole::end},    {"SOS", NtsRole::soma, NtsPart::start},
    {"SCP", NtsRole::soma},    {"SOE", NtsRole::soma},   {"OS", NtsRole::outline, NtsPart::start},
    {"OCP", NtsRole::outline}, {"OE", NtsRole::outline}, {"DS", NtsRole::dots, NtsPart::start},
    {"DCP", NtsRole::dots},    {"DE", NtsRole::dots},
}};

inline const NtsCode* find_nts_code(std::string_view text) {
  for (const NtsCode& row : nts_codes)
    if (row.code == text) return &row;
  return nullptr;
}

}  // namespace forest::io
