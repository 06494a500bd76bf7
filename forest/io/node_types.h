// SPDX-License-Identifier: Apache-2.0
// The tables of SONATA (node_types.csv): columns separated by single spaces, cells with spaces in quotation marks,
// NULL for what does not apply.
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace forest::io {

struct Table {
  std::vector<std::string> columns;
  std::vector<std::vector<std::string>> rows;  // as long as columns
  std::vector<std::size_t> lines;              // where each row began, 1-based; empty for a table not read

  /// Index of a column; none when the table lacks it.
  std::optional<std::size_t> column(std::string_view name) const;
};

/// Throws InputError (file, line) when a row is longer or shorter than the header, or a quotation mark is not closed.
Table parse_table(std::string_view text, const std::string& file);
std::string format_table(const Table& table);

}  // namespace forest::io
