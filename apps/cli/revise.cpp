// SPDX-License-Identifier: Apache-2.0
// The workbook is compared with the one that would be exported now: rows are found by their keys, columns by their titles,
// so both may be in any order. A cell that differs is an entry of a person, or refused.
#include "apps/cli/revise.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <fstream>
#include <limits>
#include <map>
#include <optional>
#include <set>
#include <span>
#include <tuple>
#include <unordered_map>
#include <vector>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "forest/core/error.h"
#include "forest/core/file.h"
#include "forest/core/number.h"
#include "forest/io/workbook.h"
#include "forest/morphology/measure.h"
#include "forest/morphology/validate.h"
#include "forest/repository/names.h"
#include "forest/repository/repository.h"

#include "apps/cli/console.h"
#include "apps/cli/tables.h"

namespace forest::cli {
namespace {

namespace fs = std::filesystem;
using namespace repository;
using io::ReadCell;
using io::ReadSheet;
using io::TableSheet;
using io::Value;
using Kind = io::ReadCell::Kind;

constexpr std::size_t none = std::size_t(-1);
constexpr std::size_t told = 100;  // cells, unless --verbose

/// Sheets in the order they are looked at.
struct Rule {
  const char* sheet;
  std::vector<std::size_t> keys;  // the columns that tell one row from another; the first is the neuron's id
  const char* remedy;             // for what no person can change there

