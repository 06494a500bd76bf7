// SPDX-License-Identifier: Apache-2.0
// What is looked at: a forest file, or traced neurons as they are. What the command line and the studio share.
#pragma once

#include <filesystem>

#include "forest/scene/forest.h"

namespace forest {

/// Whether a file holds neurons, as its name says: SWC, Neurolucida, NeuroML and the others of io/format.h.
bool holds_cells(const std::filesystem::path& file);

/// A forest file, or the neurons of a file side by side, as they were traced, y upwards. Throws InputError.
scene::Forest open_forest(const std::filesystem::path& file);

}  // namespace forest
