// SPDX-License-Identifier: Apache-2.0
// Neurons of a repository as tables: what export --format xlsx and csv write.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "forest/repository/repository.h"

namespace forest::cli {

class Console;

/// The workbook, one sheet each: summary (with charts), neurons, sections, junctions, metrics.
/// @param out  an .xlsx file, or with `csv` a folder for one file a sheet
/// Returns the files written. Throws Error.
std::vector<std::filesystem::path> export_tables(const std::string& repo,
                                                 const std::vector<repository::NeuronRow>& neurons,
                                                 const std::filesystem::path& out, bool csv,
                                                 Console& console);

}  // namespace forest::cli