  bool is_key(std::size_t column) const { return std::ranges::find(keys, column) != keys.end(); }
};
const Rule rules[] = {
    {"neurons", {0}, "it is what Brain Forest knows of the neuron's source"},
    {"points", {0, 1, 2}, "it names the point"},
    {"annotations", {0, 1}, "it names the annotation"},
    {"sections", {0, 2}, "the tree and its kinds are changed in the neuron's file, which is then imported"},
    {"junctions", {0, 2}, "the tree is changed in the neuron's file, which is then imported"},
    {"metrics", {0}, "it follows from the points; correct those on the sheet points"},
};

constexpr const char *follows = "it follows from the points; correct those on the sheet points",
                     *on_neurons = "change it on the sheet neurons";
/// What to do instead of changing these.
struct Remedy {
  const char *sheet, *column, *remedy;
};
constexpr Remedy remedies[] = {
    {"neurons", "population", "a neuron stays in its population; import its file into the other one"},
    {"neurons", "stems", follows},
    {"neurons", "sections", follows},
    {"neurons", "points", follows},
    {"neurons", "length", follows},
    {"neurons", "soma_x", follows},
    {"neurons", "soma_y", follows},
    {"neurons", "soma_z", follows},
    {"neurons", "soma_radius", follows},
    {"neurons", "soma_area", follows},
    {"sections", "name", on_neurons},
    {"sections", "length", follows},
    {"sections", "area", follows},
    {"sections", "points", follows},
    {"junctions", "name", on_neurons},
    {"metrics", "name", on_neurons},
};

/// Derived numbers that are those of one point: its column on the sheet points, and whether it is the section's last.
struct OfPoint {
  const char *sheet, *column, *points;
  bool last;
};
constexpr OfPoint of_points[] = {{"sections", "start_diameter", "diameter", false},
                                 {"sections", "end_diameter", "diameter", true},
                                 {"junctions", "x", "x", true},
                                 {"junctions", "y", "y", true},
                                 {"junctions", "z", "z", true},
                                 {"junctions", "diameter", "diameter", true}};

constexpr std::array<float Point::*, 3> axes{&Point::x, &Point::y, &Point::z};

/// A number of a workbook, or of a CSV file that writes one with a decimal point.
std::optional<double> number_in(const ReadCell& cell) {
  if (cell.kind == Kind::number) return cell.number;
  if (cell.kind != Kind::word) return std::nullopt;
  const auto number = number_of<double>(cell.text);
  return number && std::isfinite(*number) ? number : std::nullopt;
}

std::optional<std::int64_t> whole_in(const ReadCell& cell) {
  const auto number = number_in(cell);
  if (!number || *number != std::floor(*number) || std::abs(*number) > 1e15) return std::nullopt;
  return std::int64_t(*number);
}

std::string text_of(const ReadCell& cell) {
  return cell.kind == Kind::number ? fmt::format("{}", cell.number) : std::string(cell.text);
}

std::string text_of(const Value& value) {
  if (const auto* text = std::get_if<std::string>(&value)) return *text;
  if (const auto* whole = std::get_if<std::int64_t>(&value)) return fmt::format("{}", *whole);
  if (const auto* number = std::get_if<double>(&value); number && std::isfinite(*number))
    return fmt::format("{}", *number);
  return "";
}

/// "'axon'" or "nothing".
std::string quoted(const std::string& text) { return text.empty() ? "nothing" : shown(text); }

/// Whether the cell is as it was written, though another program has saved it since: some keep 15 digits of a number. What is
/// derived was once written with more digits than those of a picometre.
bool same(const Value& stored, const ReadCell& cell, bool entry) {
  if (const auto* text = std::get_if<std::string>(&stored)) {
    if (cell.kind == Kind::error || cell.kind == Kind::formula) return false;
    const std::string is = text_of(cell);
    return is == *text || is == io::cell_text(*text) || escaped(unescaped(is)) == *text;
  }
  if (text_of(stored).empty()) return cell.kind == Kind::empty;
  const auto* whole = std::get_if<std::int64_t>(&stored);
  const double was = whole ? double(*whole) : std::get<double>(stored);
  const auto is = number_in(cell);
  if (!is) return false;
  return entry ? float(*is) == float(was)
               : std::abs(*is - was) <= 1e-6 + 1e-12 * std::max(std::abs(*is), std::abs(was));
}

/// What is wrong with a number of a person, or "".
std::string number_fault(const ReadCell& cell, bool diameter) {
  if (cell.kind == Kind::formula)
    return "it is a formula without a value; save the workbook with a spreadsheet";
  if (cell.kind == Kind::empty)
    return "it is empty; give a number (points are added and removed in the neuron's file)";
  const auto number = number_in(cell);
  if (!number) return "it is no number; give one in µm, with a decimal point";
  if (std::abs(*number) > double(std::numeric_limits<float>::max()))
    return "it is too large; give a number in µm";
  if (diameter && *number < 0.) return "a diameter is not negative; give it in µm";
  return "";
}

std::string text_fault(const ReadCell& cell) {
  switch (cell.kind) {
    case Kind::number:
    case Kind::boolean:
      return "it is no text; format the cell as text and type it again";
    case Kind::error:
      return "it shows an error; type the text";
    case Kind::formula:
      return "it is a formula without a value; save the workbook with a spreadsheet";
    default:
      return "";
  }
}

/// A cell that differs, or something else that does not fit. With `why` it is refused.
struct Finding {
  std::string place, neuron, column, before, after, why;
};

/// A neuron and what it is to become.
struct Draft {
  NeuronRow row, now;
  std::string version;
  bool stale = false;  // the repository's has changed since the export
  std::string name_place;
  std::size_t first_point = none;  // its first row of the sheet points
  std::optional<Morphology> morphology;
  std::vector<Point> soma, points;
  Annotations annotations;
  bool changed = false, shaped = false, moved = false;  // anything; points or annotations; points
  std::size_t findings = 0;
};

/// Spines stay at their segments, as far along them as they were.
float moved_along(std::span<const Point> before, std::span<const Point> after, float position) {
  double left = double(position), done = 0.;
  for (std::size_t i = 1; i < before.size(); ++i) {
    const double was = segment_length(before[i - 1], before[i]), is = segment_length(after[i - 1], after[i]);
    if (left <= was) return float(done + (was > 0. ? left / was : 0.) * is);
    left -= was, done += is;
  }
  return float(done + left);
}

class Revising {
 public:
  Revising(const ReviseOptions& options, io::ReadWorkbook book, Console& console)
      : options_(options),
        book_(std::move(book)),
        console_(console),
        repository_(Repository::open(options.repo, Access::read)) {}

  void run() {
    find_neurons();
    if (drafts_.empty() && refused_.empty())
      throw InputError(options_.workbook.string(), 0,
                       "names no neuron on its sheet neurons; export it again");
    compare();
    check_names();
    for (Draft& draft : drafts_)
      if (draft.moved) mend_joints(draft);
    std::vector<Revision> revisions;
    if (refused_.empty()) revisions = revise_drafts();
    const bool store = refused_.empty() && !options_.dry_run && !revisions.empty();
    if (store) Repository::open(options_.repo, Access::write).revise(revisions);
    tell(revisions.size(), store);
  }

 private:
  // ── Which neurons ──

