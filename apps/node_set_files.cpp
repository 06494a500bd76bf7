// SPDX-License-Identifier: Apache-2.0
#include "apps/node_set_files.h"

#include <fmt/format.h>

#include "forest/io/node_sets.h"
#include "forest/scene/forest.h"

namespace forest {

circuit::NodeSets read_node_sets(const scene::Forest& forest, const std::vector<std::filesystem::path>& files,
                                 const std::function<void(const std::string&)>& warn) {
  circuit::NodeSets own = io::node_sets_of(forest.nodes()), all = own;
  for (const auto& file : files) {
    circuit::NodeSets sets = io::read_node_sets(file);
    for (circuit::NodeSet& set : sets.sets) {
      if (all.find(set.name))
        warn(fmt::format("{} replaces the node set '{}' of the {}", file.string(), set.name,
                         own.find(set.name) ? "forest" : "files before it"));
      all.put(std::move(set));
    }
    all.source = files.size() == 1 && own.sets.empty() ? sets.source : "the node sets";
  }
  return all;
}

}  // namespace forest
