// SPDX-License-Identifier: Apache-2.0
// brainforest grow: neurons from a grammar, into a repository, a folder of SWC files or one file of cells.
#include "forest/lsystem/grow.h"

#include <algorithm>
#include <memory>
#include <optional>

#include <CLI/App.hpp>
#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "forest/core/error.h"
#include "forest/core/parallel.h"
#include "forest/io/format.h"
#include "forest/lsystem/derive.h"
#include "forest/lsystem/turtle.h"
#include "forest/morphology/measure.h"
#include "forest/repository/names.h"
#include "forest/repository/repository.h"

#include "apps/cli/console.h"
#include "apps/cli/environment_options.h"
#include "apps/cli/files.h"
#include "apps/cli/grammars.h"
#include "apps/cli/grow_cells.h"
#include "apps/cli/options.h"
#include "apps/cli/ranks.h"
#include "apps/cli/verb.h"

namespace forest::cli {
namespace {

struct Options {
  std::string grammar, model, repo, population;
  std::filesystem::path out;
  std::size_t count = 1;
  std::uint64_t seed = 0;
  std::uint32_t time_lapse = 0;  // steps between pictures of a growing neuron; 0: only the grown one
  bool force = false;
  EnvironmentOptions environment;
};

constexpr std::size_t batch = 2000;  // neurons compared at a time
constexpr std::size_t stored =
    500;  // as one transaction: their pages fit into memory, so that readers wait for none

std::filesystem::path file_of(const std::filesystem::path& folder, const std::string& name) {
  return folder / (repository::file_name(name) + ".swc");  // a model may have any name
}

struct Younger {
  int step;
  Morphology neuron;
};

struct Ready {
  Morphology neuron;
  std::optional<repository::Prepared> prepared;  // when it goes into a repository
  std::vector<Younger> younger;                  // for a time lapse, up to the last step
};

/// After which steps a time lapse shows a neuron: the last one among them.
std::vector<int> moments(const Options& options, const lsystem::Grammar& grammar) {
  std::vector<int> steps;
  if (options.time_lapse == 0) return steps;
  for (std::int64_t step = options.time_lapse; step < grammar.steps; step += options.time_lapse)
    steps.push_back(int(step));
  steps.push_back(grammar.steps);
  return steps;
}

std::string name_at(const std::string& name, int step) { return fmt::format("{}-step{:06}", name, step); }

/// Where grown neurons go.
class Destination {
 public:
  virtual ~Destination() = default;
  virtual void put(Ready& neuron, const std::string& name, std::uint64_t index) = 0;
  virtual void finish() = 0;
  virtual std::string told() const = 0;              // where they are, for a person
  virtual nlohmann::ordered_json facts() const = 0;  // and for a machine
};

class IntoRepository final : public Destination {
 public:
  IntoRepository(const Options& options, const lsystem::Grammar& grammar)
      : options_(options),
        name_(grammar.name),
        population_(options.population.empty() ? name_ : options.population),
        grammar_(grammar) {
    if (std::filesystem::exists(options.repo)) open();
  }

  ~IntoRepository() override {
    if (!made_ || kept_) return;
    transaction_.reset(), repository_.reset();  // nothing was stored: no repository without a neuron is left
    std::error_code none;
    std::filesystem::remove(options_.repo, none);
  }
  void put(Ready& neuron, const std::string& name, std::uint64_t index) override {
    if (!repository_) open();
    if (!transaction_) transaction_.emplace(repository_->begin());
    if (hash_.empty())  // with the first neurons: no model is left without any
      hash_ = repository_->add_grammar(grammar_.name, grammar_.text, distributions_of(grammar_));
    const auto added = repository_->add(std::move(*neuron.prepared),
                                        {.name = name,
                                         .population = population_,
                                         .provenance = repository::Grown{name_, hash_, options_.seed, index},
                                         .number_if_taken = true});
    there_ += added.already_there;
    if (++count_ % stored == 0) finish();
  }
  void finish() override {
    if (transaction_) transaction_->commit(), kept_ = true;
    transaction_.reset();
  }
  std::string told() const override {
    return fmt::format(
        "stored in {} as population {}{}", repository::escaped(options_.repo),
        repository::escaped(population_),
        there_ ? fmt::format("; {} of them {} there already", there_, there_ == 1 ? "was" : "were") : "");
  }

  nlohmann::ordered_json facts() const override {
    return {{"repository", options_.repo}, {"population", population_}, {"there_before", there_}};
  }

 private:
  void open() {
    std::error_code none;
    made_ = !std::filesystem::exists(options_.repo, none);
    repository_.emplace(repository::Repository::open(options_.repo, repository::Access::write));
  }