  void find_neurons() {
    const ReadSheet* sheet = book_.find("neurons");
    const std::string file = options_.workbook.string();
    if (!sheet)
      throw InputError(file, 0,
                       "has no sheet neurons, so brainforest export did not write it; name one it wrote");
    const auto column = [&](std::string_view title) {
      const auto found = std::ranges::find(sheet->header, title);
      if (found == sheet->header.end())
        throw InputError(
            file, 0,
            fmt::format("its sheet neurons has no column {}; export it again with this Brain Forest", title));
      return std::size_t(found - sheet->header.begin());
    };
    const std::size_t id = column("id"), version = column("version");
    std::map<std::int64_t, NeuronRow> stored;
    for (NeuronRow& row : repository_.neurons()) stored.emplace(std::int64_t(row.id.value()), std::move(row));
    std::map<std::int64_t, std::size_t> seen;  // its row
    for (std::size_t r = 0; r < sheet->rows.size(); ++r) {
      const ReadCell& cell = sheet->cell(r, id);
      const auto number = whole_in(cell);
      const auto refuse_row = [&](const std::string& why) {
        refuse({sheet->place(r, id), "", "id", "", text_of(cell), why});
      };
      if (!number) {
        refuse_row("it is no neuron's id; bring it back, or delete the row");
      } else if (const auto [first, fresh] = seen.emplace(*number, r); !fresh) {
        refuse_row(fmt::format("the neuron stands at {} too; delete one of the two rows",
                               sheet->place(first->second, id)));
      } else if (!stored.contains(*number)) {
        refuse_row(
            "there is no such neuron in the repository; delete its rows, or import it and export again");
      }
    }
    std::vector<NeuronId> ids;
    for (const auto& [number, r] : seen)
      if (const auto row = stored.find(number); row != stored.end()) {
        Draft& draft = drafts_.emplace_back();
        index_[number] = drafts_.size() - 1;
        draft.row = draft.now = row->second;
        ids.push_back(draft.row.id);
      } else {
        gone_.insert(number);
      }
    const auto versions = repository_.versions(ids);
    for (std::size_t i = 0; i < drafts_.size(); ++i) {
      const ReadCell& cell = sheet->cell(seen.at(std::int64_t(ids[i].value())), version);
      drafts_[i].version = versions[i];
      drafts_[i].stale = text_of(cell) != versions[i];
    }
  }

  Draft* draft_of(std::int64_t id) {
    const auto found = index_.find(id);
    return found == index_.end() ? nullptr : &drafts_[found->second];
  }

  // ── Cell by cell ──

  /// A stored sheet beside the one that was read.
  struct Pair {
    const Rule& rule;
    const TableSheet& stored;
    const ReadSheet& read;
    std::vector<std::size_t> at = {};      // the read column of each stored one
    std::vector<std::size_t> row_of = {};  // the read row of each stored one
  };

  void compare() {
    std::vector<NeuronRow> rows;
    for (const Draft& draft : drafts_) rows.push_back(draft.row);
    if (rows.empty()) return;
    tables_ = sheets_of(repository_, rows, book_.find("points") != nullptr);
    for (const ReadSheet& sheet : book_.sheets)
      if (sheet.name != "summary" && std::ranges::find(rules, sheet.name, &Rule::sheet) == std::end(rules))
        notes_.push_back(fmt::format("the sheet {} is not Brain Forest's and is not read", sheet.name));
    for (const Rule& rule : rules) {
      const ReadSheet* read = book_.find(rule.sheet);
      if (!read) {
        notes_.push_back(fmt::format("there is no sheet {}, so nothing of it changes", rule.sheet));
        continue;
      }
      const TableSheet& stored = *std::ranges::find(tables_, std::string_view(rule.sheet), &TableSheet::name);
      Pair& pair = pairs_.emplace(rule.sheet, Pair{rule, stored, *read}).first->second;
      if (match_columns(pair)) compare_rows(pair);
    }
  }

