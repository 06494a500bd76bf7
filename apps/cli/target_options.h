// SPDX-License-Identifier: Apache-2.0
// Which neurons a picture shows: what render, movie and view have in common (docs/scene/targets.md).
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "forest/circuit/node_sets.h"

namespace CLI {
class App;
}
namespace forest::scene {
struct Appearance;
class Forest;
class Targets;
}  // namespace forest::scene

namespace forest::cli {

class Console;

struct TargetOptions {
  std::vector<std::filesystem::path> node_sets;
  std::vector<std::string> only, hide;
};

/// --node-sets, --only, --hide
void add_targets(CLI::App& command, TargetOptions& options);
/// --node-sets alone.
void add_node_sets(CLI::App& command, std::vector<std::filesystem::path>& files);

/// Those of the forest and of all files in one: of sets with one name the last is taken, and said so.
circuit::NodeSets read_node_sets(const scene::Forest& forest, const std::vector<std::filesystem::path>& files,
                                 Console& console);

/// Adds --only and --hide to the targets of a view.
void add_appearances(const TargetOptions& options, std::vector<scene::Appearance>& shown);

/// Says which of the targets have no neuron: a picture should not be empty without a word.
void warn_of_empty(const scene::Targets& targets, const std::vector<scene::Appearance>& shown,
                   Console& console);

}  // namespace forest::cli