  const Options& options_;
  std::string name_, population_;
  const lsystem::Grammar& grammar_;
  std::optional<repository::Repository> repository_;  // made when there is something to store
  std::optional<repository::Repository::Transaction> transaction_;
  std::string hash_;
  std::size_t count_ = 0, there_ = 0;
  bool made_ = false, kept_ = false;  // the file, by us; and something in it
};

class IntoFolder final : public Destination {
 public:
  explicit IntoFolder(std::filesystem::path folder) : folder_(std::move(folder)) {
    std::error_code error;
    made_ = std::filesystem::create_directories(folder_, error);
    if (error)
      throw Error(fmt::format("{}: the folder cannot be made ({}); choose another", folder_.string(),
                              error.message()));
  }
  ~IntoFolder() override {
    std::error_code none;
    for (const auto& file : unfinished_) std::filesystem::remove(file, none);
    if (made_ && std::filesystem::is_empty(folder_, none)) std::filesystem::remove(folder_, none);
  }
  void put(Ready& ready, const std::string& name, std::uint64_t) override {
    write(name, ready.neuron);
    for (const Younger& y : ready.younger) write(name_at(name, y.step), y.neuron);
  }
  void finish() override { unfinished_.clear(); }
  std::string told() const override {
    return fmt::format("written as SWC files into {}", repository::escaped(folder_.string()));
  }
  nlohmann::ordered_json facts() const override { return {{"folder", folder_.string()}}; }

 private:
  void write(const std::string& name, const Morphology& neuron) {
    const auto file = file_of(folder_, name);
    if (!std::filesystem::exists(file)) unfinished_.push_back(file);
    io::write(file, neuron);
  }

