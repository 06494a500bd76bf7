// SPDX-License-Identifier: Apache-2.0
// brainforest list: what a repository holds.
#include <memory>

#include <CLI/App.hpp>
#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "apps/cli/console.h"
#include "apps/cli/neurons.h"
#include "apps/cli/verb.h"

namespace forest::cli {

using namespace repository;

std::function<void()> list(CLI::App& command, Console& console) {
  struct Options {
    std::string repo, population, where;
  };
  const auto options = std::make_shared<Options>();
  command.add_option("--repo", options->repo, "The repository")->required()->type_name("REPO");
  must_be_name(
      *command.add_option("--population", options->population, "Only the neurons of this population"));
  command
      .add_option("--where", options->where,
                  "Only the neurons for which this holds: a condition in SQL on the columns of the view "
                  "neuron and on "
                  "the names of metrics (measure --list)")
      ->type_name("CONDITION");
  return [options, &console] {
    const Repository repository = Repository::open(options->repo, Access::read);
    const auto neurons = options->where.empty()
                             ? pick_neurons(repository, {}, options->population)
                             : repository.neurons_where(options->where, options->population);
    nlohmann::ordered_json out{{"populations", nlohmann::ordered_json::array()},
                               {"neurons", nlohmann::ordered_json::array()}};
    std::vector<std::vector<std::string>> lines;
    for (const NeuronRow& row : neurons) {
      out["neurons"].push_back(json_of(row));
      lines.push_back({std::to_string(row.id.value()), row.name, row.population, std::to_string(row.stems),
                       std::to_string(row.sections), std::to_string(row.points), micrometres(row.length),
                       source_of(row)});
    }
    if (!lines.empty()) {
      console.table({"id", "neuron", "population", "stems", "sections", "points", "length (µm)", "from"},
                    lines);
      console.say("");
    }
    lines.clear();
    if (!options->where.empty()) {
      console.say(fmt::format("{} neurons", neurons.size()));
      console.print(out);
      return;
    }
    for (const PopulationRow& row : repository.populations()) {
      if (!options->population.empty() && row.name != options->population) continue;
      out["populations"].push_back(
          {{"name", row.name}, {"neurons", row.neurons}, {"sections", row.sections}, {"length", row.length}});
      lines.push_back(
          {row.name, std::to_string(row.neurons), std::to_string(row.sections), micrometres(row.length)});
    }
    if (lines.empty())
      console.say(fmt::format("{} holds no neuron", options->repo));
    else
      console.table({"population", "neurons", "sections", "length (µm)"}, lines);
    console.print(out);
  };
}

}  // namespace forest::cli
