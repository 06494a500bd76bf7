// SPDX-License-Identifier: Apache-2.0
// brainforest plant: neurons of a repository into a column, as a SONATA circuit.
#include <filesystem>
#include <memory>

#include <CLI/CLI.hpp>
#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "forest/io/sonata.h"

#include "apps/cli/console.h"
#include "apps/cli/options.h"
#include "apps/cli/planting.h"
#include "apps/cli/verb.h"

namespace forest::cli {
namespace {

struct Options {
  std::string recipe, repo;
  std::filesystem::path out;
  std::uint64_t seed = 0;
  std::uint32_t synapses = 0;
};

void run(const Options& options, Console& console) {
  const Planted planted =
      plant_from_repository(find_recipe(options.recipe), options.repo, options.seed, console.progress());
  const circuit::Circuit& circuit = planted.circuit;
  std::vector<circuit::Projection> projections;
  if (options.synapses)
    projections.push_back(circuit::made_up_synapses(circuit, planted.morphologies,
                                                    io::sonata_population(circuit), options.synapses,
                                                    options.seed, console.progress()));
  io::write_sonata(options.out, circuit, planted.morphologies, console.progress(), projections);
  const std::size_t synapses = projections.empty() ? 0 : projections.front().synapses.size();

  nlohmann::ordered_json list = nlohmann::ordered_json::array();
  std::vector<std::vector<std::string>> lines;
  for (const circuit::Tally& row : circuit::tally(circuit)) {
    const std::string &layer = circuit.layers[row.layer].name, &type = circuit.types[row.type].name;
    list.push_back({{"layer", layer}, {"type", type}, {"count", row.count}, {"density", row.density}});
    lines.push_back({layer, type, std::to_string(row.count), fmt::format("{:.0f}", row.density)});
  }
  console.print({{"circuit", options.out.string()},
                 {"name", circuit.name},
                 {"seed", options.seed},
                 {"radius", circuit.radius},
                 {"neurons", circuit.instances.size()},
                 {"morphologies", circuit.morphologies.size()},
                 {"made_up_synapses", synapses},
                 {"planted", list}});
  console.table({"layer", "type", "neurons", "neurons/mm³"}, lines);
  console.say(fmt::format("\n{} neurons of {} shapes are planted in {}", circuit.instances.size(),
                          circuit.morphologies.size(), options.out.string()));
  if (synapses)
    console.say(fmt::format("{} synapses are made up: nobody measured them, they are there to be looked at",
                            synapses));
}

}  // namespace

std::function<void()> plant(CLI::App& command, Console& console) {
  const auto options = std::make_shared<Options>();
  command
      .add_option("--recipe", options->recipe,
                  "A recipe (TOML), or the name of one that ships: column-1000, column-10000")
      ->required()
      ->type_name("FILE|NAME");
  command
      .add_option(
          "--repo", options->repo,
          "The repository the neurons come from; not needed where all types of the recipe have a grammar")
      ->type_name("REPO");
  command
      .add_option("--out", options->out,
                  "Folder of the SONATA circuit; a circuit of Brain Forest there is replaced")
      ->required()
      ->type_name("DIR");
  add_whole(command, "--synapses", options->synapses,
            "Make up so many synapses on each neuron, from others drawn by lot (docs/scene/synapses.md)", 0,
            100'000);
  add_seed(command, options->seed, "The same seed plants the same circuit");
  return [options, &console] { run(*options, console); };
}

}  // namespace forest::cli