  std::filesystem::path folder_;
  bool made_ = false;  // by us
  std::vector<std::filesystem::path> unfinished_;
};

std::string name_of(const Options& options, const lsystem::Grammar& grammar, std::size_t index) {
  return grown_name(grammar, options.seed, index);
}

/// Refuses when a file is there that does not hold the neuron it is named after. Only where there are files is anything
/// grown for this.
void refuse_to_replace(const Options& options, const lsystem::Grammar& grammar, const cortex::Site& site,
                       Console& console) {
  if (options.force || options.out.empty() || !holds_files(options.out)) return;
  Overwrites overwrites;
  const io::Format& format = *io::find_format("swc");
  for (std::size_t first = 0; first < options.count; first += batch) {
    const std::size_t count = std::min(batch, options.count - first);
    std::vector<std::filesystem::path> files;
    for (std::size_t i = 0; i < count; ++i)
      files.push_back(file_of(options.out, name_of(options, grammar, first + i)));
    std::vector<bool> there;
    for (const auto& file : files) there.push_back(std::filesystem::exists(file));
    if (std::ranges::find(there, true) == there.end()) continue;
    const auto neurons =
        lsystem::grow_population(grammar, count, options.seed, console.progress(), first, site);
    for (std::size_t i = 0; i < count; ++i)
      if (there[i]) overwrites.look(files[i], format.write(neurons[i]));
  }
  lsystem::Deriver deriver(grammar, site);
  for (const int step : moments(options, grammar))
    for (std::size_t i = 0; i < options.count; ++i)
      if (const auto file = file_of(options.out, name_at(name_of(options, grammar, i), step));
          std::filesystem::exists(file))
        overwrites.look(file, format.write(lsystem::grow_to(deriver, grammar, options.seed, i, step)));
  overwrites.refuse();
}

lsystem::Grammar grammar_of(const Options& options) {
  return options.model.empty() ? find_grammar(options.grammar)
                               : grammar_of_model(options.repo, options.model);
}

void report(const Options& options, const lsystem::Grammar& grammar, const io::CellsTotal& total,
            nlohmann::ordered_json more, Console& console) {
  nlohmann::ordered_json out{{"grammar", grammar.name},    {"title", grammar.title},
                             {"seed", options.seed},       {"neurons", options.count},
                             {"segments", total.segments}, {"length", total.length}};
  out.update(more);
  console.print(out);
  if (total.segments == 0)
    console.warn("no neuron has a segment; look at the axiom and productions of the grammar");
  const double count = double(options.count);
  console.table(
      {"grammar", "neurons", "segments each", "length each (µm)"},
      {{repository::escaped(grammar.name), fmt::format("{}", options.count),
        fmt::format("{:.0f}", double(total.segments) / count), fmt::format("{:.0f}", total.length / count)}});
}

void run_into_cells(const Options& options, Console& console) {
  const auto ranks = join_ranks();
  const CellsGrown grown =
      grow_cells([&] { return grammar_of(options); },
                 {options.out, options.count, options.seed, options.force}, *ranks, console);
  if (!ranks->first()) return;
  tell_doubts(grown.grammar, console);
  report(options, grown.grammar, grown.total,
         {{"file", options.out.string()}, {"bytes", grown.bytes}, {"there_before", grown.there}}, console);
  if (grown.there) console.say(fmt::format("{} of them were there already", grown.there));
}

// Refuses the name of a neuron's file: nobody means a folder by it that is not there.
void must_be_folder(const std::filesystem::path& out) {
  const std::string extension = extension_of(out);
  const auto ends_so = [&](const io::Format& f) { return std::ranges::count(f.extensions, extension) > 0; };
  std::error_code none;
  if (!std::filesystem::is_directory(out, none) && std::ranges::any_of(io::formats(), ends_so))
    throw Error(
        fmt::format("{}: neurons grow into a folder of SWC files, or into one file NAME.cells; name a "
                    "folder",
                    repository::escaped(out.string())));
}

void run(const Options& options, Console& console) {
  if (is_cells_file(options.out)) return run_into_cells(options, console);
  if (container_of(options.out))
    throw Error(fmt::format(
        "{}: neurons grow into a folder of SWC files or into one file NAME.cells; grow that and convert it",
        repository::escaped(options.out.string())));
  must_be_folder(options.out);
  if (started_ranks() > 1)
    throw Error(
        "programs that mpirun started grow into one file of cells; name it with --out NAME.cells, or leave "
        "mpirun out");
  const lsystem::Grammar grammar = grammar_of(options);
  tell_doubts(grammar, console);
  const Surroundings surroundings(options.environment, console);
  const cortex::Site& site = surroundings.site();
  if (site.environment && !lsystem::heeds_surroundings(grammar))
    console.warn(
        fmt::format("{} never asks what is around it, so the environment changes nothing but where its "
                    "neurons stand; docs/lsystem/environment.md says how to ask",
                    grammar.name));
  refuse_to_replace(options, grammar, site, console);
  std::vector<std::unique_ptr<Destination>> destinations;
  if (!options.repo.empty()) destinations.push_back(std::make_unique<IntoRepository>(options, grammar));
  if (!options.out.empty()) destinations.push_back(std::make_unique<IntoFolder>(options.out));

  std::vector<int> steps = moments(options, grammar);
  std::size_t longest = 0;  // of them, until all were full-grown
  io::CellsTotal total;
  console.progress().begin("growing", options.count);
  parallel_in_order(
      options.count,
      [&](std::size_t i) {
        Ready ready{lsystem::grow(grammar, options.seed, i, site), {}, {}};
        if (!options.repo.empty()) ready.prepared.emplace(ready.neuron);
        lsystem::Deriver deriver(grammar, site);
        for (const int step : steps) {
          ready.younger.push_back({step, lsystem::grow_to(deriver, grammar, options.seed, i, step)});
          if (deriver.full_grown()) break;
        }
        return ready;
      },
      [&](std::size_t i, Ready&& ready) {
        const std::string name = name_of(options, grammar, i);
        for (const auto& destination : destinations) destination->put(ready, name, i);
        longest = std::max(longest, ready.younger.size());
        total.segments += ready.neuron.segment_count();
        total.length += total_length(ready.neuron);
        console.progress().advance();
      });
  console.progress().end();
  for (const auto& destination : destinations) destination->finish();

  nlohmann::ordered_json facts = nlohmann::ordered_json::object();
  steps.resize(longest);
  if (!steps.empty()) facts["steps"] = steps;
  for (const auto& destination : destinations) facts.update(destination->facts());
  report(options, grammar, total, facts, console);
  for (const auto& destination : destinations) console.say(destination->told());
}

}  // namespace

std::function<void()> grow(CLI::App& command, Console& console) {
  const auto options = std::make_shared<Options>();
  CLI::Option_group* from = command.add_option_group("from", "what grows");
  from->add_option("--grammar", options->grammar,
                   fmt::format("{}, or a file in the notation of docs/lsystem/notation.md",
                               fmt::join(built_in_grammars(), ", ")));
  CLI::Option* model =
      from->add_option("--model", options->model, "A model of the repository: NAME, or NAME@version");
  from->require_option(1);
  must_be_whole(*command.add_option("--count", options->count, "Neurons to grow")->capture_default_str(), 1,
                100'000'000);
  add_seed(command, options->seed, "The same seed grows the same neurons");
  CLI::Option_group* into = command.add_option_group("into", "where the neurons go");
  CLI::Option* repo = into->add_option("--repo", options->repo, "Store them in this repository");
  CLI::Option* out = into->add_option("--out", options->out,
                                      "Write them into this folder as SWC files, or into one file where it "
                                      "ends in .cells; that is continued after an interruption");
  into->require_option(1, 2);
  model->needs(repo);
  CLI::Option* lapse =
      command
          .add_option("--time-lapse", options->time_lapse,
                      "Write every neuron also as it was after each so many steps, as NAME-step000010.swc")
          ->type_name("STEPS")
          ->needs(out);
  must_be_whole(*lapse, 1, 1'000'000);
  add_environment(command, options->environment);
  add_force(command, options->force);
  command.add_option("--population", options->population, "Their population; by default the grammar's name")
      ->needs(repo);
  command.parse_complete_callback([options, repo, model] {
    if (!is_cells_file(options->out)) return;
    if (options->time_lapse)
      throw CLI::ValidationError(
          "--time-lapse: the younger neurons are written as SWC files; name a folder with --out");
    if (!options->environment.file.empty())
      throw CLI::ValidationError(
          "--environment: neurons that ask what is around them go into a folder or a repository");
    if (repo->count() && !model->count())
      throw CLI::ValidationError(
          "--repo: a file of cells is grown by itself; import it into the repository afterwards");
  });
  return [options, &console] { run(*options, console); };
}

}  // namespace forest::cli
