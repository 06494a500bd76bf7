// SPDX-License-Identifier: Apache-2.0
// Workbooks as other programs save them (ECMA-376, SpreadsheetML): a ZIP archive whose parts name one another. A sheet may
// be hundreds of megabytes of XML, so parts are unpacked piece by piece and their rows, or texts, parsed one at a time.
#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <cstring>
#include <memory>
#include <optional>
#include <pugixml.hpp>
#include <zip.h>

#include <fmt/format.h>

#include "forest/core/byte_order_mark.h"
#include "forest/core/error.h"
#include "forest/core/number.h"
#include "forest/io/words.h"
#include "forest/io/workbook.h"

namespace forest::io {
namespace {

using Kind = ReadCell::Kind;

constexpr std::size_t most_columns = 16384;  // Excel's
constexpr std::size_t piece = 256 << 10;     // bytes unpacked at a time

// Parts are well-formed text on their own, so blanks count: a cell may hold nothing else.
constexpr unsigned parsing = pugi::parse_default | pugi::parse_ws_pcdata_single;

/// "row" of "x:row": prefixes are the writer's own choice.
std::string_view local(std::string_view name) { return name.substr(name.find(':') + 1); }

pugi::xml_node child(pugi::xml_node parent, std::string_view name) {
  for (const pugi::xml_node node : parent.children())
    if (local(node.name()) == name) return node;
  return {};
}

pugi::xml_attribute attribute(pugi::xml_node node, std::string_view name) {
  for (const pugi::xml_attribute a : node.attributes())
    if (local(a.name()) == name) return a;
  return {};
}

/// "D" for 3.
std::string letters(std::size_t column) {
  std::string name;
  for (++column; column; column = (column - 1) / 26) name.insert(name.begin(), char('A' + (column - 1) % 26));
  return name;
}

/// 3 for "D17".
std::optional<std::size_t> column_of(std::string_view reference) {
  std::size_t column = 0, count = 0;
  for (; count < reference.size() && reference[count] >= 'A' && reference[count] <= 'Z' && count < 4; ++count)
    column = 26 * column + std::size_t(reference[count] - 'A' + 1);
  if (count == 0 || count > 3 || column > most_columns) return std::nullopt;
  return column - 1;
}

template <class Number>
std::optional<Number> number_in(std::string_view text) {
  const auto number = number_of<Number>(trimmed(text, xml_blanks));
  return number && std::isfinite(double(*number)) ? number : std::nullopt;
}

/// Characters that XML has none for are written _xHHHH_ (ECMA-376, part 1, 22.9.2.19).
std::string decoded(std::string text) {
  const auto at = [&](std::size_t i) -> std::optional<unsigned> {
    unsigned code = 0;
    if (i + 7 > text.size() || text[i] != '_' || text[i + 1] != 'x' || text[i + 6] != '_')
      return std::nullopt;
    const auto [end, error] = std::from_chars(&text[i + 2], &text[i + 6], code, 16);
    if (error != std::errc() || end != &text[i + 6] || (code >= 0xd800 && code < 0xe000)) return std::nullopt;
    return code;
  };
  if (text.find("_x") == std::string::npos) return text;
  std::string result;
  for (std::size_t i = 0; i < text.size();) {
    const auto code = at(i);
    if (!code) {
      result += text[i++];
      continue;
    }
    if (*code < 0x80) {
      result += char(*code);
    } else if (*code < 0x800) {
      result += char(0xc0 | *code >> 6), result += char(0x80 | (*code & 63));
    } else {
      result += char(0xe0 | *code >> 12), result += char(0x80 | (*code >> 6 & 63));
      result += char(0x80 | (*code & 63));
    }
    i += 7;
  }
  return result;
}

/// The text of <si> or <is>: that of its <t>, or of the runs of one that has several fonts; how it is spoken is left out.
std::string rich_text(pugi::xml_node node) {
  std::string text;
  for (const pugi::xml_node part : node.children()) {
    if (local(part.name()) == "t") text += part.child_value();
    if (local(part.name()) == "r") text += child(part, "t").child_value();
  }
  return decoded(std::move(text));
}

/// The archive and its parts.
class Archive {
 public:
  Archive(std::string_view bytes, const std::string& name) : name_(name) {
    zip_error_t error;
    zip_error_init(&error);
    zip_source_t* source = zip_source_buffer_create(bytes.data(), bytes.size(), 0, &error);
    if (source) {
      zip_.reset(zip_open_from_source(source, ZIP_RDONLY, &error));
      if (!zip_) zip_source_free(source);
    }
    const std::string why = zip_ ? "" : zip_error_strerror(&error);
    zip_error_fini(&error);
    if (!zip_) fail("is cut off or damaged ({}); copy or save it again", why);
  }

