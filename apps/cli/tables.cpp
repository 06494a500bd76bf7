// SPDX-License-Identifier: Apache-2.0
#include "apps/cli/tables.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <map>
#include <span>

#include <fmt/format.h>

#include "forest/core/error.h"
#include "forest/core/file.h"
#include "forest/core/lower.h"
#include "forest/io/workbook.h"
#include "forest/statistics/metric.h"
#include "forest/statistics/summary.h"

#include "apps/cli/console.h"
#include "apps/cli/neurons.h"

namespace forest::cli {
namespace {

using io::TableColumn;
using io::TableSheet;
using io::Value;
using repository::NeuronId;
using repository::Repository;

/// Units of the columns of the views (docs/repository/schema.md).
constexpr std::pair<std::string_view, std::string_view> units[] = {
    {"length", "µm"},     {"area", "µm²"},  {"soma_area", "µm²"},     {"soma_x", "µm"},
    {"soma_y", "µm"},     {"soma_z", "µm"}, {"diameter", "µm"},       {"x", "µm"},
    {"y", "µm"},          {"z", "µm"},      {"start_diameter", "µm"}, {"end_diameter", "µm"},
    {"soma_radius", "µm"}};

/// A sheet for each view: its columns in the order of the page, of the neurons that were chosen.
struct Sheet {
  const char *name, *columns, *from, *id;
  const char* entries = "";  // what a person may change
};
constexpr Sheet sheets[] = {
    {"neurons",
     "id, name, population, species, region, layer, type, stems, sections, points, spines, length, soma, "
     "soma_x, soma_y, "
     "soma_z, soma_radius, soma_area, origin, source_file, grammar, seed, number",
     "neuron", "id", "name species region layer type"},
    {"sections",
     "neuron, name, section, parent, arbor, branch_order, kind, tag, points, length, area, start_diameter, "
     "end_diameter",
     "section", "neuron, section"},
    {"junctions", "neuron, name, section, junction, daughters, branch_order, x, y, z, diameter", "junction",
     "neuron, section"},
    {"annotations", "neuron, number, name, value", "annotations", "neuron, number", "name value"}};

/// Of a whole workbook, in its order.
constexpr std::array<std::string_view, 7> sheet_names{"summary", "neurons",     "sections", "junctions",
                                                      "metrics", "annotations", "points"};

TableSheet sheet_of(Repository& repository, const Sheet& sheet, const std::string& ids) {
  const std::string_view key = std::string_view(sheet.id).substr(0, std::string_view(sheet.id).find(','));
  repository::Answer answer = repository.query(fmt::format("select {} from {} where {} in ({}) order by {}",
                                                           sheet.columns, sheet.from, key, ids, sheet.id));
  TableSheet table{sheet.name, {}, std::move(answer.rows)};
  for (const std::string& column : answer.columns) {
    const auto unit = std::ranges::find(units, column, &std::pair<std::string_view, std::string_view>::first);
    table.columns.push_back(
        {column, unit == std::end(units) ? "" : std::string(unit->second),
         fmt::format(" {} ", sheet.entries).find(fmt::format(" {} ", column)) != std::string::npos});
  }
  return table;
}

/// The shortest decimal that is this float, as a person would have typed it.
double decimal(float value) {
  std::array<char, 32> digits;
  const char* const end = std::to_chars(digits.data(), digits.data() + digits.size(), value).ptr;
  double result = 0.;
  std::from_chars(digits.data(), end, result);
  return result;
}

/// A row a point, first those of the soma.
TableSheet points_sheet(const Repository& repository, const std::vector<repository::NeuronRow>& neurons) {
  TableSheet table{"points",
                   {{"neuron", ""},
                    {"section", ""},
                    {"point", ""},
                    {"x", "µm", true},
                    {"y", "µm", true},
                    {"z", "µm", true},
                    {"diameter", "µm", true}},
                   {}};
  for (const auto& neuron : neurons) {
    const Morphology m = repository.morphology(neuron.id);
    const auto add = [&](const Value& section, std::span<const Point> points) {
      for (std::size_t i = 0; i < points.size(); ++i) {
        const Point& p = points[i];
        table.rows.push_back({std::int64_t(neuron.id.value()), section, std::int64_t(i), decimal(p.x),
                              decimal(p.y), decimal(p.z), decimal(2.f * p.radius)});
      }
    };
    add("soma", m.soma().points);
    for (std::size_t s = 0; s < m.sections().size(); ++s) add(std::int64_t(s), m.points(SectionId(s)));
  }
  return table;
}

/// A row a neuron, a column a metric.
TableSheet metrics_sheet(Repository& repository, const std::vector<repository::NeuronRow>& neurons,
                         const std::string& ids) {
  TableSheet table{"metrics", {{"neuron", ""}, {"name", ""}}, {}};
  std::map<std::string, std::size_t> column;
  for (const auto& metric : repository.query("select name, unit from metrics order by id").rows) {
    const auto& name = std::get<std::string>(metric[0]);
    column[name] = table.columns.size();
    table.columns.push_back({name, std::get<std::string>(metric[1])});
  }
  std::map<std::int64_t, std::size_t> row;
  for (const auto& neuron : neurons) {
    row[std::int64_t(neuron.id.value())] = table.rows.size();
    table.rows.emplace_back(table.columns.size());
    table.rows.back()[0] = std::int64_t(neuron.id.value());
    table.rows.back()[1] = neuron.name;
  }
  const auto answer =
      repository.query(fmt::format("select neuron, metric, value from metric where neuron in ({})", ids));
  for (const auto& line : answer.rows)
    table.rows[row.at(std::get<std::int64_t>(line[0]))][column.at(std::get<std::string>(line[1]))] =
        std::get<double>(line[2]);
  return table;
}

/// Mean crossings of the spheres about the soma, by radius.
std::vector<double> mean_sholl(const std::string& repo, const std::vector<repository::NeuronRow>& neurons,
                               Progress& progress) {
  std::vector<std::vector<double>> crossings(neurons.size());
  const statistics::Metric& metric = *statistics::find_metric("sholl_crossings");
  each_neuron(repo, neurons, "counting crossings", progress, [&](std::size_t i, const auto& neuron) {
    crossings[i] = metric.values(statistics::Arbors(neuron()));
  });
  std::vector<double> mean;
  for (const auto& values : crossings) {
    if (values.size() > mean.size()) mean.resize(values.size());
    for (std::size_t k = 0; k < values.size(); ++k) mean[k] += values[k] / double(neurons.size());
  }
  return mean;
}

/// How many values fall into each of ten even bins: lower edge, count.
std::vector<std::pair<double, std::int64_t>> histogram(const std::vector<double>& values) {
  const auto [low, high] = std::ranges::minmax(values);
  constexpr std::size_t bins = 10;
  const double width = high > low ? (high - low) / double(bins) : 1.;
  std::vector<std::pair<double, std::int64_t>> counts;
  for (std::size_t b = 0; b < bins; ++b) counts.emplace_back(low + double(b) * width, 0);
  for (const double v : values) ++counts[std::min(bins - 1, std::size_t((v - low) / width))].second;
  return counts;
}

constexpr std::array<std::string_view, 3> shown_as_histogram{"total_length", "number_of_leaves",
                                                             "max_branch_order"};

/// The mean, spread and range of every metric, and below them the numbers of the charts.
void add_summary(io::Workbook& book, const TableSheet& metrics, const std::vector<double>& sholl) {
  TableSheet summary{"summary",
                     {{"metric", ""},
                      {"unit", ""},
                      {"neurons", ""},
                      {"mean", ""},
                      {"sd", ""},
                      {"min", ""},
                      {"median", ""},
                      {"max", ""}},
                     {}};
  const auto values_of = [&](std::size_t column) {
    std::vector<double> values;
    for (const auto& row : metrics.rows)
      if (const auto* value = std::get_if<double>(&row[column])) values.push_back(*value);
    return values;
  };
  for (std::size_t c = 2; c < metrics.columns.size(); ++c) {
    const std::vector<double> values = values_of(c);
    const statistics::Summary s = statistics::summarize(values);
    summary.rows.push_back({metrics.columns[c].name, metrics.columns[c].unit, std::int64_t(s.count), s.mean,
                            s.sd, s.min, s.median, s.max});
  }
  const auto chart = [&](std::string title, std::string x, std::string y, io::Chart::Kind kind,
                         const auto& numbers) {
    summary.rows.emplace_back(summary.columns.size());
    summary.rows.push_back({title, {}, {}, x, y, {}, {}, {}});
    book.charts.push_back({title, x, y, kind, 0, 3, 4, summary.rows.size(), numbers.size()});
    for (const auto& [at, value] : numbers) summary.rows.push_back({{}, {}, {}, at, value, {}, {}, {}});
  };
  for (const std::string_view name : shown_as_histogram)
    for (std::size_t c = 2; c < metrics.columns.size(); ++c)
      if (metrics.columns[c].name == name)
        if (const std::vector<double> values = values_of(c); !values.empty())
          chart(metrics.columns[c].title(), metrics.columns[c].title(), "neurons", io::Chart::Kind::columns,
                histogram(values));
  std::vector<std::pair<double, double>> curve;
  for (std::size_t k = 0; k < sholl.size(); ++k)
    curve.emplace_back(double(k + 1) * statistics::sholl_step, sholl[k]);
  if (!curve.empty()) chart("Sholl analysis", "radius (µm)", "mean crossings", io::Chart::Kind::line, curve);
  book.sheets.insert(book.sheets.begin(), std::move(summary));
}

}  // namespace

std::vector<TableSheet> sheets_of(Repository& repository, const std::vector<repository::NeuronRow>& neurons,
                                  bool points) {
  std::vector<NeuronId> numbers;
  std::string ids;
  for (const auto& neuron : neurons) {
    ids += fmt::format("{}{}", ids.empty() ? "" : ", ", neuron.id.value());
    numbers.push_back(neuron.id);
  }
  std::vector<TableSheet> tables{metrics_sheet(repository, neurons, ids)};
  for (const Sheet& sheet : sheets) tables.push_back(sheet_of(repository, sheet, ids));
  std::map<std::int64_t, std::string> version;
  const std::vector<std::string> versions = repository.versions(numbers);
  for (std::size_t i = 0; i < numbers.size(); ++i) version[std::int64_t(numbers[i].value())] = versions[i];
  TableSheet& first = tables[1];
  first.columns.push_back({"version", ""});
  for (auto& row : first.rows) row.emplace_back(version[std::get<std::int64_t>(row[0])]);
  if (points) tables.push_back(points_sheet(repository, neurons));
  return tables;
}

std::vector<std::filesystem::path> table_files(const std::filesystem::path& out, bool csv) {
  const std::string extension = lower(out.extension().string());
  if (!csv && extension != ".xlsx")
    throw Error(fmt::format("{}: a workbook's name ends in .xlsx; change the name, or choose --format csv",
                            out.string()));
  if (!csv) return {out};
  if (extension == ".csv" || extension == ".xlsx")
    throw Error(fmt::format("{}: csv is one file a sheet, so --out names the folder for them; leave {} out",
                            out.string(), extension));
  std::vector<std::filesystem::path> files;
  for (const std::string_view sheet : sheet_names) files.push_back(out / fmt::format("{}.csv", sheet));
  return files;
}

std::vector<std::filesystem::path> export_tables(const std::string& repo,
                                                 std::vector<repository::NeuronRow> neurons,
                                                 const std::filesystem::path& out, bool csv,
                                                 Console& console) {
  std::ranges::sort(neurons, {}, [](const auto& neuron) { return neuron.id.value(); });
  neurons.erase(
      std::unique(neurons.begin(), neurons.end(), [](const auto& a, const auto& b) { return a.id == b.id; }),
      neurons.end());  // one may be named twice, by name and by id
  Repository repository = Repository::open(repo, repository::Access::read);
  std::size_t points = 0;
  for (const auto& neuron : neurons) points += neuron.points;
  io::Workbook book;
  book.sheets = sheets_of(repository, neurons, csv || points <= io::most_rows);
  if (!csv && (points > io::most_rows || book.sheets.back().rows.size() > io::most_rows)) {
    console.warn(fmt::format(
        "{}: the sheet points is left out, for a sheet holds {} rows and there are {} points; choose fewer "
        "neurons, or --format csv, to correct coordinates",
        out.string(), io::most_rows, points));
    if (points <= io::most_rows) book.sheets.pop_back();
  }
  add_summary(book, TableSheet(book.sheets[0]), mean_sholl(repo, neurons, console.progress()));
  std::rotate(book.sheets.begin() + 1, book.sheets.begin() + 2, book.sheets.begin() + 5);
  if (!csv) {
    io::write_workbook(out, book);
    return {out};
  }
  std::error_code error;
  std::filesystem::create_directories(out, error);
  if (error)
    throw Error(fmt::format("{}: cannot be made ({}); name a folder that can be written", out.string(),
                            error.message()));
  std::vector<std::filesystem::path> files;
  for (const TableSheet& sheet : book.sheets) {
    files.push_back(out / (sheet.name + ".csv"));
    write_file(files.back(), std::string_view(io::csv_of(sheet)));
  }
  return files;
}

}  // namespace forest::cli