  /// False when a row cannot be told from another.
  bool match_columns(Pair& pair) {
    const ReadSheet& read = pair.read;
    std::vector<bool> known(read.header.size());
    bool keyed = true;
    for (std::size_t c = 0; c < pair.stored.columns.size(); ++c) {
      const io::TableColumn& column = pair.stored.columns[c];
      pair.at.push_back(none);
      for (std::size_t h = 0; h < read.header.size(); ++h) {
        const std::string& title = read.header[h];
        const auto refuse_header = [&](const std::string& why) {
          refuse({read.place(ReadSheet::top, h), "", "header", column.title(), title, why});
        };
        if (title == column.title()) {
          if (pair.at[c] != none) refuse_header("the column is there twice; delete one of the two");
          pair.at[c] = h, known[h] = true;
        } else if (!column.unit.empty() && (title == column.name || title.starts_with(column.name + " ("))) {
          refuse_header("another unit is not converted; bring the header and its numbers back");
          known[h] = true;
        }
      }
      if (pair.at[c] != none) continue;
      if (pair.rule.is_key(c)) {
        refuse({read.name, "", "header", column.title(), "", "the column is missing; bring it back"});
        keyed = false;
      } else {
        notes_.push_back(fmt::format("the sheet {} has no column {}, so nothing of it changes", read.name,
                                     column.title()));
      }
    }
    for (std::size_t h = 0; h < read.header.size(); ++h)
      if (!known[h] && !read.header[h].empty())
        notes_.push_back(fmt::format("the column {} at {} is not Brain Forest's and is not read",
                                     shown(read.header[h]), read.place(ReadSheet::top, h)));
    return keyed;
  }

  static std::string key_of(const Pair& pair, std::size_t row) {
    std::string key;
    for (const std::size_t k : pair.rule.keys) {
      const ReadCell& cell = pair.read.cell(row, pair.at[k]);
      const auto number = whole_in(cell);
      key += (key.empty() ? "" : "/") + (number ? fmt::format("{}", *number) : text_of(cell));
    }
    return key;
  }

  static std::string stored_key(const Pair& pair, std::size_t row) {
    std::string key;
    for (const std::size_t k : pair.rule.keys)
      key += (key.empty() ? "" : "/") + text_of(pair.stored.rows[row][k]);
    return key;
  }

  void compare_rows(Pair& pair) {
    const auto& rows = pair.stored.rows;
    const std::string_view name = pair.rule.sheet;
    std::unordered_map<std::string, std::size_t> found;
    found.reserve(rows.size());
    for (std::size_t s = 0; s < rows.size(); ++s) {
      found.emplace(stored_key(pair, s), s);
      if (name == "points")
        if (Draft& draft = *draft_of(std::get<std::int64_t>(rows[s][0])); draft.first_point == none)
          draft.first_point = s;
    }
    pair.row_of.assign(rows.size(), none);
    std::set<std::int64_t> strays;
    for (std::size_t r = 0; r < pair.read.rows.size(); ++r) {
      const std::string key = key_of(pair, r);
      const auto row = found.find(key);
      if (row == found.end()) {
        if (name != "neurons") unknown_row(pair, r, key, strays);  // those have been told
      } else if (std::size_t& at = pair.row_of[row->second]; at == none) {
        at = r;
        compare_row(pair, row->second, r);
      } else if (name != "neurons") {
        refuse({pair.read.place(r, pair.at[0]), "", "row", "", key,
                fmt::format("the same row stands at {}; delete one of the two",
                            pair.read.place(at, pair.at[0]))});
      }
    }
    std::map<std::int64_t, std::pair<std::string, std::size_t>> missing;  // the first, and how many
    for (std::size_t s = 0; s < rows.size(); ++s)
      if (const auto id = std::get<std::int64_t>(rows[s][0]);
          pair.row_of[s] == none && !draft_of(id)->stale) {
        auto& [first, count] = missing[id];
        if (!count++) first = stored_key(pair, s);
      }
    for (const auto& [id, what] : missing)
      refuse({pair.read.name, draft_of(id)->row.name, "row", what.first, "",
              fmt::format("{}; nothing is removed in a workbook, so bring {} back",
                          what.second == 1 ? "the row is missing"
                                           : fmt::format("{} rows from this one on are missing", what.second),
                          what.second == 1 ? "it" : "them")});
  }

  void unknown_row(Pair& pair, std::size_t r, const std::string& key, std::set<std::int64_t>& strays) {
    const auto id = whole_in(pair.read.cell(r, pair.at[0]));
    Draft* draft = id ? draft_of(*id) : nullptr;
    const std::string place = pair.read.place(r, pair.at[0]);
    if (id && gone_.contains(*id)) return;  // told on the sheet neurons
    if (id && !draft) {
      if (strays.insert(*id).second)
        refuse({place, "", "row", "", key,
                "the neuron has no row on the sheet neurons; bring it back, or delete its rows here too"});
      return;
    }
    if (draft && std::string_view(pair.rule.sheet) == "annotations" &&
        pair.read.cell(r, pair.at[1]).kind == Kind::empty) {
      add_annotation(pair, r, *draft);
      return;
    }
    refuse({place, draft ? draft->row.name : "", "row", "", key,
            draft && draft->stale ? stale
            : std::string_view(pair.rule.sheet) == "annotations"
                ? "there is no such annotation; leave the number of a new one empty"
                : "there is no such row; nothing is added in a workbook, so delete it or mend its numbers"});
  }