  template <class... Words>
  [[noreturn]] void fail(fmt::format_string<Words...> sentence, Words&&... words) const {
    throw InputError(name_, 0, fmt::format(sentence, std::forward<Words>(words)...));
  }

  std::vector<std::string> parts() const {
    std::vector<std::string> parts;
    for (zip_int64_t i = 0, count = zip_get_num_entries(zip_.get(), 0); i < count; ++i)
      if (const char* part = zip_get_name(zip_.get(), zip_uint64_t(i), 0)) parts.emplace_back(part);
    return parts;
  }
  bool has(const std::string& part) const { return zip_name_locate(zip_.get(), part.c_str(), 0) >= 0; }

  /// Calls `use` with piece after piece of a part.
  template <class Use>
  void unpack(const std::string& part, Use&& use) {
    const std::unique_ptr<zip_file_t, int (*)(zip_file_t*)> file(zip_fopen(zip_.get(), part.c_str(), 0),
                                                                 zip_fclose);
    if (!file) fail("its part {} cannot be unpacked ({}); save it again", part, zip_strerror(zip_.get()));
    std::string bytes(piece, '\0');
    for (;;) {
      const zip_int64_t count = zip_fread(file.get(), bytes.data(), bytes.size());
      if (count < 0)
        fail("its part {} is damaged ({}); copy or save it again", part, zip_file_strerror(file.get()));
      if (count == 0) return;
      unpacked_ += std::uint64_t(count);
      if (unpacked_ > most_unpacked)
        fail("unpacks to over {} MiB; choose fewer neurons, or use CSV", most_unpacked >> 20);
      use(std::string_view(bytes).substr(0, std::size_t(count)));
    }
  }

  /// A small part as a whole.
  void load(const std::string& part, pugi::xml_document& document) {
    std::string text;
    unpack(part, [&](std::string_view bytes) {
      text += bytes;
      if (text.size() > most_element) fail("its part {} is over {} MiB", part, most_element >> 20);
    });
    const auto result = document.load_buffer(text.data(), text.size(), parsing);
    if (!result)
      fail("its part {} is no XML ({} at byte {}); save it again", part, result.description(), result.offset);
  }

  /// Calls `use` with every element `tag` of a part, one after the other; elements of that name lie in no other. False when
  /// the root element is not `root`.
  template <class Use>
  bool elements(const std::string& part, std::string_view root, std::string_view tag, Use&& use) {
    std::string text, open, close, last;
    bool begun = false, right = true, ended = false;
    std::size_t at = 0, enough = 0;
    const auto find_root = [&] {
      for (std::size_t i = 0; (i = text.find('<', i)) != std::string::npos; ++i) {
        if (i + 1 < text.size() && (text[i + 1] == '?' || text[i + 1] == '!')) continue;
        at = text.find('>', i);
        if (at == std::string::npos) break;
        const std::string name = text.substr(i + 1, text.find_first_of(" \t\r\n/>", i + 1) - i - 1);
        const std::string prefix = name.substr(0, name.size() - local(name).size());
        right = local(name) == root, begun = true, ended = text[at - 1] == '/';
        open = fmt::format("<{}{}", prefix, tag), close = fmt::format("</{}{}", prefix, tag);
        last = fmt::format("</{}", name);
        return;
      }
      at = 0;
    };
    const auto next = [&](std::string_view all) -> bool {  // an element that is there as a whole
      std::size_t begin = at;
      for (;; begin += open.size()) {
        begin = all.find(open, begin);
        if (begin == std::string_view::npos) {
          at = std::max(at, all.size() - std::min<std::size_t>(all.size(), 256));  // the end of the root
          return false;
        }
        const std::size_t after = begin + open.size();
        if (after >= all.size() || std::strchr(" \t\r\n/>", all[after])) break;  // not <rowBreaks
      }
      at = begin;
      std::size_t end = begin;
      for (char quote = 0; end < all.size() && (quote || all[end] != '>'); ++end)
        if (quote ? all[end] == quote : all[end] == '"' || all[end] == '\'') quote = quote ? '\0' : all[end];
      if (end >= all.size()) return false;
      if (all[end - 1] != '/') {
        end = all.find(close, end);
        if (end == std::string_view::npos) return false;
        end = all.find('>', end);
        if (end == std::string_view::npos) return false;
      }
      const auto result = document_.load_buffer(&all[begin], end + 1 - begin, parsing, pugi::encoding_utf8);
      if (!result)
        fail("its part {} is no XML ({} in {} bytes from '{}'); save it again", part, result.description(),
             end + 1 - begin, all.substr(begin, 40));
      use(document_.first_child());
      at = end + 1;
      return true;
    };
    const auto take = [&] {
      if (!begun) find_root();
      if (!right) return text.clear();
      if (begun)
        while (next(text)) {
        }
      text.erase(0, at), at = 0;
      enough = 2 * text.size();  // or a long element is looked through again and again
    };
    unpack(part, [&](std::string_view bytes) {
      text += bytes;
      if (text.starts_with("\xff\xfe") || text.starts_with("\xfe\xff"))
        fail("its part {} is UTF-16; save it again with a spreadsheet", part);
      if (text.size() > most_element)
        fail("its part {} has an element of over {} MiB; save it again", part, most_element >> 20);
      if (text.size() >= enough) take();
    });
    take();
    if (right && !ended && (!begun || text.find(last) == std::string::npos))
      fail("its part {} is cut off; copy or save it again", part);
    return right;
  }

