// SPDX-License-Identifier: Apache-2.0
// brainforest import: files into a repository. Files are read on all cores and stored in the order of their names, each in
// a transaction of its own, so the bytes of the repository do not depend on the number of threads. A workbook that export
// wrote brings back what was changed in it (revise.h).
#include <algorithm>
#include <filesystem>
#include <iterator>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <utility>

#include <CLI/App.hpp>
#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "forest/core/error.h"
#include "forest/core/file.h"
#include "forest/core/hash.h"
#include "forest/core/parallel.h"
#include "forest/io/format.h"
#include "forest/repository/names.h"
#include "forest/repository/repository.h"

#include "apps/cli/console.h"
#include "apps/cli/filed_neurons.h"
#include "apps/cli/files.h"
#include "apps/cli/neurons.h"
#include "apps/cli/oddities.h"
#include "apps/cli/revise.h"
#include "apps/cli/verb.h"

namespace forest::cli {
namespace {

namespace fs = std::filesystem;
using namespace repository;

struct Options {
  std::vector<std::string> files;
  std::string repo;
  NewNeuron about;  // what all of them share
  bool verbose = false, dry_run = false;
};

/// A neuron on its way into the repository.
struct Arrival {
  fs::path path;
  std::string name;
  std::vector<io::Warning> oddities;
  std::optional<Prepared> prepared;
  std::string hash;
  std::string error;     // why it could not be read; empty when it could
  bool skipped = false;  // it holds no neuron, and lay in a folder
  std::optional<Added> added;
  std::size_t sections = 0, warnings = 0;
};

/// With what it is known by.
struct Hashed : OpenFile {
  std::string hash = hash_hex(file.bytes());

