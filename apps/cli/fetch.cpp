// SPDX-License-Identifier: Apache-2.0
// brainforest fetch: cells of NeuroMorpho.Org, or of a service like it, into a folder or a repository. Each is written as
// soon as it is there; one that cannot be had does not stop the others, and the same command continues after a break.
#include <cstdlib>
#include <memory>
#include <optional>
#include <set>

#include <CLI/App.hpp>
#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "forest/core/error.h"
#include "forest/core/file.h"
#include "forest/fetch/service.h"
#include "forest/io/swc.h"
#include "forest/repository/names.h"
#include "forest/repository/repository.h"

#include "apps/cli/console.h"
#include "apps/cli/files.h"
#include "apps/cli/neurons.h"
#include "apps/cli/oddities.h"
#include "apps/cli/options.h"
#include "apps/cli/verb.h"

namespace forest::cli {
namespace {

namespace fs = std::filesystem;
using namespace repository;
using Json = nlohmann::ordered_json;

struct Options {
  std::vector<std::string> names;
  std::string query, repo, population = "default", from = "https://neuromorpho.org";
  fs::path out;
  std::size_t limit = 100, max_megabytes = 200;
  fetch::CacheOptions cache;
  fetch::Manners manners;
  bool force = false, verbose = false;
};

/// A cell that was asked for, and what became of it.
struct Arrival {
  std::string name;
  std::optional<fetch::Record> record;  // from a query; of a name it is still to be fetched
  fetch::Swc swc = {};
  std::size_t bytes = 0, sections = 0;
  std::vector<io::Warning> oddities = {};
  fs::path file = {};
  std::optional<Added> added = {};
  std::string error = {};  // empty when all went well
};

std::string outcome(const Arrival& cell) {
  if (!cell.error.empty()) return "failed";
  if (cell.added && cell.added->already_there) return "already there";
  return cell.swc.cached ? "from the cache" : "fetched";
}

/// What the service says of the cell, and where its file comes from: the same cell gives the same bytes.
std::string beside(const Arrival& cell) {
  const Json json{{"address", cell.swc.address},
                  {"bytes", cell.bytes},
                  {"hash", cell.swc.hash},
                  {"record", Json::parse(cell.record->json)}};
  return json.dump(2) + "\n";
}

void write_files(Arrival& cell, const Options& options) {
  const fs::path stem = options.out / file_name(cell.record->name);
  cell.file = fs::path(stem) += ".swc";
  const fs::path json_file = fs::path(stem) += ".json";
  const std::string json = beside(cell);
  if (!options.force) {
    Overwrites overwrites;
    overwrites.look(cell.file, cell.swc.bytes);
    overwrites.look(json_file, json);
    overwrites.refuse();
  }
  std::error_code error;
  fs::create_directories(options.out, error);
  if (error)
    throw Error(fmt::format("{}: the folder cannot be made ({}); name one that can be written",
                            options.out.string(), error.message()));
  write_file(cell.file, std::string_view(cell.swc.bytes));
  write_file(json_file, std::string_view(json));
}

void store(Arrival& cell, const Morphology& morphology, const Options& options,
           std::optional<Repository>& repository) {
  const fetch::Record& record = *cell.record;
  Annotations annotations = morphology.annotations();
  annotations.insert(annotations.end(), record.facts.begin(), record.facts.end());
  if (!repository) repository = Repository::open(options.repo, Access::write);
  cell.added = repository->add(morphology.with_annotations(std::move(annotations)),
                               {.name = record.name,
                                .population = options.population,
                                .species = record.species,
                                .region = record.region,
                                .layer = record.layer,
                                .type = record.type,
                                .provenance = Traced{cell.swc.address, cell.swc.hash},
                                .number_if_taken = true});
}

void fetch_one(Arrival& cell, const Options& options, fetch::Service& service,
               std::optional<Repository>& repository) {
  if (!cell.record) cell.record = service.record(cell.name);
  if (!is_name(cell.record->name))
    throw Error(
        fmt::format("{} is no name (too long, or no text); it is left out", shown(cell.record->name)));
  io::ReadResult read;
  cell.swc = service.swc(*cell.record, [&](std::string_view bytes) {
    read = io::read_swc(bytes, service.addresses().swc(cell.record->archive, cell.record->name));
  });
  cell.bytes = cell.swc.bytes.size();
  cell.sections = read.morphology.sections().size();
  cell.oddities = std::move(read.warnings);
  if (!options.out.empty()) write_files(cell, options);
  if (!options.repo.empty()) store(cell, read.morphology, options, repository);
}

void report(const std::vector<Arrival>& cells, const fetch::Selection& selection, const Options& options,
            Console& console) {
  std::vector<std::vector<std::string>> lines;
  Json list = Json::array();
  std::size_t failed = 0, cached = 0;
  for (const Arrival& cell : cells) {
    const fetch::Record about = cell.record.value_or(fetch::Record{});
    Json entry{{"name", escaped(cell.name)}, {"outcome", outcome(cell)}};
    if (cell.record)
      entry.update({{"archive", escaped(about.archive)},
                    {"species", about.species},
                    {"region", about.region},
                    {"layer", about.layer},
                    {"type", about.type}});
    if (!cell.file.empty()) entry["file"] = escaped(cell.file.string());
    if (cell.added) entry.update({{"id", cell.added->id.value()}, {"stored_as", cell.added->name}});
    if (cell.error.empty()) {
      entry.update({{"address", cell.swc.address},
                    {"bytes", cell.bytes},
                    {"hash", cell.swc.hash},
                    {"sections", cell.sections},
                    {"warnings", io::count_of(cell.oddities)}});
      cached += cell.swc.cached;
    } else {
      entry["error"] = cell.error;
      ++failed;
    }
    list.push_back(std::move(entry));
    const bool well = cell.error.empty();
    lines.push_back({escaped(cell.name), escaped(about.archive), escaped(about.species),
                     escaped(about.region), escaped(about.type), well ? std::to_string(cell.sections) : "-",
                     well ? std::to_string(io::count_of(cell.oddities)) : "-", outcome(cell)});
  }
  console.table({"neuron", "archive", "species", "region", "type", "sections", "warnings", ""}, lines);
  console.say(fmt::format(
      "{} fetched ({} of them from the cache), {} failed{}", cells.size() - failed, cached, failed,
      selection.total > selection.records.size()
          ? fmt::format("; {} match the query, --limit says how many are fetched", selection.total)
          : ""));
  std::vector<OddFile> odd;
  for (const Arrival& cell : cells) odd.push_back({escaped(cell.name), &cell.oddities});
  report_oddities(odd, console);
  Json result{{"from", options.from}, {"fetched", cells.size() - failed}, {"from_cache", cached},
              {"failed", failed},     {"matching", selection.total},      {"cells", list}};
  if (!selection.error.empty()) result["error"] = selection.error;
  console.print(result);
  if (!selection.error.empty())
    throw Error(fmt::format("the query's pages ended early; {}", selection.error));
  if (failed)
    throw Error(fmt::format("{} of {} could not be fetched; the sentences above say why", failed,
                            counted(cells.size(), "cell")));
}

void run(const Options& options, Console& console) {
  fetch::CacheOptions cache_options = options.cache;
  if (cache_options.folder.empty()) cache_options.folder = fetch::default_cache();
  cache_options.tell = [&](const std::string& sentence) { console.warn(sentence); };
  fetch::Cache cache(cache_options, options.manners);
  fetch::Service service(fetch::Addresses(options.from), cache, options.max_megabytes * 1'000'000);

  std::vector<Arrival> cells;
  std::set<std::string> named;  // each once
  for (const std::string& name : options.names)
    if (named.insert(name).second) cells.push_back({.name = name, .record = {}});
  fetch::Selection selection;
  if (!options.query.empty()) selection = service.select(options.query, options.limit, console.progress());
  for (const fetch::Record& record : selection.records)
    if (named.insert(record.name).second) cells.push_back({.name = record.name, .record = record});

  std::optional<Repository> repository;  // made when there is something to store
  console.progress().begin("fetching", cells.size());
  for (Arrival& cell : cells) {
    try {
      fetch_one(cell, options, service, repository);
      if (options.verbose) tell_oddities({escaped(cell.name), &cell.oddities}, console);
    } catch (const Error& error) {
      cell.error = error.what();
      console.warn(fmt::format("{}: {}", escaped(cell.name), cell.error));
    }
    cell.swc.bytes = {};  // thousands of cells need not be in memory
    console.progress().advance();
  }
  console.progress().end();
  report(cells, selection, options, console);
}

}  // namespace

std::function<void()> fetch_cells(CLI::App& command, Console& console) {
  const auto options = std::make_shared<Options>();
  options->manners.program = "BrainForest/" FOREST_VERSION " (brainforest fetch)";
  if (const char* file = std::getenv("SSL_CERT_FILE")) options->manners.certificates = file;
  command.add_option("neurons", options->names, "Names of neurons, or their numbers as NMO_123")
      ->type_name("NAMES");
  command.add_option(
      "--query", options->query,
      "Instead or also those for which field:value holds; several conditions are joined by AND");
  must_be_whole(
      *command.add_option("--limit", options->limit, "Neurons of the query at most")->capture_default_str(),
      1, 1'000'000);
  CLI::Option_group* into = command.add_option_group("into", "where the neurons go");
  into->add_option("--out", options->out,
                   "Write them into this folder, with what is said of them as JSON beside")
      ->type_name("DIR");
  CLI::Option* repo =
      into->add_option("--repo", options->repo, "Store them in this repository; made when there is none")
          ->type_name("REPO");
  into->require_option(1, 2);
  must_be_name(
      *command.add_option("--population", options->population, "The population they are to belong to")
           ->capture_default_str()
           ->needs(repo));
  command.add_option("--from", options->from, "Address of the service")
      ->capture_default_str()
      ->type_name("ADDRESS");
  command
      .add_option("--cache", options->cache.folder,
                  "Folder for what has come; by default brainforest in $XDG_CACHE_HOME or ~/.cache")
      ->type_name("DIR");
  CLI::Option* offline =
      command.add_flag("--offline", options->cache.offline, "Use the cache and no network");
  command.add_flag("--refresh", options->cache.refresh, "Ask whether what is in the cache has changed")
      ->excludes(offline);
  must_be_within(*command.add_option("--rate", options->manners.rate, "Requests a second at most")
                      ->capture_default_str(),
                 .001, 1000.);
  must_be_whole(*command
                     .add_option("--retries", options->cache.patience.retries,
                                 "How often to ask again when a transfer breaks off")
                     ->capture_default_str(),
                0, 20);
  must_be_within(
      *command.add_option("--timeout", options->manners.timeout, "Seconds to wait for a silent server")
           ->capture_default_str(),
      1., 3600.);
  must_be_whole(
      *command.add_option("--max-size", options->max_megabytes, "Largest file in MB")->capture_default_str(),
      1, 100'000);
  command.add_flag("--verbose", options->verbose,
                   "Show every oddity: cell, line, what stands there and how it was read");
  add_force(command, options->force);
  command.parse_complete_callback([options] {
    if (options->names.empty() && options->query.empty())
      throw CLI::ValidationError("say which neurons: their names, or --query \"field:value\"");
    try {
      (void)fetch::Addresses(options->from);
      if (!options->query.empty()) fetch::conditions(options->query);
    } catch (const Error& error) {
      throw CLI::ValidationError(error.what());
    }
  });
  return [options, &console] { run(*options, console); };
}

}  // namespace forest::cli
