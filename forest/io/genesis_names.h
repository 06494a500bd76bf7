// SPDX-License-Identifier: Apache-2.0
// What the names of compartments in a GENESIS cell file say, and what stands in the files we write.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

#include "forest/morphology/morphology.h"

namespace forest::io {

struct GenesisName {
  SectionKind kind = SectionKind::undefined;
  std::int32_t tag = 0;
  bool soma = false, known = false;
  std::uint32_t section = 0;  // in our files: its number, so that nodes with one daughter come back
};

/// By the words in it, in any case: soma at its begin; axon, hillock, iseg; apic, tuft; basal, dend and the like.
GenesisName genesis_name(std::string_view name);

/// A name that name_of_compartment gave.
GenesisName own_genesis_name(std::string_view name);
std::string name_of_compartment(const Section& section, std::size_t number, std::size_t compartment);

/// Of the cylinder with the length and the lateral area of the segment.
double genesis_diameter(const Point& from, const Point& to);

// A file that begins with the marker is read to the letter; others skip such comments.
inline constexpr std::string_view genesis_marker = "// Brain Forest GENESIS cell 1";
inline constexpr std::string_view genesis_note = "//@note ";  // an annotation: key and value, escaped
inline constexpr std::string_view genesis_ends =
    "//@ends ";  // radii at both ends of the next compartment, soma point

/// Without blanks and line ends (%20); percent_decoded() is the way back.
std::string escaped_note(std::string_view text, bool blanks);

}  // namespace forest::io