  using OpenFile::OpenFile;
};

/// What is read at a time: a file, or some cells of one that holds more than fit into memory.
struct Source {
  fs::path path;
  std::shared_ptr<const Hashed> opened;
  std::size_t begin = 0, end = 0;
};

Arrival read(const fs::path& path, const Hashed& opened, std::size_t i) {
  io::Cell cell = opened.cells.read(i);
  Arrival arrival;
  arrival.path = path;
  arrival.name = escaped(path.stem().string());
  arrival.hash = opened.hash;
  if (opened.cells.count > 1) {  // cells of one file are told apart by their names in it
    const std::string name = escaped(cell.name);
    arrival.name += "-" + (is_name(name) ? name : std::to_string(i + 1));
    arrival.hash += fmt::format("#{}", i + 1);
  }
  arrival.sections = cell.read.morphology.sections().size();
  arrival.warnings = io::count_of(cell.read.warnings);
  arrival.oddities = std::move(cell.read.warnings);
  arrival.prepared.emplace(std::move(cell.read.morphology));
  return arrival;
}

/// The neurons of a source: nearly always one.
std::vector<Arrival> read(const Source& source, const Options& options) {
  std::vector<Arrival> arrivals;
  const auto guarded = [&](const auto& act) {
    try {
      act();
    } catch (const Error& error) {
      Arrival& failed = arrivals.emplace_back();
      failed.path = source.path;
      failed.error = error.what();
      failed.skipped = may_skip(error, source.path, options.files);
    }
  };
  guarded([&] {
    const auto opened = source.opened ? source.opened : std::make_shared<const Hashed>(source.path);
    for (std::size_t i = source.begin, end = source.opened ? source.end : opened->cells.count; i < end; ++i)
      guarded([&] { arrivals.push_back(read(source.path, *opened, i)); });
  });
  return arrivals;
}

/// Files of cells in pieces, so that as little of them is in memory as of others.
std::vector<Source> sources_of(const std::vector<fs::path>& paths) {
  constexpr std::size_t piece = 8;
  std::vector<Source> sources;
  for (const fs::path& path : paths) {
    try {
      const auto opened = is_cells_file(path) ? std::make_shared<const Hashed>(path) : nullptr;
      if (!opened) sources.push_back({path, nullptr});
      for (std::size_t i = 0; opened && i < opened->cells.count; i += piece)
        sources.push_back({path, opened, i, std::min(i + piece, opened->cells.count)});
    } catch (const InputError&) {  // told when its turn comes
      sources.push_back({path, nullptr});
    }
  }
  return sources;
}

const char* outcome(const Arrival& file) {
  return file.skipped                ? "skipped"
         : !file.added               ? "not read"
         : file.added->already_there ? "already there"
                                     : "stored";
}

/// A line each; one for all that came alike from a file of very many.
std::vector<std::vector<std::string>> lines_of(const std::vector<Arrival>& files) {
  constexpr std::ptrdiff_t many = 50;
  std::vector<std::vector<std::string>> lines;
  for (auto begin = files.begin(); begin != files.end();) {
    const auto end = std::find_if(begin, files.end(), [&](const Arrival& file) {
      return file.path != begin->path || outcome(file) != std::string_view(outcome(*begin));
    });
    const std::string path = escaped(begin->path.string());
    if (end - begin > many) {
      std::size_t sections = 0, warnings = 0;
      for (auto file = begin; file != end; ++file) sections += file->sections, warnings += file->warnings;
      lines.push_back({path, fmt::format("{} neurons", end - begin), std::to_string(sections),
                       std::to_string(warnings), outcome(*begin)});
      begin = end;
    }
    for (; begin != end; ++begin)
      lines.push_back(begin->added
                          ? std::vector{path, begin->added->name, std::to_string(begin->sections),
                                        std::to_string(begin->warnings), std::string(outcome(*begin))}
                          : std::vector<std::string>{path, "-", "-", "-", outcome(*begin)});
  }
  return lines;
}

void report(const std::vector<Arrival>& files, const Options& options, Console& console) {
  nlohmann::ordered_json list = nlohmann::ordered_json::array();
  std::size_t stored = 0, there = 0, failed = 0, skipped = 0, warnings = 0;
  const bool of_many = std::ranges::adjacent_find(files, {}, &Arrival::path) != files.end();
  for (const Arrival& file : files) {
    const std::string path = escaped(file.path.string());
    nlohmann::ordered_json entry{{"file", path}, {"outcome", outcome(file)}};
    if (file.added) {
      entry.update({{"id", file.added->id.value()},
                    {"name", file.added->name},
                    {"sections", file.sections},
                    {"warnings", file.warnings}});
      (file.added->already_there ? there : stored) += 1;
    } else {
      entry["error"] = file.error;
      ++(file.skipped ? skipped : failed);
    }
    warnings += file.warnings;
    list.push_back(std::move(entry));
  }
  console.table({"file", "neuron", "sections", "warnings", ""}, lines_of(files));
  console.say(fmt::format(
      "{} stored, {} already there, {} not read, {} skipped{}", stored, there, failed, skipped,
      warnings
          ? fmt::format("; {}{}", counted(warnings, "warning"), options.verbose ? "" : ", shown by --verbose")
          : ""));
  std::vector<OddFile> odd;
  for (const Arrival& file : files) odd.push_back({escaped(file.path.string()), &file.oddities});
  report_oddities(odd, console);
  console.print({{"repository", options.repo},
                 {"population", options.about.population},
                 {"stored", stored},
                 {"already_there", there},
                 {"failed", failed},
                 {"skipped", skipped},
                 {"oddities", warnings},
                 {"files", list}});
  if (failed)
    throw Error(fmt::format("{} of {} could not be read; the sentences above say why", failed,
                            counted(files.size(), of_many ? "neuron" : "file")));
}

/// What a workbook cannot be imported with. Its neurons have their populations and say the rest themselves.
void run_workbook(const Options& options, Console& console) {
  const std::string& file = options.files[0];
  if (options.files.size() > 1)
    throw Error(fmt::format("{} is a workbook of neurons that are in the repository; import it alone",
                            escaped(file)));
  const NewNeuron& about = options.about;
  if (!about.species.empty() || !about.region.empty() || !about.layer.empty() || !about.type.empty() ||
      about.population != NewNeuron().population)
    throw Error(
        fmt::format("{} is a workbook, which says itself what its neurons are; leave out --population, "
                    "--species, --region, --layer and --type",
                    escaped(file)));
  revise({file, options.repo, options.dry_run, options.verbose}, console);
}

void run(const Options& options, Console& console) {
  if (const auto workbook = std::ranges::find_if(options.files, is_workbook);
      workbook != options.files.end()) {
    Options first = options;
    std::swap(first.files.front(), first.files[std::size_t(workbook - options.files.begin())]);
    return run_workbook(first, console);
  }
  if (options.dry_run)
    throw Error("--dry-run tells what a workbook would change; leave it out to import files");
  const std::vector<Source> sources = sources_of(neuron_files(options.files, console));
  std::vector<Arrival> files;
  std::optional<Repository> repository;  // made when there is something to store
  if (fs::exists(options.repo)) repository = Repository::open(options.repo, Access::write);
  const std::size_t window = 64;  // sources in memory at a time, and stored in one transaction
  std::size_t done = 0;
  std::set<std::string> told;
  console.progress().begin("importing", sources.size());
  for (std::size_t first = 0; first < sources.size(); first += window) {
    const std::size_t count = std::min(window, sources.size() - first), begin = files.size();
    std::vector<std::vector<Arrival>> arrived(count);
    parallel_for(count, 1, [&](std::size_t i) {
      arrived[i] = read(sources[first + i], options);
      console.progress().advance();
    });
    for (auto& arrivals : arrived) std::ranges::move(arrivals, std::back_inserter(files));
    std::optional<Repository::Transaction> transaction;
    std::size_t stored = 0;
    for (Arrival& file : std::span(files).subspan(begin)) {
      if (!file.error.empty()) {
        // A file of many cells says the same of each.
        if (told.insert(file.error).second)
          console.warn(file.skipped ? file.error + "; skipped" : file.error);
        continue;
      }
      if (options.verbose) tell_oddities({escaped(file.path.string()), &file.oddities}, console);
      NewNeuron neuron = options.about;
      neuron.name = file.name;
      neuron.number_if_taken = true;
      neuron.provenance = Traced{file.path.string(), file.hash};
      try {
        if (!repository) repository = Repository::open(options.repo, Access::write);
        if (!transaction) transaction.emplace(repository->begin());
        file.added = repository->add(std::move(*file.prepared), neuron);
      } catch (const Error& error) {  // the repository's trouble, not the file's
        throw Error(fmt::format("{} ({} stored)", error.what(), counted(done, "neuron is", "neurons are")));
      }
      stored += !file.added->already_there;
      if (file.added->name != neuron.name)
        console.warn(file.added->already_there
                         ? fmt::format("{}: is the same file as that of neuron '{}', which is already there",
                                       escaped(file.path.string()), file.added->name)
                         : fmt::format("{}: another neuron is called '{}', so this one is stored as '{}'",
                                       escaped(file.path.string()), neuron.name, file.added->name));
      file.prepared.reset();
    }
    if (transaction) transaction->commit();
    done += stored;
  }
  console.progress().end();
  report(files, options, console);
}

}  // namespace

std::function<void()> import_files(CLI::App& command, Console& console) {
  const auto options = std::make_shared<Options>();
  command
      .add_option(
          "files", options->files,
          "Files of traced neurons, or folders with such files below them; or one workbook that export "
          "wrote, whose changes are taken over")
      ->required()
      ->type_name("FILES");
  command
      .add_option("--repo", options->repo,
                  "The repository, made when there is none: a file, or postgresql://role@host/database")
      ->required()
      ->type_name("REPO");
  must_be_name(
      *command.add_option("--population", options->about.population, "The population they are to belong to")
           ->capture_default_str());
  command.add_option("--species", options->about.species, "Their species, for example \"Rattus norvegicus\"");
  command.add_option("--region", options->about.region, "Their brain region");
  command.add_option("--layer", options->about.layer, "Their layer");
  command.add_option("--type", options->about.type, "Their cell type");
  command.add_flag("--verbose", options->verbose,
                   "Show every oddity: file, line, what stands there and how it was read");
  command.add_flag("--dry-run", options->dry_run, "Of a workbook: only tell what it would change");
  return [options, &console] { run(*options, console); };
}

}  // namespace forest::cli
