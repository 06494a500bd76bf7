// SPDX-License-Identifier: Apache-2.0
// Tables for people: sheets of a spreadsheet (Office Open XML, what Excel and LibreOffice read) with charts, or CSV files
// (RFC 4180). N++ handed its neurons to Excel; so do we.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <variant>
#include <vector>

namespace forest::io {

using Value = std::variant<std::monostate, std::int64_t, double, std::string>;  // monostate: an empty cell

struct TableColumn {
  std::string name;
  std::string unit;  // "µm"; empty for counts, ratios and words

  std::string title() const { return unit.empty() ? name : name + " (" + unit + ")"; }
};

struct TableSheet {
  std::string name;  // at most 31 characters, none of []:*?/\ (Excel's rule)
  std::vector<TableColumn> columns;
  std::vector<std::vector<Value>> rows;  // each as long as columns
};

/// A chart of two columns of a sheet.
struct Chart {
  enum class Kind : std::uint8_t { columns, line };
  std::string title, x_title, y_title;
  Kind kind = Kind::columns;
  std::size_t sheet = 0;  // in Workbook::sheets
  std::size_t x_column = 0, y_column = 0;
  std::size_t first_row = 0, count = 0;  // rows of the sheet
};

struct Workbook {
  std::vector<TableSheet> sheets;
  std::vector<Chart> charts;  // all on the first sheet, beside its table
};

/// The file is written whole or not at all, and the same workbook gives the same bytes. Throws Error when a sheet has
/// more rows than Excel can read (1,048,575), or the file cannot be written.
void write_workbook(const std::filesystem::path& path, const Workbook& workbook);

std::string csv_of(const TableSheet& sheet);

}  // namespace forest::io
