// SPDX-License-Identifier: Apache-2.0
// brainforest measure: the metrics of neurons as a table, CSV or JSON.
#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <variant>

#include <CLI/CLI.hpp>
#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "forest/core/error.h"
#include "forest/core/file.h"
#include "forest/core/parallel.h"
#include "forest/io/format.h"
#include "forest/io/workbook.h"
#include "forest/repository/repository.h"
#include "forest/statistics/metric.h"
#include "forest/statistics/summary.h"

#include "apps/cli/console.h"
#include "apps/cli/files.h"
#include "apps/cli/neurons.h"
#include "apps/cli/options.h"
#include "apps/cli/verb.h"

namespace forest::cli {
namespace {

using namespace statistics;
using Picks = std::vector<const Metric*>;

struct Options {
  std::vector<std::string> files;  // or folders
  std::string repo, population;
  std::vector<std::string> metrics;
  std::string kind = "all", level = "neuron";
  std::filesystem::path csv;
  bool list = false, force = false;
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

using Cell = std::variant<std::string, double>;  // NaN: not defined
using Row = std::vector<Cell>;

struct Column {
  std::string name;
  std::string_view unit;
  bool brief = true;  // shown on the terminal

  std::string title() const { return unit.empty() ? name : fmt::format("{} ({})", name, unit); }
};

/// Neurons to measure, whatever they come from.
struct Neurons {
  std::vector<std::string> names;
  std::function<std::function<Morphology(std::size_t)>()> reader;  // reads the i-th; each thread has its own
};

Neurons of_files(const Options& options, Console& console) {
  std::vector<std::filesystem::path> files = neuron_files(options.files, console);
  Neurons neurons;
  for (const auto& file : files) neurons.names.push_back(file.string());
  neurons.reader = [files = std::move(files)] {
    return [&files](std::size_t i) { return io::read(files[i]).morphology; };
  };
  return neurons;
}

Neurons of_repository(const Options& options) {
  using namespace repository;
  const auto rows = pick_neurons(Repository::open(options.repo, Access::read), {}, options.population);
  if (rows.empty()) throw Error(fmt::format("{} holds no neuron; import or grow some first", options.repo));
  Neurons neurons;
  std::vector<NeuronId> ids;
  for (const NeuronRow& row : rows) {
    neurons.names.push_back(options.population.empty() ? row.population + '/' + row.name : row.name);
    ids.push_back(row.id);
  }
  neurons.reader = [place = options.repo, ids = std::move(ids)] {
    const auto open = std::make_shared<Repository>(Repository::open(place, Access::read));
    return [open, &ids](std::size_t i) { return open->morphology(ids[i]); };
  };
  return neurons;
}

Picks pick(const Options& options) {
  Picks picks;
  for (const std::string& name : options.metrics) picks.push_back(find_metric(name));
  for (const Metric& m : metrics())
    if (options.metrics.empty() && (options.level == "neuron" || name_of(m.level) == options.level))
      picks.push_back(&m);
  return picks;
}

std::vector<Column> columns(const Options& options, const Picks& picks) {
  std::vector<Column> columns{{"neuron", "", true}};
  if (options.level == "section") columns.insert(columns.end(), {{"section", "", true}, {"kind", "", true}});
  if (options.level == "bifurcation") columns.push_back({"section", "", true});
  if (options.level == "shell") columns.push_back({"radius", "µm", true});
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
        for (const auto& [part, member] : parts) row.emplace_back(summary.*member);
      }
    }
    return {row};
  }
  std::vector<Row> rows;
  if (options.level == "section") {
    for (const Branch& b : arbors.sections())
      rows.push_back({name, double(b.id.value()), std::string(name_of(arbors.neuron().section(b.id).kind))});
  } else if (options.level == "bifurcation") {
    for (const Bifurcation& b : arbors.bifurcations())
      rows.push_back({name, double(arbors.section(b.parent).id.value())});
  }
  for (const Metric* m : picks) {
    const std::vector<double> values = m->values(arbors);
    for (std::size_t i = rows.size(); i < values.size(); ++i)
      rows.push_back({name, double(i + 1) * sholl_step});
    for (std::size_t i = 0; i < rows.size(); ++i) rows[i].emplace_back(values[i]);
  }
  return rows;
}

std::string csv(const std::vector<Column>& columns, const std::vector<Row>& rows) {
  io::TableSheet sheet{.name = "metrics", .columns = {}, .rows = {}};
  for (const Column& c : columns) sheet.columns.push_back({c.name, std::string(c.unit)});
  for (const Row& row : rows) {
    auto& cells = sheet.rows.emplace_back();
    for (const Cell& cell : row)  // NaN becomes an empty cell
      std::visit([&](const auto& value) { cells.emplace_back(value); }, cell);
  }
  return io::csv_of(sheet);
}

