// SPDX-License-Identifier: Apache-2.0
// brainforest measure: the metrics of neurons, or of groups of them, as a table, CSV, workbook or JSON.
#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <limits>
#include <map>
#include <memory>
#include <numeric>
#include <set>
#include <utility>
#include <variant>

#include <CLI/App.hpp>
#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "forest/core/error.h"
#include "forest/core/file.h"
#include "forest/core/parallel.h"
#include "forest/io/format.h"
#include "forest/io/workbook.h"
#include "forest/repository/repository.h"
#include "forest/statistics/barcode.h"
#include "forest/statistics/metric.h"
#include "forest/statistics/summary.h"

#include "apps/cli/console.h"
#include "apps/cli/filed_neurons.h"
#include "apps/cli/files.h"
#include "apps/cli/neurons.h"
#include "apps/cli/options.h"
#include "apps/cli/samples.h"
#include "apps/cli/verb.h"

namespace forest::cli {
namespace {

using namespace statistics;
using Picks = std::vector<const Metric*>;

struct Options {
  std::vector<std::string> files;  // or folders
  std::string repo, population;
  std::vector<std::string> metrics;
  std::string kind = "all", level = "neuron", by;
  std::filesystem::path csv, xlsx;
  bool list = false, force = false, store = false;
};

/// What the terminal shows of several neurons when no metric is asked for; all of them would not fit.
constexpr std::array<std::string_view, 8> headline{
    "number_of_neurites", "number_of_leaves",  "max_branch_order", "total_length",
    "total_area",         "max_path_distance", "contraction",      "partition_asymmetry"};

constexpr std::array<std::pair<std::string_view, double Summary::*>, 5> parts{{{"mean", &Summary::mean},
                                                                               {"sd", &Summary::sd},
                                                                               {"min", &Summary::min},
                                                                               {"median", &Summary::median},
                                                                               {"max", &Summary::max}}};

/// Of one value nothing can be said.
double spread(const Summary& s) { return s.count > 1 ? s.sd : std::numeric_limits<double>::quiet_NaN(); }

using Cell = std::variant<std::string, double>;  // NaN: not defined
using Row = std::vector<Cell>;

struct Column {
  std::string name;
  std::string_view unit;
  bool brief = true;  // shown on the terminal

