// SPDX-License-Identifier: Apache-2.0
// Neurons of a repository as tables: what export --format xlsx and csv write, and import compares with.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "forest/io/workbook.h"
#include "forest/repository/repository.h"

namespace forest::cli {

class Console;

/// The sheets metrics, neurons, sections, junctions, annotations, and with `points` the sheet of that name; rows in the
/// order of the ids and of what they count. From then on the repository can only read.
std::vector<io::TableSheet> sheets_of(repository::Repository& repository,
                                      const std::vector<repository::NeuronRow>& neurons, bool points);

/// The files of export_tables, points among them whether they fit or not. Throws Error when `out` has the extension of
/// something else.
std::vector<std::filesystem::path> table_files(const std::filesystem::path& out, bool csv);

/// The workbook, one sheet each: summary (with charts), neurons, sections, junctions, metrics, annotations, points. What
/// does not fit into a workbook is told.
/// @param out  an .xlsx file, or with `csv` a folder for one file a sheet
/// Returns the files written. Throws Error.
std::vector<std::filesystem::path> export_tables(const std::string& repo,
                                                 std::vector<repository::NeuronRow> neurons,
                                                 const std::filesystem::path& out, bool csv,
                                                 Console& console);

}  // namespace forest::cli
