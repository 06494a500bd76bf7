// SPDX-License-Identifier: Apache-2.0
#include "forest/io/node_types.h"

#include <algorithm>

#include <fmt/format.h>

#include "forest/core/error.h"

namespace forest::io {

std::optional<std::size_t> Table::column(std::string_view name) const {
  const auto found = std::ranges::find(columns, name);
  if (found == columns.end()) return std::nullopt;
  return std::size_t(found - columns.begin());
}

Table parse_table(std::string_view text, const std::string& file) {
  Table table;
  std::vector<std::string> row;
  std::string cell;
  std::size_t line = 1, row_line = 1;
  bool quoted = false, filled = false;  // inside quotation marks; the row has a character

  const auto end_row = [&] {
    if (filled) {
      row.push_back(std::move(cell));
      if (table.columns.empty()) {
        table.columns = std::move(row);
      } else {
        if (row.size() != table.columns.size())
          throw InputError(
              file, row_line,
              fmt::format("the row has {} cells, but the header has {}; separate cells by one space and put "
                          "texts with spaces in quotation marks",
                          row.size(), table.columns.size()));
        table.rows.push_back(std::move(row));
        table.lines.push_back(row_line);
      }
    }
    row.clear(), cell.clear();
    filled = false;
  };

  for (std::size_t i = 0; i < text.size(); ++i) {
    const char c = text[i];
    if (c == '\n') ++line;
    if (quoted) {
      if (c != '"')
        cell += c;
      else if (i + 1 < text.size() && text[i + 1] == '"')
        cell += '"', ++i;  // a doubled mark stands for itself
      else
        quoted = false;
    } else if (c == '\n') {
      end_row();
      row_line = line;
    } else if (c != '\r') {
      filled = true;
      if (c == '"')
        quoted = true;
      else if (c == ' ')
        row.push_back(std::move(cell)), cell.clear();
      else
        cell += c;
    }
  }
  if (quoted) throw InputError(file, row_line, "a quotation mark is not closed; close it");
  end_row();
  if (table.columns.empty()) throw InputError(file, 0, "the table is empty; it needs at least a header");
  return table;
}

std::string format_table(const Table& table) {
  std::string text;
  const auto write = [&](const std::vector<std::string>& row) {
    for (std::size_t i = 0; i < row.size(); ++i) {
      if (i) text += ' ';
      if (!row[i].empty() && row[i].find_first_of(" \t\r\n\"'#,") == std::string::npos) {
        text += row[i];
        continue;
      }
      text += '"';
      for (const char c : row[i]) text.append(c == '"' ? 2 : 1, c);
      text += '"';
    }
    text += '\n';
  };
  write(table.columns);
  for (const auto& row : table.rows) write(row);
  return text;
}

}  // namespace forest::io