 private:
  std::string name_;
  std::unique_ptr<zip_t, void (*)(zip_t*)> zip_{nullptr, zip_discard};
  std::uint64_t unpacked_ = 0;
  pugi::xml_document document_;
};

/// Where a part is, by what another part calls it.
std::string resolved(const std::string& from, std::string_view target) {
  std::string path = target.starts_with('/') ? "" : from.substr(0, from.rfind('/') + 1);
  for (std::size_t at = 0; at < target.size();) {
    const std::size_t end = std::min(target.find('/', at), target.size());
    const std::string_view step = target.substr(at, end - at);
    if (step == "..") {
      const std::size_t slash = path.size() < 2 ? std::string::npos : path.rfind('/', path.size() - 2);
      path.resize(slash == std::string::npos ? 0 : slash + 1);
    } else if (!step.empty() && step != ".") {
      path += step;
      if (end < target.size()) path += '/';
    }
    at = end + 1;
  }
  return path;
}

struct Relation {
  std::string id, type, part;  // type: the last word of it
};

std::vector<Relation> relations_of(Archive& archive, const std::string& part) {
  const std::size_t name = part.rfind('/') + 1;
  const std::string rels = part.substr(0, name) + "_rels/" + part.substr(name) + ".rels";
  std::vector<Relation> relations;
  if (!archive.has(rels)) return relations;
  pugi::xml_document document;
  archive.load(rels, document);
  for (const pugi::xml_node node : document.document_element().children()) {
    const std::string_view type = attribute(node, "Type").value();
    relations.push_back({attribute(node, "Id").value(), std::string(type.substr(type.rfind('/') + 1)),
                         resolved(part, attribute(node, "Target").value())});
  }
  return relations;
}

/// Counts what all sheets hold.
struct Budget {
  std::uint64_t cells = 0;
};

class SheetReader {
 public:
  SheetReader(Archive& archive, ReadWorkbook& book, Budget& budget, std::size_t shared)
      : archive_(archive), book_(book), budget_(budget), shared_(shared) {}

  std::optional<ReadSheet> read(const std::string& name, const std::string& part) {
    sheet_.name = name;
    if (!archive_.elements(part, "worksheet", "row", [&](pugi::xml_node node) { row(node); }))
      return std::nullopt;
    return std::move(sheet_);
  }

