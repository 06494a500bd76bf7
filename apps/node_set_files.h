// SPDX-License-Identifier: Apache-2.0
// The node sets that targets may use: those of a forest and of files. What the command line and the studio share.
#pragma once

#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "forest/circuit/node_sets.h"

namespace forest {

namespace scene {
class Forest;
}

/// Those of the forest and of all files in one. Of sets with one name the last is taken, and `warn` is told so in a sentence.
/// Throws InputError for a file that cannot be read.
circuit::NodeSets read_node_sets(const scene::Forest& forest, const std::vector<std::filesystem::path>& files,
                                 const std::function<void(const std::string&)>& warn);

}  // namespace forest