  void compare_row(Pair& pair, std::size_t s, std::size_t r) {
    const auto& row = pair.stored.rows[s];
    Draft& draft = *draft_of(std::get<std::int64_t>(row[0]));
    for (std::size_t c = 0; c < row.size(); ++c) {
      if (pair.at[c] == none || pair.rule.is_key(c)) continue;
      const io::TableColumn& column = pair.stored.columns[c];
      const ReadCell& cell = pair.read.cell(r, pair.at[c]);
      if (column.name == "version") continue;  // find_neurons has looked at it
      if (same(row[c], cell, column.entry)) continue;
      if (draft.stale && (!column.entry || is_joint(pair, draft, s, column.name)))
        continue;  // it follows from what changed since
      if (!column.entry && column.name == "name" && text_of(cell) == draft.now.name) continue;
      Finding finding{
          pair.read.place(r, pair.at[c]), draft.row.name, column.title(), text_of(row[c]), text_of(cell), ""};
      if (!column.entry)
        finding.why = remedy(pair, column.name, row);
      else if (draft.stale)
        finding.why = stale;
      else if (!column.unit.empty())
        finding.why = number_fault(cell, column.name == "diameter");
      else
        finding.why = text_fault(cell);
      if (finding.why.empty() && !column.unit.empty())  // as it will be stored
        finding.after = fmt::format("{}", float(*number_in(cell)));
      if (finding.why.empty()) finding.why = enter(pair, draft, s, column.name, cell, finding.place);
      if (finding.why.empty())
        accept(draft, std::move(finding));
      else
        refuse(std::move(finding));
    }
  }

  /// Whether this is where a section begins, and that is where its parent ends.
  bool is_joint(const Pair& pair, Draft& draft, std::size_t s, const std::string& column) {
    if (std::string_view(pair.rule.sheet) != "points" || column == "diameter") return false;
    const auto* section = std::get_if<std::int64_t>(&pair.stored.rows[s][1]);
    if (!section || std::get<std::int64_t>(pair.stored.rows[s][2]) != 0) return false;
    load(draft);
    return draft.morphology->section(SectionId(std::size_t(*section))).parent.valid();
  }

  /// What to do instead of changing a cell of this column.
  std::string remedy(const Pair& pair, const std::string& column, const std::vector<Value>& row) {
    const std::string_view sheet = pair.rule.sheet;
    for (const OfPoint& of : of_points)
      if (of.sheet == sheet && of.column == column) {
        const auto id = std::get<std::int64_t>(row[0]),
                   section = std::get<std::int64_t>(row[pair.rule.keys[1]]);
        return fmt::format("it is that of a point; correct {}",
                           point_place(*draft_of(id), std::size_t(section), of.last, of.points));
      }
    for (const Remedy& r : remedies)
      if (r.sheet == sheet && r.column == column) return r.remedy;
    return fmt::format("{}; bring the old value back", pair.rule.remedy);
  }

  /// "points!D17", or that sheet.
  std::string point_place(Draft& draft, std::size_t section, bool last, std::string_view column) {
    const auto points = pairs_.find("points");
    if (points == pairs_.end() || draft.first_point == none)
      return "it on the sheet points of a workbook that has one";
    load(draft);
    const Section& s = draft.morphology->section(SectionId(section));
    return place_of(draft, draft.soma.size() + s.first_point + (last ? s.point_count - 1 : 0), column);
  }

  /// Of a point, counted from the first of the neuron's soma.
  std::string place_of(const Draft& draft, std::size_t point, std::string_view column) {
    const Pair& pair = pairs_.at("points");
    const auto& columns = pair.stored.columns;
    const auto at = std::size_t(std::ranges::find(columns, column, &io::TableColumn::name) - columns.begin());
    const std::size_t row = pair.row_of[draft.first_point + point];
    return row == none || pair.at[at] == none ? "the sheet points" : pair.read.place(row, pair.at[at]);
  }