 private:
  void row(pugi::xml_node node) {
    const pugi::xml_attribute r = attribute(node, "r");
    const auto number = r ? number_in<std::uint32_t>(r.value()) : row_ + 1;
    if (!number || *number <= row_ || *number > most_rows + 1)
      archive_.fail("a row of the sheet {} is numbered '{}' after row {}; save it again with a spreadsheet",
                    sheet_.name, r.value(), row_);
    row_ = *number;
    const std::size_t width = sheet_.header.size(), begin = sheet_.cells.size();
    bool any = false;
    std::size_t next = 0;
    for (const pugi::xml_node c : node.children()) {
      if (local(c.name()) != "c") continue;
      const pugi::xml_attribute reference = attribute(c, "r");
      const auto column = reference ? column_of(reference.value()) : next;
      if (!column || *column < next || *column >= most_columns)
        archive_.fail(
            "row {} of the sheet {} has a cell '{}' out of its order; save it again with a spreadsheet", row_,
            sheet_.name, reference.value());
      next = *column + 1;
      if (row_ != 1 && *column >= width) break;
      const ReadCell cell = cell_of(c, *column);
      if (cell.kind == Kind::empty) continue;
      if (row_ == 1) {
        sheet_.header.resize(*column + 1);
        sheet_.header[*column] = cell.kind == Kind::number ? fmt::format("{}", cell.number) : cell.text;
        continue;
      }
      if (!any) {
        if ((budget_.cells += width) > most_cells)
          archive_.fail("has over {} million cells; choose fewer neurons, or use CSV", most_cells / 1000000);
        sheet_.cells.resize(begin + width);
        sheet_.rows.push_back(row_);
        any = true;
      }
      sheet_.cells[begin + *column] = cell;
    }
  }

  std::string_view keep(std::string text) { return book_.texts.emplace_back(std::move(text)); }

  ReadCell cell_of(pugi::xml_node c, std::size_t column) {
    const std::string_view type = attribute(c, "t").value();
    if (type == "inlineStr") return text_cell(rich_text(child(c, "is")));
    const std::string_view value = child(c, "v").child_value();
    const pugi::xml_node formula = child(c, "f");
    if (type == "str") return text_cell(decoded(std::string(value)));
    if (value.empty()) {
      if (!formula) return {};
      return {Kind::formula, 0., keep(fmt::format("={}", formula.child_value()))};
    }
    if (type == "s") {
      const auto index = number_in<std::uint32_t>(value);
      if (!index || *index >= shared_)
        archive_.fail("{}!{}{} shows text {}, which is not in the workbook; save it again with a spreadsheet",
                      sheet_.name, letters(column), row_, value);
      const std::string& text = book_.texts[*index];
      return text.empty() ? ReadCell{} : ReadCell{Kind::text, 0., text};
    }
    if (type == "b") return {Kind::boolean, 0., value == "1" || value == "true" ? "TRUE" : "FALSE"};
    if (type == "e") return {Kind::error, 0., keep(std::string(value))};
    if (type == "d") return {Kind::text, 0., keep(std::string(value))};
    if (const auto number = number_in<double>(value)) return {Kind::number, *number, {}};
    return {Kind::error, 0., keep(std::string(value))};
  }

  ReadCell text_cell(std::string text) {
    if (text.empty()) return {};
    return {Kind::text, 0., keep(std::move(text))};
  }

