// SPDX-License-Identifier: Apache-2.0
// brainforest export: neurons of a repository as files. The same neurons give the same bytes.
#include <algorithm>
#include <filesystem>
#include <memory>
#include <set>

#include <CLI/App.hpp>
#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "forest/core/error.h"
#include "forest/core/file.h"
#include "forest/io/format.h"
#include "forest/repository/names.h"

#include "apps/cli/console.h"
#include "apps/cli/files.h"
#include "apps/cli/neurons.h"
#include "apps/cli/options.h"
#include "apps/cli/tables.h"
#include "apps/cli/verb.h"

namespace forest::cli {
namespace {

namespace fs = std::filesystem;
using namespace repository;

struct Options {
  std::vector<std::string> names;
  std::string repo, population, format = "swc";
  fs::path out;
  bool force = false;
};

void run_tables(const Options& options, const std::vector<NeuronRow>& rows, Console& console) {
  const bool csv = options.format == "csv";
  const std::vector<fs::path> wanted = table_files(options.out, csv);
  if (!options.force) refuse_existing(wanted);
  const auto files = export_tables(options.repo, rows, options.out, csv, console);
  nlohmann::ordered_json list = nlohmann::ordered_json::array();
  for (const fs::path& file : files) list.push_back(file.string());
  console.print({{"format", options.format}, {"neurons", rows.size()}, {"files", list}});
  console.say(fmt::format("{} written to {}", counted(rows.size(), "neuron"), options.out.string()));
}

void report(const Options& options, const std::vector<NeuronRow>& rows, const std::vector<fs::path>& files,
            const std::vector<std::vector<io::Warning>>& losses, std::string_view format, Console& console) {
  nlohmann::ordered_json list = nlohmann::ordered_json::array();
  for (std::size_t i = 0; i < rows.size(); ++i) {
    nlohmann::ordered_json lost = nlohmann::ordered_json::array();
    for (const io::Warning& loss : losses[i]) {
      console.warn(fmt::format("{}: {}: {}", escaped(files[i].string()), loss.code, loss.sentence));
      lost.push_back({{"code", loss.code}, {"sentence", loss.sentence}});
    }
    list.push_back(
        {{"id", rows[i].id.value()}, {"name", rows[i].name}, {"file", files[i].string()}, {"losses", lost}});
  }
  console.print({{"format", format}, {"files", list}});
  console.say(fmt::format("{} written to {}", counted(rows.size(), "neuron"), options.out.string()));
}

/// All neurons into one file, under their names.
void run_together(const Options& options, const std::vector<NeuronRow>& rows, const io::Format& format,
                  Console& console) {
  std::set<std::string> populations;
  for (const NeuronRow& row : rows) populations.insert(row.population);
  std::vector<io::NamedMorphology> cells(rows.size());
  std::vector<std::vector<io::Warning>> losses(rows.size());
  each_neuron(options.repo, rows, "exporting", console.progress(), [&](std::size_t i, const auto& neuron) {
    const std::string name = file_name(rows[i].name);  // groups are separated by slashes as folders are
    cells[i] = {populations.size() > 1 ? file_name(rows[i].population) + '/' + name : name, neuron()};
    losses[i] = io::losses(cells[i].morphology, format.keeps);
  });
  const std::string bytes = format.write_all(cells);
  std::error_code error;
  if (options.out.has_parent_path() && (fs::create_directories(options.out.parent_path(), error), error))
    throw Error(fmt::format("{}: cannot be made ({}); name a folder that can be written",
                            options.out.parent_path().string(), error.message()));
  write_unless_there(options.out, bytes, options.force);
  report(options, rows, std::vector(rows.size(), options.out), losses, format.name, console);
}

void run(const Options& options, Console& console) {
  const auto rows =
      pick_neurons(Repository::open(options.repo, Access::read), options.names, options.population);
  if (rows.empty())
    throw Error(fmt::format("{} holds no neuron to export; import or grow some first", options.repo));
  if (options.format == "xlsx" || options.format == "csv") return run_tables(options, rows, console);
  if (const io::Format* const container = container_of(options.out))
    return run_together(options, rows, *container, console);
  const io::Format& format = *io::find_format(options.format);

  // Names are unique in a population only, so several populations get a folder each.
  std::set<std::string> populations;
  for (const NeuronRow& row : rows) populations.insert(row.population);
  std::vector<fs::path> files;
  for (const NeuronRow& row : rows) {
    const fs::path folder = populations.size() > 1 ? options.out / file_name(row.population) : options.out;
    files.push_back(folder / (file_name(row.name) + std::string(format.extensions[0])));
  }
  const auto each = [&](const char* stage, const UseNeuron& use) {
    each_neuron(options.repo, rows, stage, console.progress(), use);
  };
  const auto written = [&](std::size_t i, const Morphology& m) {
    try {
      return format.write(m);
    } catch (const LimitError& error) {
      throw LimitError(fmt::format("neuron {}: {}", shown(rows[i].name), error.what()));
    }
  };
  if (!options.force && holds_files(options.out)) {
    Overwrites overwrites;
    each("comparing", [&](std::size_t i, const auto& neuron) {
      if (fs::exists(files[i])) overwrites.look(files[i], written(i, neuron()));
    });
    overwrites.refuse();
  }
  std::error_code error;
  for (const std::string& population : populations)
    if (fs::create_directories(populations.size() > 1 ? options.out / file_name(population) : options.out,
                               error);
        error)
      throw Error(fmt::format("{}: cannot be made ({}); name a folder that can be written",
                              options.out.string(), error.message()));

  std::vector<std::vector<io::Warning>> losses(rows.size());
  each("exporting", [&](std::size_t i, const auto& neuron) {
    const Morphology m = neuron();
    losses[i] = io::losses(m, format.keeps);
    write_file(files[i], std::string_view(written(i, m)));
  });

  report(options, rows, files, losses, options.format, console);
}

}  // namespace

std::function<void()> export_files(CLI::App& command, Console& console) {
  const auto options = std::make_shared<Options>();
  std::vector<std::string> formats{"xlsx", "csv"};  // tables
  for (const io::Format& format : io::formats())
    if (format.write) formats.emplace_back(format.name);
  command.add_option("neurons", options->names,
                     "Neurons, by name, or by the id that list shows: 12 or '#12'; all when none is named");
  command.add_option("--repo", options->repo, "The repository")->required()->type_name("REPO");
  must_be_name(*command.add_option("--population", options->population, "Only those of this population"));
  command
      .add_option(
          "--format", options->format,
          "Format of the files; xlsx is one workbook of tables and charts, csv a file for each of its sheets")
      ->capture_default_str()
      ->check(CLI::IsMember(formats));
  command
      .add_option(
          "--out", options->out,
          "Folder for the files that are made, made when there is none; or the workbook; or one file for "
          "all, when it ends in .h5 or .cells")
      ->required()
      ->type_name("PATH");
  add_force(command, options->force);
  command.parse_complete_callback([options, &command] {
    const io::Format* const container = container_of(options->out);
    if (container && command.count("--format") && options->format != container->name)
      throw CLI::ValidationError(
          fmt::format("--format {} and --out {} say different formats; leave --format out", options->format,
                      options->out.string()));
    if (container) options->format = container->name;
  });
  return [options, &console] { run(*options, console); };
}

}  // namespace forest::cli
