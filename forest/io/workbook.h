// SPDX-License-Identifier: Apache-2.0
// Tables for people: sheets of a spreadsheet (Office Open XML, what Excel and LibreOffice read) with charts, or CSV files
// (RFC 4180), and back. N++ handed its neurons to Excel; so do we.
#pragma once

#include <cstdint>
#include <deque>
#include <filesystem>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

namespace forest::io {

using Value = std::variant<std::monostate, std::int64_t, double, std::string>;  // monostate: an empty cell

struct TableColumn {
  std::string name;
  std::string unit;    // "µm"; empty for counts, ratios and words
  bool entry = false;  // a person may change it: its header has a colour, and without a unit it holds text

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

constexpr std::size_t most_rows = 1048575;  // of a sheet, and a header

/// The start of a text that fits into one cell (32,767 bytes), whole characters, none of them zero.
std::string_view cell_text(std::string_view text);

/// The file is written whole or not at all, and the same workbook gives the same bytes. Throws Error when a sheet has
/// more rows than Excel can read (1,048,575), or the file cannot be written.
void write_workbook(const std::filesystem::path& path, const Workbook& workbook);

std::string csv_of(const TableSheet& sheet);

// ── Reading ──

/// What a cell shows; of a formula the value that was last computed.
struct ReadCell {
  enum class Kind : std::uint8_t {
    empty,
    number,
    text,
    boolean,  // TRUE or FALSE
    error,    // #DIV/0!, or what is no number though it should be
    formula,  // one that no spreadsheet has computed yet
    word      // of a CSV file, which does not tell numbers from texts
  };
  Kind kind = Kind::empty;
  double number = 0.;     // finite
  std::string_view text;  // of all kinds but empty and number
};

/// A table that begins with a header in row 1. Cells right of the last header and rows without any cell are left out.
struct ReadSheet {
  std::string name;
  std::vector<std::string> header;  // a name for every column, "" where there is none
  std::vector<std::uint32_t> rows;  // the spreadsheet's own number of each row, from 2
  std::vector<ReadCell> cells;      // header.size() of each row

  const ReadCell& cell(std::size_t row, std::size_t column) const {
    return cells[row * header.size() + column];
  }
  static constexpr std::size_t top = std::size_t(-1);            // the header
  std::string place(std::size_t row, std::size_t column) const;  // "points!D17"
};

struct ReadWorkbook {
  std::vector<ReadSheet> sheets;  // in their order; hidden ones too, sheets that are charts not
  std::deque<std::string> texts;  // what the cells point into

  ReadWorkbook() = default;
  ReadWorkbook(ReadWorkbook&&) = default;
  ReadWorkbook& operator=(ReadWorkbook&&) = default;

  const ReadSheet* find(std::string_view name) const;  // null when there is none
};

// Beyond these a workbook is refused, so that a small hostile file takes neither the memory nor the day.
constexpr std::uint64_t most_unpacked = 2ull << 30;  // bytes of all its parts
constexpr std::uint64_t most_element = 64ull << 20;  // bytes of one row, or one text
constexpr std::uint64_t most_cells = 1ull << 25;     // columns times rows, of all sheets
constexpr std::uint64_t most_texts = 1ull << 22;     // shared among the cells

/// Whether these bytes are those of a ZIP archive, as workbooks are.
bool recognises_workbook(std::string_view bytes);

/// What Excel, LibreOffice or a program wrote. Throws InputError (file `name`) when it is cut off, damaged, locked by a
/// password, something else, or beyond a limit.
ReadWorkbook read_workbook(std::string_view bytes, const std::string& name);

/// Throws InputError (file `name`) when a part of a workbook, be it a chart, is damaged or cut off. Sheets and shared texts
/// are not looked at, which read_workbook() does.
void check_parts(std::string_view bytes, const std::string& name);

/// Appends a sheet from a CSV file: fields between commas, or semicolons or tabs where the header has those. Throws
/// InputError (file `name`, line) when a quotation does not end or a row is longer than the header.
void read_csv(ReadWorkbook& book, std::string sheet, std::string_view bytes, const std::string& name);

}  // namespace forest::io