  void load(Draft& draft) {
    if (draft.morphology) return;
    draft.morphology = repository_.morphology(draft.row.id);
    draft.soma = draft.morphology->soma().points;
    draft.points.assign(draft.morphology->points().begin(), draft.morphology->points().end());
    draft.annotations = draft.morphology->annotations();
  }

  /// Takes over an entry. Returns why it cannot be, or "".
  std::string enter(const Pair& pair, Draft& draft, std::size_t s, const std::string& column,
                    const ReadCell& cell, const std::string& place) {
    const std::string_view sheet = pair.rule.sheet;
    if (sheet == "points") {
      load(draft);
      const std::size_t at = s - draft.first_point, in_soma = draft.soma.size();
      Point& point = at < in_soma ? draft.soma[at] : draft.points[at - in_soma];
      const auto value = float(*number_in(cell));
      (column == "x"   ? point.x
       : column == "y" ? point.y
       : column == "z" ? point.z
                       : point.radius) = column == "diameter" ? value / 2.f : value;
      draft.shaped = draft.moved = true;
      return "";
    }
    const std::string text(cell.text);
    if (const std::string was = text_of(pair.stored.rows[s][std::size_t(
            std::ranges::find(pair.stored.columns, column, &io::TableColumn::name) -
            pair.stored.columns.begin())]);
        io::cell_text(was).size() < was.size())
      return "only its beginning fits into a cell; change it in the neuron's file, or in the CSV files";
    if (sheet == "annotations") {
      load(draft);
      auto& [name, value] = draft.annotations[std::size_t(std::get<std::int64_t>(pair.stored.rows[s][1]))];
      (column == "name" ? name : value) = unescaped(text);
      draft.shaped = true;
    } else if (column == "name") {
      if (!is_name(text))
        return fmt::format("it is no name; take 1 to {} bytes of UTF-8 without control characters", max_name);
      draft.now.name = text;
      draft.name_place = place;
    } else {
      (column == "species"  ? draft.now.species
       : column == "region" ? draft.now.region
       : column == "layer"  ? draft.now.layer
                            : draft.now.type) = unescaped(text);
    }
    return "";
  }

  /// One that is there already, perhaps from this very workbook, is not added again.
  void add_annotation(Pair& pair, std::size_t r, Draft& draft) {
    load(draft);
    std::pair<std::string, std::string> words;
    std::vector<Finding> findings;
    for (const auto& [c, word] : {std::pair{2, &words.first}, std::pair{3, &words.second}}) {
      const std::size_t at = pair.at[std::size_t(c)];
      if (at == none || pair.read.cell(r, at).kind == Kind::empty) continue;
      const ReadCell& cell = pair.read.cell(r, at);
      *word = unescaped(text_of(cell));
      findings.push_back({pair.read.place(r, at), draft.row.name, pair.stored.columns[std::size_t(c)].title(),
                          "", text_of(cell), draft.stale ? stale : text_fault(cell)});
    }
    if (std::ranges::find(draft.annotations, words) != draft.annotations.end()) return;
    bool good = true;
    for (Finding& finding : findings) {
      good = good && finding.why.empty();
      finding.why.empty() ? accept(draft, std::move(finding)) : refuse(std::move(finding));
    }
    if (good) draft.annotations.push_back(std::move(words)), draft.shaped = true;
  }

  // ── The neurons as wholes ──

  /// Names are unique in a population, when all of them are as they will be.
  void check_names() {
    if (std::ranges::none_of(drafts_, [](const Draft& d) { return d.now.name != d.row.name; })) return;
    std::map<std::pair<std::string, std::string>, std::int64_t> taken;  // by population and name
    for (const NeuronRow& row : repository_.neurons()) {
      const auto id = std::int64_t(row.id.value());
      if (const Draft* draft = draft_of(id); !draft || draft->now.name == row.name)
        taken[{row.population, row.name}] = id;
    }
    for (const Draft& draft : drafts_)
      if (draft.now.name != draft.row.name)
        if (const auto [other, fresh] =
                taken.emplace(std::pair{draft.row.population, draft.now.name}, draft.row.id.value());
            !fresh)
          refuse({draft.name_place, draft.row.name, "name", draft.row.name, draft.now.name,
                  fmt::format("neuron {} of the population has that name; choose another", other->second)});
  }

