// SPDX-License-Identifier: Apache-2.0
// Words of Neurolucida's files that readers and writers agree upon.
#pragma once

#include <string>
#include <string_view>

#include "forest/morphology/morphology.h"

namespace forest::io {

/// The first comment of a file that write_asc wrote. Only there are the comments below understood.
inline constexpr std::string_view asc_marker = "Brain Forest ASC 1";

/// What ASC has no word for, each in a comment at its place.
inline constexpr std::string_view asc_sphere_key =
    "FOREST_SPHERE";  // x y z r: this outline stands for a sphere
inline constexpr std::string_view asc_cylinder_key = "FOREST_CYLINDER";  // x y z r parent: … for cylinders
inline constexpr std::string_view asc_section_key =
    "FOREST_SECTION";  // kind tag soma_point: of this branch and those on it
inline constexpr std::string_view asc_spine_key = "FOREST_SPINE";  // position, head x y z, diameters, shape
inline constexpr std::string_view asc_own_prefix = "FOREST_";

/// The text of a comment without the signs and blanks around it.
std::string_view asc_comment(std::string_view text);

/// Whether an outline of this name is the soma's: "CellBody", "Cell Body", "Soma", also with a number.
bool names_soma(std::string_view name);

/// Of the words of Neurolucida; unknown for others.
SpineShape spine_shape(std::string_view text);

/// Whether `text` is read as exactly this annotation and nothing else, so that it may be written as it stands.
bool asc_reads_as_annotation(std::string_view text, std::string_view key, std::string_view value);

}  // namespace forest::io
