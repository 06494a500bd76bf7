// SPDX-License-Identifier: Apache-2.0
// Stacks of contours on the command line: a file, or a folder of drawings.
#pragma once

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "forest/cortex/contours.h"

namespace forest::cli {

class Console;

cortex::Axis axis_of(const std::string& name);  // "x", "y" or "z"

/// The files of a folder whose extension, in small letters, is wanted, by their names' bytes; not those that are hidden.
std::vector<std::filesystem::path> sections_in(const std::filesystem::path& folder,
                                               bool (*wanted)(std::string_view extension));
bool is_drawing_name(std::string_view extension);  // ".svg"

/// What was left out is told. Throws InputError.
/// @param unit  µm of one unit, where a format does not say it
cortex::ContourStack read_contour_files(const std::filesystem::path& path, double unit, Console& console);

/// Throws Error where contours cannot be put there in the end: a file whose name ends in .contours, or a folder of drawings whose name
/// has no ending, that is missing or, unless `force` is given, not there yet.
void must_take_contours(const std::filesystem::path& path, bool force);

/// A file where the name ends in .contours, else a folder of drawings, one a section.
/// @param overlay  each drawn over the one before it
void write_contour_files(const cortex::ContourStack& stack, const std::filesystem::path& path,
                         bool overlay = false);

}  // namespace forest::cli
