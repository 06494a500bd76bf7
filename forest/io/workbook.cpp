// SPDX-License-Identifier: Apache-2.0
#include "forest/io/workbook.h"

#include <algorithm>
#include <cmath>
#include <memory>
#include <unistd.h>
#include <xlsxwriter.h>

#include <fmt/format.h>
#include <sys/mman.h>

#include "forest/core/error.h"
#include "forest/core/file.h"

namespace forest::io {
namespace {

constexpr std::size_t longest_text = 32767;           // Excel's limit of a cell is in characters
constexpr lxw_color_t entry_colour = 0xfff2cc;        // the headers of what a person may change
constexpr int chart_width = 480, chart_height = 288;  // pixels, libxlsxwriter's own

std::string text_of(const Value& value) {
  struct {
    std::string operator()(std::monostate) const { return ""; }
    std::string operator()(std::int64_t v) const { return fmt::format("{}", v); }
    std::string operator()(double v) const { return std::isnan(v) ? "" : fmt::format("{}", v); }
    std::string operator()(const std::string& v) const { return v; }
  } const text;
  return std::visit(text, value);
}

/// Whether a character must be written as its code (_x005F_): the first of what looks like such a code, so that it is none
/// (_x0041_), and of what libxlsxwriter would take for XML of its own (<r>…).
bool needs_code(std::string_view text, std::size_t at) {
  if (at == 0 && text.starts_with("<r>")) return true;
  const std::string_view c = text.substr(at, 7);
  return c.size() == 7 && c.starts_with("_x") && c[6] == '_' &&
         c.substr(2, 4).find_first_not_of("0123456789abcdefABCDEF") == std::string_view::npos;
}

std::string coded(std::string_view text) {
  std::string result;
  for (std::size_t i = 0; i < text.size(); ++i)
    if (needs_code(text, i))
      result += fmt::format("_x{:04X}_", static_cast<unsigned char>(text[i]));
    else
      result += text[i];
  return result;
}

void write_cell(lxw_worksheet* sheet, lxw_row_t row, lxw_col_t column, const Value& value,
                lxw_format* format) {
  if (const auto* number = std::get_if<double>(&value)) {
    if (std::isfinite(*number)) worksheet_write_number(sheet, row, column, *number, format);
  } else if (const auto* whole = std::get_if<std::int64_t>(&value)) {
    worksheet_write_number(sheet, row, column, double(*whole), format);
  } else if (const auto* text = std::get_if<std::string>(&value); text && !text->empty()) {
    worksheet_write_string(sheet, row, column, coded(cell_text(*text)).c_str(), format);
  }
}

// Wide enough for the header and the first rows.
double width_of(const TableSheet& sheet, std::size_t column) {
  std::size_t widest = sheet.columns[column].title().size();
  for (std::size_t r = 0; r < std::min<std::size_t>(sheet.rows.size(), 50); ++r)
    widest = std::max(widest, text_of(sheet.rows[r][column]).size());
  return double(std::clamp<std::size_t>(widest + 2, 8, 40));
}

void write_sheet(lxw_workbook* book, const TableSheet& sheet) {
  if (sheet.rows.size() > most_rows)
    throw Error(fmt::format(
        "the sheet {} would have {} rows, and a spreadsheet holds {}; choose fewer neurons, or --format csv",
        sheet.name, sheet.rows.size(), most_rows));
  lxw_worksheet* page = workbook_add_worksheet(book, sheet.name.c_str());
  if (!page)
    throw Error(fmt::format("'{}' is no name for a sheet; this is an error of the program", sheet.name));
  lxw_format *header = workbook_add_format(book), *entry = workbook_add_format(book);
  for (lxw_format* format : {header, entry}) {
    format_set_bold(format);
    format_set_bottom(format, LXW_BORDER_THIN);
  }
  format_set_bg_color(entry, entry_colour);
  lxw_format* text = workbook_add_format(book);
  format_set_num_format(text, "@");  // or Excel makes a date of layer 2/3
  worksheet_freeze_panes(page, 1, 0);
  std::vector<lxw_format*> formats;
  for (std::size_t c = 0; c < sheet.columns.size(); ++c) {
    const auto column = lxw_col_t(c);
    formats.push_back(sheet.columns[c].entry && sheet.columns[c].unit.empty() ? text : nullptr);
    worksheet_set_column(page, column, column, width_of(sheet, c), formats.back());
    worksheet_write_string(page, 0, column, sheet.columns[c].title().c_str(),
                           sheet.columns[c].entry ? entry : header);
  }
  for (std::size_t r = 0; r < sheet.rows.size(); ++r)
    for (std::size_t c = 0; c < sheet.columns.size(); ++c)
      write_cell(page, lxw_row_t(r + 1), lxw_col_t(c), sheet.rows[r][c], formats[c]);
  if (!sheet.rows.empty())
    worksheet_autofilter(page, 0, 0, lxw_row_t(sheet.rows.size()), lxw_col_t(sheet.columns.size() - 1));
}

void add_chart(lxw_workbook* book, const Workbook& workbook, const Chart& chart, std::size_t number) {
  lxw_chart* drawn =
      workbook_add_chart(book, chart.kind == Chart::Kind::line ? LXW_CHART_LINE : LXW_CHART_COLUMN);
  const std::string& name = workbook.sheets[chart.sheet].name;
  const auto first = lxw_row_t(chart.first_row + 1), last = lxw_row_t(chart.first_row + chart.count);
  lxw_chart_series* series = chart_add_series(drawn, nullptr, nullptr);
  chart_series_set_categories(series, name.c_str(), first, lxw_col_t(chart.x_column), last,
                              lxw_col_t(chart.x_column));
  chart_series_set_values(series, name.c_str(), first, lxw_col_t(chart.y_column), last,
                          lxw_col_t(chart.y_column));
  chart_title_set_name(drawn, chart.title.c_str());
  chart_axis_set_name(drawn->x_axis, chart.x_title.c_str());
  chart_axis_set_name(drawn->y_axis, chart.y_title.c_str());
  chart_legend_set_position(drawn, LXW_CHART_LEGEND_NONE);
  if (chart.kind == Chart::Kind::columns) chart_set_series_gap(drawn, 12);
  lxw_worksheet* page = workbook_get_worksheet_by_name(book, workbook.sheets[0].name.c_str());
  const auto beside = lxw_col_t(workbook.sheets[0].columns.size() + 1);
  const int down = int(number / 2), right = int(number % 2);
  worksheet_insert_chart(page, lxw_row_t(1 + down * (chart_height / 20 + 1)),
                         lxw_col_t(int(beside) + right * (chart_width / 64 + 1)), drawn);
}

bool is_empty(const Value& value) {
  const auto* number = std::get_if<double>(&value);
  return number ? !std::isfinite(*number) : text_of(value).empty();
}

bool shows(const ReadCell& cell, const Value& value) {
  if (is_empty(value)) return cell.kind == ReadCell::Kind::empty;
  if (const auto* text = std::get_if<std::string>(&value)) return cell.text == cell_text(*text);
  const auto* whole = std::get_if<std::int64_t>(&value);
  const double number = whole ? double(*whole) : std::get<double>(value);
  return cell.kind == ReadCell::Kind::number &&
         std::abs(cell.number - number) <= 1e-14 * std::abs(number);  // it is written with 16 digits
}

bool shows(const ReadSheet& read, const TableSheet& sheet) {
  if (read.header.size() != sheet.columns.size()) return false;
  for (std::size_t c = 0; c < sheet.columns.size(); ++c)
    if (read.header[c] != sheet.columns[c].title()) return false;
  std::size_t at = 0;
  for (std::size_t r = 0; r < sheet.rows.size(); ++r) {
    if (std::ranges::all_of(sheet.rows[r], is_empty)) continue;
    if (at == read.rows.size() || read.rows[at] != r + 2) return false;
    for (std::size_t c = 0; c < sheet.columns.size(); ++c)
      if (!shows(read.cell(at, c), sheet.rows[r][c])) return false;
    ++at;
  }
  return at == read.rows.size();
}

/// libxlsxwriter writes each part into a file of its own first and does not look whether that found room, so what came of
/// it is read again.
bool is_whole(const std::filesystem::path& file, const Workbook& workbook) {
  const MappedFile bytes(file);
  try {
    check_parts(bytes.text(), file.string());
    const ReadWorkbook read = read_workbook(bytes.text(), file.string());
    return std::ranges::equal(read.sheets, workbook.sheets,
                              [](const ReadSheet& is, const TableSheet& sheet) { return shows(is, sheet); });
  } catch (const InputError&) {
    return false;
  }
}

}  // namespace

std::string_view cell_text(std::string_view text) {
  text = text.substr(0, text.find('\0'));
  std::size_t end = 0;
  for (std::size_t size = 0; end < text.size(); ++end)
    if ((size += needs_code(text, end) ? 7 : 1) > longest_text) break;
  if (end == text.size()) return text;
  while (end && (static_cast<unsigned char>(text[end]) & 0xc0) == 0x80) --end;
  return text.substr(0, end);
}

void write_workbook(const std::filesystem::path& path, const Workbook& workbook) {
  // Its library writes into a file of some name: one in memory, that nobody else can open and no kill leaves behind.
  struct InMemory {
    int file = ::memfd_create("workbook", MFD_CLOEXEC);
    ~InMemory() { ::close(file); }
  } const in_memory;
  const std::filesystem::path part = fmt::format("/proc/self/fd/{}", in_memory.file);
  lxw_workbook_options options{.constant_memory = LXW_FALSE, .tmpdir = nullptr, .use_zip64 = LXW_FALSE};
  std::unique_ptr<lxw_workbook, void (*)(lxw_workbook*)> owner(workbook_new_opt(part.c_str(), &options),
                                                               lxw_workbook_free);
  if (!owner) throw Error("a workbook cannot be made; there may be too little memory");
  lxw_workbook* book = owner.get();
  lxw_doc_properties properties{};
  properties.created = 946684800;  // always the same, so that the same neurons give the same bytes
  char program[] = "Brain Forest";
  properties.author = program;
  workbook_set_properties(book, &properties);
  for (const TableSheet& sheet : workbook.sheets) write_sheet(book, sheet);
  for (std::size_t i = 0; i < workbook.charts.size(); ++i) add_chart(book, workbook, workbook.charts[i], i);
  // Closing frees the workbook, whether it succeeds or not.
  const std::string target = path.string();
  if (const lxw_error error = workbook_close(owner.release()))
    throw Error(fmt::format("{}: the workbook cannot be written ({}); check that the disk has room", target,
                            lxw_strerror(error)));
  if (!is_whole(part, workbook))
    throw Error(
        fmt::format("{}: the workbook cannot be written; make room in the folder {}, or choose fewer neurons",
                    target, std::filesystem::temp_directory_path().string()));
  write_file(path, MappedFile(part).bytes());
}

std::string csv_of(const TableSheet& sheet) {
  std::string csv;
  const auto cell = [&](std::size_t column, const std::string& text) {
    if (column) csv += ',';
    if (text.find_first_of(",\"\r\n") == std::string::npos) {
      csv += text;
      return;
    }
    csv += '"';
    for (const char c : text) csv.append(c == '"' ? 2 : 1, c);
    csv += '"';
  };
  for (std::size_t c = 0; c < sheet.columns.size(); ++c) cell(c, sheet.columns[c].title());
  csv += "\r\n";
  for (const auto& row : sheet.rows) {
    for (std::size_t c = 0; c < row.size(); ++c) cell(c, text_of(row[c]));
    csv += "\r\n";
  }
  return csv;
}

}  // namespace forest::io