nlohmann::ordered_json json(const Options& options, const std::vector<Column>& columns,
                            const std::vector<Row>& rows) {
  nlohmann::ordered_json out{{"level", options.level}, {"kind", options.kind}};
  auto& units = out["units"] = nlohmann::ordered_json::object();
  auto& list = out["rows"] = nlohmann::ordered_json::array();
  for (const Column& c : columns)
    if (!c.unit.empty()) units[c.name] = c.unit;
  for (const Row& row : rows) {
    nlohmann::ordered_json entry;
    for (std::size_t i = 0; i < row.size(); ++i)
      std::visit([&](const auto& value) { entry[columns[i].name] = value; },
                 row[i]);  // NaN is written as null
    list.push_back(std::move(entry));
  }
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

/// Of a file, without its folder.
std::string short_name(const Cell& neuron) {
  return std::filesystem::path(std::get<std::string>(neuron)).filename();
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

/// A row each, and of several neurons their mean and standard deviation.
void print_rows(Console& console, const Options& options, const std::vector<Column>& columns,
                const std::vector<Row>& rows) {
  const bool summaries = options.level == "neuron", files = options.repo.empty();
  std::vector<std::string> header;
  std::vector<std::vector<std::string>> lines(rows.size() + (summaries ? 2 : 0));
  for (std::size_t c = 0; c < columns.size(); ++c) {
    if (!columns[c].brief) continue;
    header.push_back(columns[c].title());
    std::vector<double> values;
    for (std::size_t r = 0; r < rows.size(); ++r) {
      lines[r].push_back(c == 0 && files ? short_name(rows[r][c]) : shown(rows[r][c]));
      if (const double* value = std::get_if<double>(&rows[r][c])) values.push_back(*value);
    }
    if (!summaries) continue;
    const Summary summary = summarize(values);
    lines[rows.size()].push_back(c == 0 ? "mean" : shown(summary.mean));
    lines[rows.size() + 1].push_back(c == 0 ? "sd" : shown(summary.sd));
  }
  console.table(header, lines);
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
                   {"definition", m.definition},
                   {"source", m.source},
                   {"l_measure", m.l_measure}});
  }
  console.table({"metric", "unit", "level", "definition"}, lines);
  console.print(out);
}

void run(const Options& options, Console& console) {
  if (options.list) return list(console);
  const Picks picks = pick(options);
  const KindSet kinds = kind_set(options.kind);

  struct Measured {
    std::vector<Row> rows;
    std::string error;
    bool skipped = false;
  };
  const Neurons neurons = options.repo.empty() ? of_files(options, console) : of_repository(options);
  std::vector<Measured> measured(neurons.names.size());
  console.progress().begin("measuring", measured.size());
  parallel_ranges(measured.size(), 8, [&](std::size_t begin, std::size_t end) {
    const auto read = neurons.reader();
    for (std::size_t i = begin; i < end; ++i) {
      try {
        measured[i].rows = rows(options, picks, neurons.names[i], Arbors(read(i), kinds));
      } catch (const Error& error) {
        measured[i].error = error.what();
        measured[i].skipped = options.repo.empty() && may_skip(error, neurons.names[i], options.files);
      }
      console.progress().advance();
    }
  });
  console.progress().end();

  const std::vector<Column> header = columns(options, picks);
  std::vector<Row> all;
  std::size_t failed = 0, unread = 0;
  for (Measured& m : measured) {
    if (!m.error.empty()) {
      console.warn(m.skipped ? m.error + "; skipped" : m.error);
      ++unread, failed += !m.skipped;
    }
    std::ranges::move(m.rows, std::back_inserter(all));
  }
  if (unread == measured.size()) throw Error("no neuron could be read, so nothing was measured");

  if (!options.csv.empty()) write_unless_there(options.csv, csv(header, all), options.force);
  if (console.json) {
    console.print(json(options, header, all));
  } else if (options.level == "neuron" && all.size() == 1) {
    print_neuron(console, picks, all[0]);
  } else if (options.level == "neuron" || options.csv.empty()) {
    print_rows(console, options, header, all);
  }
  if (!options.csv.empty())
    console.say(fmt::format("{} rows of {} columns were written to {}", all.size(), header.size(),
                            options.csv.string()));
  else if (options.level == "neuron" && options.metrics.empty() && all.size() > 1)
    console.say("--metric NAME shows other metrics, --csv FILE writes them all, --list says what they are");
  if (failed)
    throw Error(fmt::format("{} of {} neurons could not be read; the sentences above say why", failed,
                            measured.size()));
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
      .add_option("--metric", options->metrics,
                  "Metrics to show, by their or L-Measure's name; all by default")
      ->type_name("NAME")
      ->delimiter(',')
      ->check([](const std::string& name) {
        return find_metric(name) ? ""
                                 : fmt::format("There is no metric called '{}'; --list shows them", name);
      });
  command.add_option("--kind", options->kind, "Sections to measure: all, dendrite, axon, basal, apical, …")
      ->type_name("KIND")
      ->capture_default_str()
      ->check([](const std::string& word) -> std::string {
        try {
          kind_set(word);
          return {};
        } catch (const Error& error) {
          return error.what();
        }
      });
  command.add_option("--level", options->level, "What a row is: neuron, section, bifurcation or shell")
      ->check(CLI::IsMember({"neuron", "section", "bifurcation", "shell"}))
      ->type_name("LEVEL")
      ->capture_default_str();
  command.add_option("--csv", options->csv, "Write the table to this file")->type_name("FILE");
  add_force(command, options->force);
  command.add_flag("--list", options->list, "Show all metrics and what they are");
  command.parse_complete_callback([options] {
    if (!options->list && options->files.empty() && options->repo.empty())
      throw CLI::RequiredError("files or --repo");
    for (const std::string& name : options->metrics)
      if (options->level != "neuron" && name_of(find_metric(name)->level) != options->level)
        throw CLI::ValidationError(
            fmt::format("--metric: {} has no value for each {}; leave --level out", name, options->level));
  });
  return [options, &console] { run(*options, console); };
}

}  // namespace forest::cli
