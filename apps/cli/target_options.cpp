// SPDX-License-Identifier: Apache-2.0
#include "apps/cli/target_options.h"

#include <CLI/App.hpp>
#include <fmt/format.h>

#include "forest/io/node_sets.h"
#include "forest/scene/colouring.h"
#include "forest/scene/forest.h"

#include "apps/cli/console.h"

namespace forest::cli {

void add_node_sets(CLI::App& command, std::vector<std::filesystem::path>& files) {
  command
      .add_option("--node-sets", files,
                  "SONATA node sets, JSON files: names that targets may use besides the forest's own")
      ->type_name("FILE");
}

void add_targets(CLI::App& command, TargetOptions& options) {
  add_node_sets(command, options.node_sets);
  command
      .add_option("--only", options.only, "Show these targets alone, for example \"L5 and not inhibitory\"")
      ->type_name("TARGET");
  command.add_option("--hide", options.hide, "Leave these targets out")->type_name("TARGET");
}

circuit::NodeSets read_node_sets(const scene::Forest& forest, const std::vector<std::filesystem::path>& files,
                                 Console& console) {
  circuit::NodeSets own = io::node_sets_of(forest.nodes()), all = own;
  for (const auto& file : files) {
    circuit::NodeSets sets = io::read_node_sets(file);
    for (circuit::NodeSet& set : sets.sets) {
      if (all.find(set.name))
        console.warn(fmt::format("{} replaces the node set '{}' of the {}", file.string(), set.name,
                                 own.find(set.name) ? "forest" : "files before it"));
      all.put(std::move(set));
    }
    all.source = files.size() == 1 && own.sets.empty() ? sets.source : "the node sets";
  }
  return all;
}

void add_appearances(const TargetOptions& options, std::vector<scene::Appearance>& shown) {
  const auto show = [&](const std::string& name, bool visible) {
    scene::Appearance a;
    a.name = name, a.visible = visible;
    shown.push_back(std::move(a));
  };
  if (!options.only.empty()) show("all", false);
  for (const std::string& name : options.only) show(name, true);
  for (const std::string& name : options.hide) show(name, false);
}

void warn_of_empty(const scene::Targets& targets, const std::vector<scene::Appearance>& shown,
                   Console& console) {
  for (const scene::Appearance& a : shown)
    if (!a.branch && targets.find(a.name).empty())
      console.warn(fmt::format("no neuron belongs to the target '{}'", a.name));
}

}  // namespace forest::cli
