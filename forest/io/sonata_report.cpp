// SPDX-License-Identifier: Apache-2.0
#include "forest/io/sonata_report.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <memory>

#include <fmt/format.h>

#include "forest/core/error.h"
#include "forest/core/file.h"
#include "forest/core/parallel.h"
#include "forest/io/hdf5.h"
#include "forest/io/sonata_config.h"

namespace forest::io {
namespace {

namespace fs = std::filesystem;
using reports::Report;
using reports::Spikes;

/// The populations below a group, or the one that is asked for. Some programs leave empty groups, which are none.
std::vector<std::string> populations_of(const hdf5::File& file, const std::string& group,
                                        const std::string& wanted, const char* what) {
  if (file.kind(group) != hdf5::Kind::group)
    file.refuse(
        fmt::format("there is no group {}, so it holds no {} of SONATA; name another file", group, what));
  std::vector<std::string> names;
  for (const std::string& name : file.members(group))
    if (file.kind(group + "/" + name) == hdf5::Kind::group && !file.members(group + "/" + name).empty())
      names.push_back(name);
  if (names.empty())
    file.refuse(fmt::format(
        "group {} has no population; write the file in SONATA's layout, {}/<population>/…", group, group));
  if (wanted.empty()) return names;
  if (std::ranges::find(names, wanted) == names.end())
    file.refuse(fmt::format("population {} is not in it; there are {}", wanted, fmt::join(names, ", ")));
  return {wanted};
}

/// Milliseconds of a unit of time.
double milliseconds(const hdf5::File& file, const std::string& array) {
  const std::string unit = file.text_attribute(array, "units");
  if (unit.empty() || unit == "ms" || unit == "milliseconds" || unit == "millisecond") return 1.;
  if (unit == "s" || unit == "seconds" || unit == "second") return 1000.;
  file.refuse(fmt::format("{} is in \"{}\"; give times in ms", array, unit));
}

/// The numbers of an array that must not be below zero.
std::vector<std::uint64_t> counts(const hdf5::File& file, const std::string& array) {
  std::vector<std::uint64_t> result;
  for (const std::int64_t value : file.integers(array)) {
    if (value < 0) file.refuse(fmt::format("{} holds {}, below zero; the file is damaged", array, value));
    result.push_back(std::uint64_t(value));
  }
  return result;
}

/// One population of a report.
struct Part {
  std::string name;
  std::shared_ptr<const hdf5::Matrix> data;
  std::string units;
  double start = 0., step = 0.;
  std::vector<std::uint64_t> nodes, pointers;
  std::vector<std::uint32_t> elements;
  std::vector<float> positions;  // or empty
};

Part read_part(const std::shared_ptr<const hdf5::File>& file, const std::string& name) {
  const std::string path = "/report/" + name, map = path + "/mapping";
  Part part{.name = name,
            .data = std::make_shared<hdf5::Matrix>(file, path + "/data"),
            .units = file->text_attribute(path + "/data", "units"),
            .nodes = counts(*file, map + "/node_ids"),
            .pointers = {},
            .elements = {},
            .positions = {}};
  if (part.units.empty()) {  // a voltage, unless it is called otherwise
    const std::string variable = file->text_attribute(path + "/data", "variable");
    const bool voltage =
        variable.empty() || (variable.front() | 32) == 'v' || variable.starts_with("membrane");
    part.units = voltage ? "mV" : fmt::format("unknown units of '{}'", variable);
  }
  const std::size_t columns = part.data->columns();

  const std::string times = map + "/time";
  const std::vector<double> time = file->doubles(times);
  if (time.size() != 3)
    file->refuse(fmt::format("{} has {} numbers; it must have start, stop and step", times, time.size()));
  const double unit = milliseconds(*file, times);
  part.start = time[0] * unit, part.step = time[2] * unit;
  const double rows = (time[1] - time[0]) / time[2];
  if (!(time[2] > 0.) || !std::isfinite(rows) || std::abs(rows - double(part.data->rows())) > 1.5)
    file->refuse(fmt::format("{} says {} to {} by {}, but {}/data has {} rows; write the report again", times,
                             time[0], time[1], time[2], path, part.data->rows()));

  // The developer guide and programs have both names.
  const bool plural = file->kind(map + "/index_pointers") != hdf5::Kind::none;
  const std::string pointers = map + (plural ? "/index_pointers" : "/index_pointer");
  part.pointers = counts(*file, pointers);
  if (part.pointers.size() == part.nodes.size())
    part.pointers.push_back(columns);  // some leave the last one out
  if (part.pointers.size() != part.nodes.size() + 1 || part.pointers.front() != 0 ||
      part.pointers.back() != columns || !std::ranges::is_sorted(part.pointers))
    file->refuse(fmt::format(
        "{} must rise from 0 to the {} columns of the values, one more than the {} nodes; write the "
        "report again",
        pointers, columns, part.nodes.size()));

  const std::string elements = map + "/element_ids";
  for (const std::uint64_t element : counts(*file, elements)) {
    if (element >= std::numeric_limits<std::uint32_t>::max())
      file->refuse(
          fmt::format("{} holds {}, more than any section's number; the file is damaged", elements, element));
    part.elements.push_back(std::uint32_t(element));
  }
  const std::string positions = map + "/element_pos";
  if (file->kind(positions) != hdf5::Kind::none) part.positions = file->reals(positions);
  for (const auto& [array, size] :
       {std::pair(elements, part.elements.size()),
        std::pair(positions, part.positions.empty() ? columns : part.positions.size())})
    if (size != columns)
      file->refuse(fmt::format("{} has {} entries, but the values have {} columns; they must be as many",
                               array, size, columns));
  return part;
}

void must_agree(const hdf5::File& file, const Part& one, const Part& other) {
  if (one.data->rows() != other.data->rows() || one.start != other.start || one.step != other.step ||
      one.units != other.units)
    file.refuse(fmt::format(
        "populations {} and {} have different times or units ({} rows from {} ms by {} ms in {}, {} "
        "rows from {} ms by {} ms in {}); name one with --population",
        one.name, other.name, one.data->rows(), one.start, one.step, one.units, other.data->rows(),
        other.start, other.step, other.units));
}

}  // namespace

Report read_sonata_report(const fs::path& path, const std::string& population) {
  const auto file = std::make_shared<const hdf5::File>(path);
  std::vector<Part> parts;
  for (const std::string& name : populations_of(*file, "/report", population, "report")) {
    parts.push_back(read_part(file, name));
    must_agree(*file, parts.front(), parts.back());
  }
  Report report{.source = path.string(),
                .units = parts[0].units,
                .start = parts[0].start,
                .step = parts[0].step,
                .steps = parts[0].data->rows(),
                .populations = {},
                .nodes = {},
                .first_column = {0},
                .element_ids = {},
                .element_positions = {},
                .read = {}};
  const bool placed = std::ranges::any_of(parts, [](const Part& part) { return !part.positions.empty(); });
  struct Table {
    std::size_t first = 0;
    std::shared_ptr<const hdf5::Matrix> data;
  };
  std::vector<Table> tables;
  for (const Part& part : parts) {
    const std::size_t first = report.columns();
    tables.push_back({first, part.data});
    for (std::size_t n = 0; n < part.nodes.size(); ++n) {
      report.nodes.push_back({std::uint32_t(report.populations.size()), part.nodes[n]});
      report.first_column.push_back(first + part.pointers[n + 1]);
    }
    report.populations.push_back(part.name);
    report.element_ids.insert(report.element_ids.end(), part.elements.begin(), part.elements.end());
    if (placed && part.positions.empty() && !part.elements.empty())
      file->refuse(fmt::format("population {} has no element_pos and others have; name one with --population",
                               part.name));
    report.element_positions.insert(report.element_positions.end(), part.positions.begin(),
                                    part.positions.end());
  }
  report.read = [tables](std::size_t row, std::size_t rows, std::size_t column, std::size_t columns,
                         float* out) {
    std::vector<float> piece;
    for (const auto& [first, data] : tables) {
      const std::size_t begin = std::max(column, first),
                        end = std::min(column + columns, first + data->columns());
      if (begin >= end) continue;
      if (end - begin == columns) return data->read(row, rows, begin - first, columns, out);
      piece.resize(rows * (end - begin));
      data->read(row, rows, begin - first, end - begin, piece.data());
      for (std::size_t r = 0; r < rows; ++r)
        std::copy_n(&piece[r * (end - begin)], end - begin, out + r * columns + (begin - column));
    }
  };
  reports::check(report);
  return report;
}

void write_sonata_report(const fs::path& path, const Report& report, Progress& progress) {
  reports::check(report);
  if (report.populations.size() != 1)
    throw Error(fmt::format("{}: a report of {} populations is to be written; write one a file",
                            path.string(), report.populations.size()));
  NewFile place(path);
  hdf5::NewFile file(place.path(), path);
  file.attribute("/", "magic", sonata_magic);
  file.attribute("/", "version", std::array<std::uint32_t, 2>{0, 1});
  file.attribute("/", "comment", report.source);
  const std::string base = "/report/" + report.populations[0], map = base + "/mapping/",
                    data = base + "/data";
  std::vector<std::uint64_t> nodes;
  for (const reports::Node& node : report.nodes) nodes.push_back(node.id);
  file.write(map + "node_ids", std::span(std::as_const(nodes)));
  file.write(map + "index_pointers", std::span(report.first_column));
  file.write(map + "element_ids", std::span(report.element_ids));
  if (!report.element_positions.empty()) file.write(map + "element_pos", std::span(report.element_positions));
  const std::array<double, 3> time{report.start, report.start + double(report.steps) * report.step,
                                   report.step};
  file.write(map + "time", std::span<const double>(time));
  file.attribute(map + "time", "units", "ms");
  file.matrix(data, report.steps, report.columns());
  file.attribute(data, "units", report.units);
  constexpr std::size_t rows = 16, columns = 65536;
  const std::size_t across = (report.columns() + columns - 1) / columns,
                    down = (report.steps + rows - 1) / rows;
  progress.begin("writing", across * down);
  parallel_in_order(
      across * down,
      [&](std::size_t i) {
        const std::size_t row = i / across * rows, column = i % across * columns;
        std::vector<float> values(std::min(rows, report.steps - row) *
                                  std::min(columns, report.columns() - column));
        report.read(row, std::min(rows, report.steps - row), column,
                    std::min(columns, report.columns() - column), values.data());
        return values;
      },
      [&](std::size_t i, const std::vector<float>& values) {
        const std::size_t row = i / across * rows, column = i % across * columns;
        file.fill(data, row, std::min(rows, report.steps - row), column,
                  std::min(columns, report.columns() - column), values.data());
        progress.advance();
      });
  progress.end();
  file.close();
  place.commit();
}

std::vector<Spikes> read_sonata_spikes(const fs::path& path, const std::string& population) {
  const hdf5::File file(path);
  if (file.kind("/spikes/gids") != hdf5::Kind::none)
    file.refuse(
        "has the spikes of no population (an early layout of SONATA); move /spikes/timestamps and "
        "/spikes/gids to "
        "/spikes/<population>/timestamps and node_ids");
  std::vector<Spikes> all;
  for (const std::string& name : populations_of(file, "/spikes", population, "spikes")) {
    const std::string times = "/spikes/" + name + "/timestamps", nodes = "/spikes/" + name + "/node_ids";
    Spikes spikes{path.string(), name, file.doubles(times), counts(file, nodes)};
    if (spikes.times.size() != spikes.nodes.size())
      file.refuse(fmt::format("{} has {} entries and {} has {}; they must be as many", times,
                              spikes.times.size(), nodes, spikes.nodes.size()));
    const double unit = milliseconds(file, times);
    for (double& time : spikes.times) time *= unit;
    all.push_back(std::move(spikes));
  }
  return all;
}

}  // namespace forest::io
