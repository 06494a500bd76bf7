// SPDX-License-Identifier: Apache-2.0
#include "apps/cli/target_options.h"

#include <CLI/App.hpp>
#include <fmt/format.h>

#include "forest/scene/colouring.h"
#include "forest/scene/forest.h"

#include "apps/cli/console.h"
#include "apps/node_set_files.h"

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
  return forest::read_node_sets(forest, files, [&](const std::string& sentence) { console.warn(sentence); });
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
  if (targets.forest().instances().empty()) return;  // which is told by itself
  for (const scene::Appearance& a : shown)
    if (!a.branch && targets.find(a.name).empty())
      console.warn(fmt::format("no neuron belongs to the target '{}'", a.name));
}

}  // namespace forest::cli