  Archive& archive_;
  ReadWorkbook& book_;
  Budget& budget_;
  std::size_t shared_;
  ReadSheet sheet_;
  std::uint32_t row_ = 0;
};

}  // namespace

std::string ReadSheet::place(std::size_t row, std::size_t column) const {
  return fmt::format("{}!{}{}", name, letters(column), row == top ? 1 : rows[row]);
}

const ReadSheet* ReadWorkbook::find(std::string_view name) const {
  const auto found = std::ranges::find(sheets, name, &ReadSheet::name);
  return found == sheets.end() ? nullptr : &*found;
}

bool recognises_workbook(std::string_view bytes) { return bytes.starts_with("PK\x03\x04"); }

ReadWorkbook read_workbook(std::string_view bytes, const std::string& name) {
  if (bytes.starts_with("\xd0\xcf\x11\xe0"))
    throw InputError(name, 0, "is locked by a password or of Excel 2003; save it as .xlsx without one");
  if (!recognises_workbook(bytes)) throw InputError(name, 0, "is no workbook; save it as .xlsx");
  Archive archive(bytes, name);
  std::string main;
  for (const Relation& relation : relations_of(archive, ""))
    if (relation.type == "officeDocument") main = relation.part;
  if (main.empty() || !archive.has(main))
    archive.fail("is no workbook but another archive{}; save it as .xlsx",
                 archive.has("content.xml") ? ", such as LibreOffice's own .ods" : "");
  pugi::xml_document document;
  archive.load(main, document);
  if (local(document.document_element().name()) != "workbook")
    archive.fail("is another document of an office, no workbook; save it as .xlsx");
  const std::vector<Relation> relations = relations_of(archive, main);

  ReadWorkbook book;
  for (const Relation& relation : relations)
    if (relation.type == "sharedStrings" && archive.has(relation.part) && book.texts.empty())
      archive.elements(relation.part, "sst", "si", [&](pugi::xml_node node) {
        if (book.texts.size() >= most_texts) archive.fail("has over {} million texts", most_texts / 1000000);
        book.texts.push_back(rich_text(node));
      });
  const std::size_t shared = book.texts.size();
  Budget budget;
  for (const pugi::xml_node node : child(document.document_element(), "sheets").children()) {
    std::string title, id;
    for (const pugi::xml_attribute a : node.attributes()) {
      if (std::string_view(a.name()) == "name") title = a.value();
      if (std::string_view(a.name()).ends_with(":id")) id = a.value();
    }
    const auto relation = std::ranges::find(relations, id, &Relation::id);
    if (relation == relations.end() || !archive.has(relation->part))
      archive.fail("its sheet {} is missing; copy or save it again", title);
    if (book.find(title)) archive.fail("has two sheets {}; save it again with a spreadsheet", title);
    if (auto sheet = SheetReader(archive, book, budget, shared).read(title, relation->part)) {
      for (std::string& column : sheet->header) column = trimmed(column, xml_blanks);
      book.sheets.push_back(std::move(*sheet));
    }
  }
  return book;
}

void check_parts(std::string_view bytes, const std::string& name) {
  Archive archive(bytes, name);
  pugi::xml_document document;
  for (const std::string& part : archive.parts())
    if (!part.starts_with("xl/worksheets/sheet") && part != "xl/sharedStrings.xml")
      archive.load(part, document);
}

void read_csv(ReadWorkbook& book, std::string sheet, std::string_view bytes, const std::string& name) {
  bytes = without_byte_order_mark(bytes);  // Excel writes one
  const std::string_view first = bytes.substr(0, bytes.find_first_of("\r\n"));
  const std::size_t mark = first.find_first_of(",;\t");
  const char separator = mark == std::string_view::npos ? ',' : first[mark];

  ReadSheet read{std::move(sheet), {}, {}, {}};
  std::size_t line = 1, at = 0;
  std::uint32_t number = 0;
  std::vector<std::string> fields;
  while (at < bytes.size()) {
    fields.assign(1, "");
    ++number;
    const std::size_t begun = line;
    bool quoted = false;
    for (; at < bytes.size(); ++at) {
      const char c = bytes[at];
      line += c == '\n';
      if (quoted) {
        if (c != '"') {
          fields.back() += c;
        } else if (at + 1 < bytes.size() && bytes[at + 1] == '"') {
          fields.back() += c, ++at;
        } else {
          quoted = false;
        }
      } else if (c == '"' && fields.back().empty()) {
        quoted = true;
      } else if (c == separator) {
        if (fields.size() == most_columns)
          throw InputError(name, begun, fmt::format("has over {} columns", most_columns));
        fields.emplace_back();
      } else if (c == '\n') {
        ++at;
        break;
      } else if (c != '\r' || (at + 1 < bytes.size() && bytes[at + 1] != '\n')) {
        fields.back() += c;
      }
    }
    if (quoted)
      throw InputError(name, begun, "a quotation that begins in this row does not end; close it by \"");
    if (number == 1) {
      for (const std::string& field : fields) read.header.emplace_back(trimmed(field, xml_blanks));
      while (!read.header.empty() && read.header.back().empty()) read.header.pop_back();
      continue;
    }
    while (!fields.empty() && fields.back().empty()) fields.pop_back();
    if (fields.empty()) continue;
    if (fields.size() > read.header.size())
      throw InputError(
          name, begun,
          fmt::format("has {} fields, and the header names {}; put fields that hold the separator "
                      "between quotation marks",
                      fields.size(), read.header.size()));
    read.rows.push_back(number);
    for (std::string& field : fields) {
      ReadCell& cell = read.cells.emplace_back();
      if (!field.empty()) cell = {Kind::word, 0., book.texts.emplace_back(std::move(field))};
    }
    if (read.rows.size() * read.header.size() > most_cells)
      throw InputError(name, begun, fmt::format("is row {} of too many", number));
    read.cells.resize(read.rows.size() * read.header.size());
  }
  book.sheets.push_back(std::move(read));
}

}  // namespace forest::io
