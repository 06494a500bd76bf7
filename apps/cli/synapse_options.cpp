// SPDX-License-Identifier: Apache-2.0
#include "apps/cli/synapse_options.h"

#include <map>

#include <CLI/App.hpp>

#include "forest/core/error.h"

#include "apps/choice.h"

namespace forest::cli {

void add_synapses(CLI::App& command, SynapseOptions& options) {
  static const std::map<std::string, scene::SynapseColour> colours{{"sign", scene::SynapseColour::sign},
                                                                   {"target", scene::SynapseColour::target}};
  command.add_flag("--synapses", options.shown,
                   "Show the synapses: those of column.synapses beside column.forest, as pack wrote them");
  command.add_option("--synapse-file", options.file, "Show the synapses of this file");
  command
      .add_option("--synapse-colour", options.colour,
                  "What their colours mean: whether they excite or inhibit, or whose they are; by default as "
                  "the view says")
      ->transform(one_of(colours))
      ->option_text("sign|target");
}

std::optional<scene::Synapses> open_synapses(const SynapseOptions& options,
                                             const std::filesystem::path& forest_file,
                                             const scene::Forest& forest) {
  if (!options.shown && options.file.empty()) {
    if (options.colour) throw Error("--synapse-colour colours synapses; ask for them with --synapses");
    return std::nullopt;
  }
  const auto file = options.file.empty() ? scene::Synapses::beside(forest_file) : options.file;
  if (options.file.empty() && !std::filesystem::exists(file))
    throw InputError(file.string(), 0,
                     "is not there, so nothing is known of synapses; pack a circuit that has some (plant "
                     "--synapses makes some up), or name their file with --synapse-file");
  return scene::Synapses::open(file, forest);
}

}  // namespace forest::cli
