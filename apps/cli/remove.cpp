// SPDX-License-Identifier: Apache-2.0
// brainforest remove: neurons out of a repository, all that are named or none.
#include <memory>
#include <set>

#include <CLI/App.hpp>
#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "forest/core/error.h"
#include "forest/core/number.h"
#include "forest/repository/names.h"

#include "apps/cli/console.h"
#include "apps/cli/neurons.h"
#include "apps/cli/verb.h"

namespace forest::cli {
namespace {

using namespace repository;

struct Options {
  std::vector<std::string> names;
  std::string repo, population;
};

// A number that is no name may be that of a neuron which had it, is gone already, and must not take another with it.
void must_be_names(const Repository& repository, const Options& options) {
  for (const std::string& name : options.names)
    if (const auto id = number_of<std::uint32_t>(name);
        id && repository.find(name, options.population).empty())
      if (const auto row = *id ? repository.neuron(NeuronId(*id)) : std::nullopt)
        throw Error(fmt::format("no neuron is called '{0}'; that with the id {0}, {1}, is removed as '#{0}'",
                                *id, shown(row->name)));
}

void run(const Options& options, Console& console) {
  Repository repository = open_to_write(options.repo);
  must_be_names(repository, options);
  auto transaction = repository.begin();
  nlohmann::ordered_json list = nlohmann::ordered_json::array();
  std::vector<std::vector<std::string>> lines;
  std::set<std::size_t> done;  // one may be named twice, by name and by id
  for (const NeuronRow& row : pick_neurons(repository, options.names, options.population)) {
    if (!done.insert(row.id.value()).second) continue;
    repository.remove(row.id);
    list.push_back({{"id", row.id.value()}, {"name", row.name}, {"population", row.population}});
    lines.push_back({std::to_string(row.id.value()), row.name, row.population, source_of(row)});
  }
  transaction.commit();
  console.table({"id", "neuron", "population", "from"}, lines);
  console.say(fmt::format("{} removed from {}", counted(lines.size(), "neuron"), options.repo));
  console.print({{"repository", options.repo}, {"removed", list}});
}

}  // namespace

std::function<void()> remove_neurons(CLI::App& command, Console& console) {
  const auto options = std::make_shared<Options>();
  command.add_option("neurons", options->names, "Neurons, by name, or by the id that list shows, as '#12'")
      ->required()
      ->type_name("NEURONS");
  command.add_option("--repo", options->repo, "The repository")->required()->type_name("REPO");
  must_be_name(*command.add_option("--population", options->population, "Only those of this population"));
  return [options, &console] { run(*options, console); };
}

}  // namespace forest::cli
