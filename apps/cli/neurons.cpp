// SPDX-License-Identifier: Apache-2.0
#include "apps/cli/neurons.h"

#include <algorithm>

#include <CLI/App.hpp>
#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "forest/core/error.h"
#include "forest/core/number.h"
#include "forest/core/parallel.h"
#include "forest/repository/names.h"

namespace forest::cli {

using namespace repository;

namespace {

// Of "#12", and of "12" where nothing is called so.
std::optional<NeuronId> id_of(const std::string& text) {
  const auto id = number_of<std::uint32_t>(std::string_view(text).substr(text.starts_with('#')));
  return id && *id ? std::optional(NeuronId(*id)) : std::nullopt;
}

NeuronRow pick(const Repository& repository, const std::string& name, const std::string& population) {
  auto found = repository.find(name, population);
  if (found.size() > 1) {
    std::string populations;
    for (const NeuronRow& row : found) populations += (populations.empty() ? "" : ", ") + row.population;
    throw Error(fmt::format("{} neurons are called '{}'; say --population with one of: {}", found.size(),
                            name, populations));
  }
  if (found.size() == 1) return found[0];
  if (const auto id = id_of(name))
    if (auto row = repository.neuron(*id); row && (population.empty() || row->population == population))
      return *row;
  throw Error(fmt::format("there is no neuron {}{}; brainforest list shows those that are there", shown(name),
                          population.empty() ? "" : " in population " + shown(population)));
}

}  // namespace

Repository open_to_write(const std::string& repo) {
  Repository::open(repo, Access::read);
  return Repository::open(repo, Access::write);
}

std::vector<NeuronRow> pick_neurons(const Repository& repository, const std::vector<std::string>& names,
                                    const std::string& population) {
  std::vector<NeuronRow> rows;
  if (names.empty()) {
    rows = repository.neurons(population);
    const auto populations = repository.populations();
    if (!population.empty() &&
        std::ranges::find(populations, population, &PopulationRow::name) == populations.end()) {
      std::string known;
      for (const PopulationRow& p : populations) known += (known.empty() ? "" : ", ") + p.name;
      throw Error(fmt::format("there is no population {}; {}", shown(population),
                              known.empty() ? "the repository is empty" : "those that are there: " + known));
    }
  }
  for (const std::string& name : names) rows.push_back(pick(repository, name, population));
  return rows;
}

void each_neuron(const std::string& repo, std::span<const NeuronRow> rows, const char* stage,
                 Progress& progress, const UseNeuron& use) {
  progress.begin(stage, rows.size());
  parallel_ranges(rows.size(), 16, [&](std::size_t begin, std::size_t end) {
    const Repository repository = Repository::open(repo, Access::read);  // an object belongs to one thread
    for (std::size_t i = begin; i < end; ++i) {
      use(i, [&] { return repository.morphology(rows[i].id); });
      progress.advance();
    }
  });
  progress.end();
}

nlohmann::ordered_json json_of(const NeuronRow& row) {
  nlohmann::ordered_json out{{"id", row.id.value()}, {"name", row.name}, {"population", row.population}};
  for (const auto& [key, value] : {std::pair{"species", &row.species}, std::pair{"region", &row.region},
                                   std::pair{"layer", &row.layer}, std::pair{"type", &row.type}})
    if (!value->empty()) out[key] = *value;
  out.update({{"stems", row.stems},
              {"sections", row.sections},
              {"points", row.points},
              {"spines", row.spines},
              {"length", row.length}});
  auto& provenance = out["provenance"];
  if (const auto* grown = std::get_if<Grown>(&row.provenance))
    provenance = {{"origin", "grown"},
                  {"grammar", grown->grammar},
                  {"grammar_hash", grown->grammar_hash},
                  {"seed", grown->seed},
                  {"index", grown->index}};
  else if (const auto* traced = std::get_if<Traced>(&row.provenance))
    provenance = {{"origin", "traced"}, {"file", escaped(traced->file)}, {"hash", traced->hash}};
  provenance["program"] = row.program;
  return out;
}

std::string source_of(const NeuronRow& row) {
  if (const auto* grown = std::get_if<Grown>(&row.provenance))
    return fmt::format("{}, seed {}, index {}", grown->grammar, grown->seed, grown->index);
  return escaped(std::get<Traced>(row.provenance).file);
}

std::string micrometres(double value) { return fmt::format("{:.1f}", value); }

void must_be_name(CLI::Option& option) {
  option.check([](const std::string& name) {
    return is_name(name)
               ? std::string()
               : fmt::format("{} is no name; take 1 to {} bytes of UTF-8 without control characters",
                             shown(name), max_name);
  });
}

}  // namespace forest::cli