  /// A section begins where its parent ends: it goes with it, and nowhere else.
  void mend_joints(Draft& draft) {
    const Morphology& old = *draft.morphology;
    for (std::size_t i = 0; i < old.sections().size(); ++i) {
      const Section& section = old.sections()[i];
      if (!section.parent.valid()) continue;
      const Section& above = old.section(section.parent);
      const std::size_t end = above.first_point + above.point_count - 1, begin = section.first_point;
      for (std::size_t axis = 0; axis < axes.size(); ++axis) {
        const float joint = draft.points[end].*axes[axis], was = old.points()[begin].*axes[axis];
        float& is = draft.points[begin].*axes[axis];
        if (is != joint && is != was) {
          constexpr std::array<const char*, 3> names{"x", "y", "z"};
          const std::size_t soma = draft.soma.size();
          refuse({place_of(draft, soma + begin, names[axis]), draft.row.name,
                  fmt::format("{} (µm)", names[axis]), fmt::format("{}", was), fmt::format("{}", is),
                  fmt::format("section {} begins where section {} ends; correct {}, and this follows", i,
                              section.parent.value(), place_of(draft, soma + end, names[axis]))});
        }
        is = joint;
      }
    }
  }

  std::vector<Revision> revise_drafts() {
    std::vector<Revision> revisions;
    for (Draft& draft : drafts_) {
      if (!draft.changed) continue;
      Revision& revision =
          revisions.emplace_back(Revision{draft.row.id, draft.version, draft.now.name, draft.now.species,
                                          draft.now.region, draft.now.layer, draft.now.type, std::nullopt});
      if (!draft.shaped) continue;
      const Morphology& old = *draft.morphology;
      MorphologyBuilder builder;
      Soma soma = old.soma();
      soma.points = draft.soma;
      builder.set_soma(std::move(soma));
      builder.add_sections(draft.points, {old.sections().begin(), old.sections().end()});
      for (Spine spine : old.spines()) {
        const Section& s = old.section(spine.section);
        const std::span after = std::span(draft.points).subspan(s.first_point, s.point_count);
        if (!std::ranges::equal(old.points(spine.section), after))
          spine.position = moved_along(old.points(spine.section), after, spine.position);
        builder.add_spine(spine);
      }
      const std::pair<std::string, std::string> origin{
          "corrected", fmt::format("points, in the workbook {}", options_.workbook.filename().string())};
      if (draft.moved && std::ranges::find(draft.annotations, origin) == draft.annotations.end())
        draft.annotations.push_back(origin);
      for (auto& [name, value] : draft.annotations) builder.annotate(name, value);
      revision.morphology = builder.build();
      if (draft.moved) look_over(draft, *revision.morphology);
    }
    return revisions;
  }

  /// What is odd now and was not before: mostly a slip of the decimal point.
  void look_over(const Draft& draft, const Morphology& now) {
    std::set<std::tuple<std::string_view, std::uint32_t, std::int64_t>> known;
    const auto key = [](const forest::Finding& f) {
      return std::tuple(f.code, f.section.valid() ? f.section.value() : std::uint32_t(-1), f.point);
    };
    for (const forest::Finding& f : validate(*draft.morphology)) known.insert(key(f));
    for (const forest::Finding& f : validate(now))
      if (!known.contains(key(f)))
        notes_.push_back(fmt::format("neuron {} has become odd: {}", shown(draft.row.name), f.sentence));
  }

  // ── Telling ──

  void accept(Draft& draft, Finding finding) {
    draft.changed = true;
    changed_.push_back(std::move(finding));
  }
  void refuse(Finding finding) { refused_.push_back(std::move(finding)); }

