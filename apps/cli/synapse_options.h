// SPDX-License-Identifier: Apache-2.0
// Synapses in a picture, as render and movie take them (docs/scene/synapses.md).
#pragma once

#include <filesystem>
#include <optional>

#include "forest/scene/synapses.h"
#include "forest/scene/view.h"

namespace CLI {
class App;
}

namespace forest::cli {

struct SynapseOptions {
  bool shown = false;
  std::filesystem::path file;  // "": beside the forest file
  std::optional<scene::SynapseColour> colour;
};

/// --synapses, --synapse-file, --synapse-colour
void add_synapses(CLI::App& command, SynapseOptions& options);

/// Opens those of a forest file when they are asked for. Throws Error when there are none.
std::optional<scene::Synapses> open_synapses(const SynapseOptions& options,
                                             const std::filesystem::path& forest_file,
                                             const scene::Forest& forest);

}  // namespace forest::cli
