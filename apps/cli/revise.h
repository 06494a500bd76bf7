// SPDX-License-Identifier: Apache-2.0
// A workbook of ours that a person has edited: what changed goes back into the repository, or nothing does.
#pragma once

#include <filesystem>
#include <string>

namespace forest::cli {

class Console;

/// Whether this is a workbook, by its content, or a folder of the CSV files that export --format csv wrote.
bool is_workbook(const std::filesystem::path& path);

struct ReviseOptions {
  std::filesystem::path workbook;
  std::string repo;
  bool dry_run = false;  // only tell
  bool verbose = false;  // tell every cell, however many
};

/// Compares the workbook with what is stored, cell by cell, tells what changed and stores it in one transaction. Throws
/// Error when a cell is refused; each is told with its place, what stood there, and what to do.
void revise(const ReviseOptions& options, Console& console);

}  // namespace forest::cli