  void tell(std::size_t neurons, bool stored) {
    const std::string file = options_.workbook.string();
    const auto enough = [&](std::size_t count) { return options_.verbose ? count : std::min(count, told); };
    for (const std::string& note : notes_) console_.warn(fmt::format("{}: {}", escaped(file), note));
    nlohmann::ordered_json changed = nlohmann::ordered_json::array(), refused = changed;
    std::vector<std::vector<std::string>> lines;
    for (const Finding& f : changed_) {
      changed.push_back({{"cell", f.place},
                         {"neuron", f.neuron},
                         {"column", f.column},
                         {"before", f.before},
                         {"after", f.after}});
      if (lines.size() < enough(changed_.size()))
        lines.push_back({f.place, f.neuron, f.column, f.before, f.after});
    }
    if (!lines.empty()) console_.table({"cell", "neuron", "column", "before", "after"}, lines);
    if (lines.size() < changed_.size())
      console_.say(fmt::format("… and {} more, shown by --verbose", changed_.size() - lines.size()));
    for (const Finding& f : refused_) {
      refused.push_back({{"cell", f.place},
                         {"neuron", f.neuron},
                         {"column", f.column},
                         {"before", f.before},
                         {"after", f.after},
                         {"why", f.why}});
      if (refused.size() <= enough(refused_.size()))
        console_.warn(fmt::format("{}: {}: {}{} is {} instead of {}; {}", escaped(file), f.place, f.column,
                                  f.neuron.empty() ? "" : " of neuron " + shown(f.neuron), quoted(f.after),
                                  quoted(f.before), f.why));
    }
    if (const std::size_t shown_count = enough(refused_.size()); shown_count < refused_.size())
      console_.warn(fmt::format("… and {} more, shown by --verbose", refused_.size() - shown_count));
    const std::string cells = counted(changed_.size(), "cell"), of = counted(neurons, "neuron");
    if (refused_.empty())
      console_.say(changed_.empty() ? "nothing changed"
                   : stored         ? fmt::format("{} of {} changed in {}", cells, of, options_.repo)
                                    : fmt::format("{} of {} would change; nothing is stored", cells, of));
    console_.print({{"workbook", escaped(file)},
                    {"repository", options_.repo},
                    {"neurons", drafts_.size()},
                    {"stored", stored},
                    {"changed", changed},
                    {"refused", refused},
                    {"notes", notes_}});
    if (!refused_.empty())
      throw Error(
          fmt::format("{} refused, so nothing is stored; mend what the sentences above name",
                      refused_.size() == 1 ? "1 cell is" : fmt::format("{} cells are", refused_.size())));
  }

  static constexpr const char* stale =
      "the neuron in the repository has changed since the workbook was written; export it again and repeat "
      "the change there";

  const ReviseOptions& options_;
  io::ReadWorkbook book_;
  Console& console_;
  Repository repository_;
  std::vector<TableSheet> tables_;
  std::map<std::string_view, Pair> pairs_;
  std::vector<Draft> drafts_;
  std::unordered_map<std::int64_t, std::size_t> index_;  // of drafts_, by id
  std::set<std::int64_t> gone_;                          // in the workbook, not in the repository
  std::vector<Finding> changed_, refused_;
  std::vector<std::string> notes_;
};

fs::path sheet_file(const fs::path& folder, std::string_view sheet) {
  return folder / fmt::format("{}.csv", sheet);
}

}  // namespace

bool is_workbook(const fs::path& path) {
  std::error_code ignored;
  const auto begin_of = [](const fs::path& file,
                           std::size_t bytes) {  // "" of what cannot be read, which is told later
    std::string begin(bytes, '\0');
    std::ifstream stream(file, std::ios::binary);
    stream.read(begin.data(), std::streamsize(bytes));
    begin.resize(std::size_t(stream.gcount()));
    return begin;
  };
  if (fs::is_directory(path, ignored)) {
    const fs::path neurons = sheet_file(path, "neurons");
    return fs::is_regular_file(neurons, ignored) &&
           begin_of(neurons, 1000).find("version") != std::string::npos;
  }
  return fs::is_regular_file(path, ignored) &&
         (path.extension() == ".xlsx" || io::recognises_workbook(begin_of(path, 4)));
}

namespace {

void read_sheet(io::ReadWorkbook& book, const std::string& sheet, const fs::path& path) {
  const MappedFile file(path);
  const std::string_view text = file.text();
  if (const std::size_t good = repository::utf8_bytes(text); good < text.size())
    throw InputError(path.string(), std::size_t(1 + std::ranges::count(text.substr(0, good), '\n')),
                     "is not UTF-8; save it as \"CSV UTF-8\"");
  io::read_csv(book, sheet, text, path.string());
}

}  // namespace

void revise(const ReviseOptions& options, Console& console) {
  std::error_code ignored;
  io::ReadWorkbook book;
  if (fs::is_directory(options.workbook, ignored)) {
    for (const Rule& rule : rules)
      if (const fs::path file = sheet_file(options.workbook, rule.sheet); fs::exists(file, ignored))
        read_sheet(book, std::string(rule.sheet), file);
  } else {
    book = io::read_workbook(MappedFile(options.workbook).text(), options.workbook.string());
  }
  Revising(options, std::move(book), console).run();
}

}  // namespace forest::cli