  std::string title() const { return unit.empty() ? name : fmt::format("{} ({})", name, unit); }
};

/// What neurons of a repository may be grouped by.
constexpr std::array<std::pair<std::string_view, std::string repository::NeuronRow::*>, 5> groupings{
    {{"type", &repository::NeuronRow::type},
     {"layer", &repository::NeuronRow::layer},
     {"region", &repository::NeuronRow::region},
     {"species", &repository::NeuronRow::species},
     {"population", &repository::NeuronRow::population}}};

constexpr const char* measuring = "measuring";

/// Neurons to measure, whatever they come from.
struct Neurons {
  std::vector<std::string> names, groups;      // groups: only with --by; of a file its folder
  std::vector<repository::NeuronId> ids;       // of a repository's
  std::function<void(const UseNeuron&)> each;  // as each_neuron()
  std::function<std::string()> guesses = [] { return std::string(); };  // what reading guessed, a sentence
  std::function<bool(const Error&, std::size_t)> may_skip;              // of a file's, as in files.h
};

Neurons of_files(const Options& options, Console& console) {
  const auto files = std::make_shared<const FiledNeurons>(neuron_files(options.files, console));
  Neurons neurons;
  neurons.names.resize(files->size());
  parallel_for(files->size(), 64, [&](std::size_t i) {
    const std::string cell = files->cell(i);
    neurons.names[i] = (cell.empty() ? files->file(i) : files->file(i) / cell).string();
  });
  if (!options.by.empty()) neurons.groups = folder_names(files->each());
  neurons.each = [files, &progress = console.progress()](const UseNeuron& use) {
    progress.begin(measuring, files->size());
    parallel_for(files->size(), 8, [&](std::size_t i) {
      use(i, [&] { return files->read(i); });
      progress.advance();
    });
    progress.end();
  };
  neurons.guesses = [files] { return files->guesses(); };
  neurons.may_skip = [files, named = options.files](const Error& error, std::size_t i) {
    return may_skip(error, files->file(i), named);
  };
  return neurons;
}

Neurons of_repository(const Options& options, Console& console) {
  using namespace repository;
  const auto rows = pick_neurons(Repository::open(options.repo, Access::read), {}, options.population);
  if (rows.empty()) throw Error(fmt::format("{} holds no neuron; import or grow some first", options.repo));
  Neurons neurons;
  for (const NeuronRow& row : rows) {
    neurons.names.push_back(options.population.empty() ? row.population + '/' + row.name : row.name);
    neurons.ids.push_back(row.id);
    for (const auto& [word, member] : groupings)
      if (word == options.by) neurons.groups.push_back(row.*member);
  }
  neurons.each = [place = options.repo, rows, &progress = console.progress()](const UseNeuron& use) {
    each_neuron(place, rows, measuring, progress, use);
  };
  return neurons;
}

Picks pick(const Options& options) {
  Picks picks;
  for (const std::string& name : options.metrics)
    if (const Metric* m = find_metric(name); !std::ranges::count(picks, m)) picks.push_back(m);
  for (const Metric& m : metrics())
    if (options.metrics.empty() && (options.level == "neuron" || name_of(m.level) == options.level))
      picks.push_back(&m);
  return picks;
}

// What tells the rows of a neuron apart.
struct Keys {
  std::string_view level;
  std::vector<Column> columns;
  std::vector<Row> (*rows)(const Arbors&);
};

Cell kind(const Arbors& arbors, const Branch& b) {
  return std::string(name_of(arbors.neuron().section(b.id).kind));
}
Cell number(const Branch& b) { return double(b.id.value()); }

std::vector<Row> of_arbors(const Arbors& arbors) {
  std::vector<Row> rows;
  for (std::size_t i = 0; i < arbors.stems().size(); ++i)
    rows.push_back({double(i), kind(arbors, arbors.section(arbors.stems()[i]))});
  return rows;
}
std::vector<Row> of_sections(const Arbors& arbors) {
  std::vector<Row> rows;
  for (const Branch& b : arbors.sections()) rows.push_back({number(b), kind(arbors, b)});
  return rows;
}
std::vector<Row> of_bifurcations(const Arbors& arbors) {
  std::vector<Row> rows;
  for (const Bifurcation& b : arbors.bifurcations()) rows.push_back({number(arbors.section(b.parent))});
  return rows;
}
std::vector<Row> of_points(const Arbors& arbors) {
  std::vector<Row> rows;
  for (const Branch& b : arbors.sections())
    for (std::uint32_t i = 1; i < b.row_count; ++i) rows.push_back({number(b), double(i)});
  return rows;
}
std::vector<Row> of_bars(const Arbors& arbors) {
  std::vector<Row> rows;
  const Barcodes barcodes(arbors, Filtration::path);
  for (std::size_t i = 0; i < barcodes.size(); ++i)
    for (std::size_t k = 0; k < barcodes.of_arbor(i).size(); ++k) rows.push_back({double(i), double(k)});
  return rows;
}
std::vector<Row> as_measured(const Arbors&) { return {}; }  // how many there are the metrics say

const Keys& keys_of(std::string_view level) {
  static const std::array<Keys, 7> all{{{"neuron", {}, as_measured},
                                        {"arbor", {{"arbor", ""}, {"kind", ""}}, of_arbors},
                                        {"section", {{"section", ""}, {"kind", ""}}, of_sections},
                                        {"bifurcation", {{"section", ""}}, of_bifurcations},
                                        {"point", {{"section", ""}, {"point", ""}}, of_points},
                                        {"shell", {{"radius", "µm"}}, as_measured},
                                        {"bar", {{"arbor", ""}, {"bar", ""}}, of_bars}}};
  return *std::ranges::find(all, level, &Keys::level);
}

std::vector<Column> columns(const Options& options, const Picks& picks) {
  std::vector<Column> columns{{"neuron", "", true}};
  for (const Column& key : keys_of(options.level).columns) columns.push_back(key);
  for (const Metric* m : picks) {
    const bool brief =
        !options.metrics.empty() || options.level != "neuron" || std::ranges::count(headline, m->name);
    if (options.level != "neuron" || m->level == Level::neuron) {
      columns.push_back({std::string(m->name), m->unit, brief});
    } else {
      for (const auto& [part, member] : parts)
        columns.push_back({fmt::format("{} {}", m->name, part), m->unit, brief && part == "mean"});
    }
  }
  return columns;
}

std::vector<Row> rows(const Options& options, const Picks& picks, const std::string& name,
                      const Arbors& arbors) {
  if (options.level == "neuron") {
    Row row{name};
    for (const Metric* m : picks) {
      const std::vector<double> values = m->values(arbors);
      if (m->level == Level::neuron) {
        row.emplace_back(values[0]);
      } else {
        const Summary summary = summarize(values);
        for (const auto& [part, member] : parts)
          row.emplace_back(member == &Summary::sd ? spread(summary) : summary.*member);
      }
    }
    return {row};
  }
  std::vector<Row> rows;
  for (const Row& keys : keys_of(options.level).rows(arbors)) {
    rows.push_back({name});
    rows.back().insert(rows.back().end(), keys.begin(), keys.end());
  }
  for (const Metric* m : picks) {
    const std::vector<double> values = m->values(arbors);
    for (std::size_t i = rows.size(); i < values.size(); ++i)
      rows.push_back({name, double(i + 1) * sholl_step});
    for (std::size_t i = 0; i < rows.size(); ++i) rows[i].emplace_back(values[i]);
  }
  return rows;
}

/// What is measured of neurons and of groups of them.
struct Table {
  std::vector<Column> columns;
  std::vector<Row> rows;
};

/// A row a group: how many neurons, and over them mean and standard deviation of each metric, of which a neuron's own mean
/// counts where it has many values.
Table grouped(const Options& options, const Table& neurons, const std::vector<std::string>& groups) {
  std::map<std::pair<bool, std::string>, std::vector<const Row*>> members;  // those nobody named come last
  for (std::size_t i = 0; i < neurons.rows.size(); ++i)
    members[{groups[i].empty(), groups[i]}].push_back(&neurons.rows[i]);
  Table table{{{options.by, "", true}, {"neurons", "", true}}, {}};
  for (const auto& [name, rows] : members)
    table.rows.push_back({name.first ? "not said" : name.second, double(rows.size())});
  const auto ends_in = [](const std::string& name, std::string_view part) {
    return name.ends_with(fmt::format(" {}", part));
  };
  for (std::size_t c = 1; c < neurons.columns.size(); ++c) {
    const Column& column = neurons.columns[c];
    if (std::ranges::any_of(parts, [&](const auto& part) {
          return part.first != "mean" && ends_in(column.name, part.first);
        }))
      continue;
    const std::string name = column.name.substr(0, column.name.find(' '));
    table.columns.push_back({name + " mean", column.unit, column.brief});
    table.columns.push_back({name + " sd", column.unit, column.brief});
    auto row = table.rows.begin();
    for (const auto& [group, rows] : members) {
      std::vector<double> values;
      for (const Row* of : rows) values.push_back(std::get<double>((*of)[c]));
      const Summary summary = summarize(values);
      row->emplace_back(summary.mean), row->emplace_back(spread(summary));
      ++row;
    }
  }
  return table;
}

io::TableSheet sheet(std::string name, const Table& table) {
  io::TableSheet sheet{.name = std::move(name), .columns = {}, .rows = {}};
  for (const Column& c : table.columns) sheet.columns.push_back({c.name, std::string(c.unit)});
  for (const Row& row : table.rows) {
    auto& cells = sheet.rows.emplace_back();
    for (const Cell& cell : row) {
      const double* number = std::get_if<double>(&cell);
      if (number && std::isnan(*number))
        cells.emplace_back();
      else
        std::visit([&](const auto& value) { cells.emplace_back(value); }, cell);
    }
  }
  return sheet;
}

nlohmann::ordered_json json(const Options& options, const Table& table) {
  const auto& [columns, rows] = table;
  nlohmann::ordered_json out{{"level", options.level}, {"kind", options.kind}};
  if (!options.by.empty()) out["by"] = options.by;
  auto units = nlohmann::ordered_json::object(), list = nlohmann::ordered_json::array();
  for (const Column& c : columns)
    if (!c.unit.empty()) units[c.name] = c.unit;
  for (const Row& row : rows) {
    nlohmann::ordered_json entry;
    for (std::size_t i = 0; i < row.size(); ++i)
      std::visit([&](const auto& value) { entry[columns[i].name] = value; },
                 row[i]);  // NaN is written as null
    list.push_back(std::move(entry));
  }
  out["units"] = std::move(units), out["rows"] = std::move(list);
  return out;
}

std::string shown(double value) {
  if (std::isnan(value)) return "-";
  if (value == std::round(value) || std::abs(value) >= 1000.) return fmt::format("{:.0f}", value);
  return fmt::format("{:.4g}", value);
}

std::string shown(const Cell& cell) {
  const double* number = std::get_if<double>(&cell);
  return number ? shown(*number) : std::get<std::string>(cell);
}

/// Of files, without their folders where that leaves no two the same.
std::vector<std::string> short_names(const std::vector<Row>& rows) {
  std::map<std::string, std::string> whole;  // by the short one
  std::vector<std::string> names;
  bool unlike = true;
  for (const Row& row : rows) {
    const auto& name = std::get<std::string>(row[0]);
    names.push_back(std::filesystem::path(name).filename());
    unlike = unlike && whole.emplace(names.back(), name).first->second == name;
  }
  for (std::size_t r = 0; !unlike && r < rows.size(); ++r) names[r] = std::get<std::string>(rows[r][0]);
  return names;
}

/// One neuron: a row a metric.
void print_neuron(Console& console, const Picks& picks, const Row& row) {
  std::vector<std::vector<std::string>> lines;
  auto cell = row.begin() + 1;
  for (const Metric* m : picks) {
    auto& line = lines.emplace_back(std::vector{std::string(m->name), std::string(m->unit)});
    const std::size_t width = m->level == Level::neuron ? 1 : parts.size();
    for (std::size_t i = 0; i < parts.size(); ++i) line.push_back(i < width ? shown(*cell++) : "-");
  }
  console.table({"metric", "unit", "value or mean", "sd", "min", "median", "max"}, lines);
}

/// A row a metric, a column a group.
void print_groups(Console& console, const Options& options, const Table& table) {
  std::vector<std::string> header{options.by}, counts{"neurons"};
  for (const Row& row : table.rows) header.push_back(shown(row[0])), counts.push_back(shown(row[1]));
  std::vector<std::vector<std::string>> lines{counts};
  for (std::size_t c = 2; c < table.columns.size(); c += 2) {
    Column metric = table.columns[c];
    if (!metric.brief) continue;
    metric.name = metric.name.substr(0, metric.name.find(' '));
    lines.push_back({metric.title()});
    for (const Row& row : table.rows)
      lines.back().push_back(fmt::format("{} ± {}", shown(row[c]), shown(row[c + 1])));
  }
  console.table(header, lines);
}

/// A row each, and of several neurons their mean and standard deviation.
void print_rows(Console& console, const Options& options, const Table& table) {
  const auto& [columns, rows] = table;
  const bool summaries = options.level == "neuron", files = options.repo.empty();
  const std::vector<std::string> names = files ? short_names(rows) : std::vector<std::string>();
  std::vector<std::string> header;
  std::vector<std::vector<std::string>> lines(rows.size() + (summaries ? 2 : 0));
  for (std::size_t c = 0; c < columns.size(); ++c) {
    if (!columns[c].brief) continue;
    header.push_back(columns[c].title());
    std::vector<double> values;
    for (std::size_t r = 0; r < rows.size(); ++r) {
      lines[r].push_back(c == 0 && files ? names[r] : shown(rows[r][c]));
      if (const double* value = std::get_if<double>(&rows[r][c])) values.push_back(*value);
    }
    if (!summaries) continue;
    const Summary summary = summarize(values);
    lines[rows.size()].push_back(c == 0 ? "mean" : shown(summary.mean));
    lines[rows.size() + 1].push_back(c == 0 ? "sd" : shown(spread(summary)));
  }
  console.table(header, lines);
}

/// Keeps what the rows say of the neurons `ids`: of a metric with many values their mean. Of all metrics, those that can be
/// kept; returns how many they are.
std::size_t store(const Options& options, const Picks& picks, const std::vector<repository::NeuronId>& ids,
                  const std::vector<Row>& rows, Progress& progress) {
  const auto kept = [&](const Metric* m) { return !options.metrics.empty() || repository::can_store(*m); };
  auto repository = repository::Repository::open(options.repo, repository::Access::write);
  auto transaction = repository.begin();
  progress.begin("storing", ids.size());
  std::vector<std::pair<const Metric*, double>> values;
  for (std::size_t i = 0; i < ids.size(); ++i) {
    values.clear();
    auto cell = rows[i].begin() + 1;
    for (const Metric* m : picks) {
      if (kept(m)) values.emplace_back(m, std::get<double>(*cell));
      cell += m->level == Level::neuron ? 1 : std::ptrdiff_t(parts.size());
    }
    repository.store_metrics(ids[i], values);
    progress.advance();
  }
  transaction.commit();
  progress.end();
  return std::size_t(std::ranges::count_if(picks, kept));
}

void list(Console& console) {
  nlohmann::ordered_json out = nlohmann::ordered_json::array();
  std::vector<std::vector<std::string>> lines;
  for (const Metric& m : metrics()) {
    lines.push_back(
        {std::string(m.name), std::string(m.unit), std::string(name_of(m.level)), std::string(m.definition)});
    out.push_back({{"name", m.name},
                   {"unit", m.unit},
                   {"level", name_of(m.level)},
                   {"diameters", m.diameters},
                   {"definition", m.definition},
                   {"source", m.source},
                   {"l_measure", m.l_measure}});
  }
  console.table({"metric", "unit", "level", "definition"}, lines);
  console.print(out);
}

void run(const Options& options, Console& console) {
  if (options.list) return list(console);
  must_take_files({options.csv, options.xlsx}, true);
  must_not_be_cells({options.csv, options.xlsx}, options.files);
  if (!options.xlsx.empty() && !options.force) refuse_existing({options.xlsx});
  const Picks picks = pick(options);
  const KindSet kinds = kind_set(options.kind);

  struct Measured {
    std::vector<Row> rows;
    std::string error;
    bool skipped = false;
  };
  const Neurons neurons = options.repo.empty() ? of_files(options, console) : of_repository(options, console);
  std::vector<Measured> measured(neurons.names.size());
  neurons.each([&](std::size_t i, const auto& neuron) {
    try {
      measured[i].rows = rows(options, picks, neurons.names[i], Arbors(neuron(), kinds));
    } catch (const Error& error) {
      measured[i].error = error.what();
      measured[i].skipped = options.repo.empty() && neurons.may_skip(error, i);
    }
  });
  if (const std::string guesses = neurons.guesses(); !guesses.empty()) console.warn(guesses);

  Table table{columns(options, picks), {}};
  std::vector<std::string> groups;
  std::vector<repository::NeuronId> ids;
  std::set<std::string> told;
  std::size_t failed = 0, unread = 0;
  for (std::size_t i = 0; i < measured.size(); ++i) {
    Measured& m = measured[i];
    if (!m.error.empty()) {
      // A file of many cells says the same of each.
      if (told.insert(m.error).second) console.warn(m.skipped ? m.error + "; skipped" : m.error);
      ++unread, failed += !m.skipped;
    } else {
      if (!options.by.empty()) groups.push_back(neurons.groups[i]);
      if (options.store) ids.push_back(neurons.ids[i]);
    }
    std::ranges::move(m.rows, std::back_inserter(table.rows));
  }
  if (unread == measured.size()) throw Error("no neuron could be read, so nothing was measured");

  const std::size_t stored = options.store ? store(options, picks, ids, table.rows, console.progress()) : 0;
  io::Workbook book{{sheet("metrics", table)}, {}};
  if (!options.by.empty()) {
    table = grouped(options, table, groups);
    book.sheets.insert(book.sheets.begin(), sheet("groups", table));
  }
  const bool written = !options.csv.empty() || !options.xlsx.empty();
  if (!options.csv.empty()) write_unless_there(options.csv, io::csv_of(book.sheets[0]), options.force);
  if (!options.xlsx.empty()) io::write_workbook(options.xlsx, book);
  if (console.json) {
    console.print(json(options, table));
  } else if (!options.by.empty()) {
    print_groups(console, options, table);
  } else if (options.level == "neuron" && table.rows.size() == 1) {
    print_neuron(console, picks, table.rows[0]);
  } else if (options.level == "neuron" || !written) {
    print_rows(console, options, table);
  }
  for (const auto& path : {options.csv, options.xlsx})
    if (!path.empty())
      console.say(fmt::format("{} of {} columns written to {}", counted(table.rows.size(), "row"),
                              table.columns.size(), path.string()));
  if (options.store)
    console.say(fmt::format("{} of {} are kept in {}; list --where and query find them",
                            counted(stored, "metric"), counted(ids.size(), "neuron"), options.repo));
  if (!written && options.level == "neuron" && options.metrics.empty() && table.rows.size() > 1)
    console.say("--metric NAME shows other metrics, --csv FILE writes them all, --list says what they are");
  if (failed)
    throw Error(fmt::format("{} of {} neurons could not be read; the sentences above say why", failed,
                            measured.size()));
}

/// How many letters must be put in, left out or replaced to make one of the other, whatever is large or small (Levenshtein 1966).
std::size_t slips(std::string_view a, std::string_view b) {
  std::vector<std::size_t> row(b.size() + 1);
  std::iota(row.begin(), row.end(), std::size_t(0));
  for (std::size_t i = 0; i < a.size(); ++i) {
    std::size_t diagonal = std::exchange(row[0], i + 1);
    for (std::size_t k = 0; k < b.size(); ++k) {
      const bool same =
          std::tolower(static_cast<unsigned char>(a[i])) == std::tolower(static_cast<unsigned char>(b[k]));
      diagonal = std::exchange(row[k + 1], std::min({row[k] + 1, row[k + 1] + 1, diagonal + !same}));
    }
  }
  return row.back();
}

/// What to say of a name that no metric has: those at most two slips away, or those that NeuroM has in one name and we in several, or that begin
/// with the same word.
std::string no_such_metric(std::string_view name) {
  std::vector<std::string_view> like;
  for (const Metric& m : metrics())
    for (const std::string_view known : {std::string_view(m.name), std::string_view(m.l_measure)})
      if (!known.empty() && slips(name, known) <= 2 && slips(name, known) < name.size() / 2)
        like.push_back(known);
  for (const std::string_view beginning : {name, name.substr(0, name.find('_'))}) {
    if (!like.empty()) break;
    for (const Metric& m : metrics())
      if (!beginning.empty() && m.name.size() > beginning.size() && m.name.starts_with(beginning) &&
          m.name[beginning.size()] == '_')
        like.push_back(m.name);
  }
  return fmt::format("There is no metric called '{}'{}; --list shows them", name,
                     like.empty() ? "" : fmt::format(", but {}", fmt::join(like, ", ")));
}

}  // namespace

std::function<void()> measure(CLI::App& command, Console& console) {
  const auto options = std::make_shared<Options>();
  CLI::Option* files =
      command.add_option("files", options->files, "Files of neurons, or folders with such files below them")
          ->type_name("FILES");
  CLI::Option* repo =
      command.add_option("--repo", options->repo, "Measure the neurons of this repository instead")
          ->excludes(files)
          ->type_name("REPO");
  command.add_option("--population", options->population, "Only those of this population")->needs(repo);
  command
      .add_option("--metric,--metrics", options->metrics,
                  "Metrics to show, by their or L-Measure's name; all by default")
      ->type_name("NAME")
      ->delimiter(',')
      ->check(
          [](const std::string& name) { return find_metric(name) ? std::string() : no_such_metric(name); });
  add_kind(command, options->kind);
  command
      .add_option(
          "--level", options->level,
          "What a row is: neuron, arbor, section, bifurcation, point, shell (a sphere about the soma) or bar "
          "(of an arbor's barcode)")
      ->check(CLI::IsMember(std::vector<std::string>(levels.begin(), levels.end())))
      ->type_name("LEVEL")
      ->capture_default_str();
  command
      .add_option("--by", options->by,
                  "Mean and standard deviation over the neurons of each type, layer, region, species or "
                  "population of a "
                  "repository, or of each folder of files")
      ->check(CLI::IsMember({"type", "layer", "region", "species", "population", "folder"}))
      ->type_name("WHAT");
  command.add_option("--csv", options->csv, "Write the table to this file")->type_name("FILE");
  command.add_option("--xlsx", options->xlsx, "Write it to this workbook, with --by both groups and neurons")
      ->type_name("FILE.xlsx")
      ->check([](const std::string& file) {
        return file.ends_with(".xlsx") ? "" : fmt::format("{}: a workbook's name ends in .xlsx", file);
      });
  command
      .add_flag("--store", options->store,
                "Keep the metrics in the repository, so that neurons are found by them: of those with many "
                "values the mean")
      ->needs(repo);
  add_force(command, options->force);
  command.add_flag("--list", options->list, "Show all metrics and what they are");
  command.parse_complete_callback([options] {
    if (!options->list && options->files.empty() && options->repo.empty())
      throw CLI::RequiredError("files or --repo");
    if (!options->by.empty() && options->level != "neuron")
      throw CLI::ValidationError(
          fmt::format("--by: groups are of neurons, not of each {}; leave --level out", options->level));
    if (!options->by.empty() && (options->by == "folder") != options->repo.empty())
      throw CLI::ValidationError(
          "--by: files are grouped by folder, neurons of --repo by what is known of them");
    if (options->store && (options->level != "neuron" || options->kind != "all"))
      throw CLI::ValidationError("--store: what is kept is of whole neurons; leave --level and --kind out");
    for (const std::string& name : options->metrics)
      if (options->level != "neuron" && name_of(find_metric(name)->level) != options->level)
        throw CLI::ValidationError(
            fmt::format("--metric: {} has no value for each {}; leave --level out", name, options->level));
  });
  return [options, &console] { run(*options, console); };
}

}  // namespace forest::cli
