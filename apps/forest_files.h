// SPDX-License-Identifier: Apache-2.0
// What is looked at: a forest file, or traced neurons as they are. What the command line and the studio share.
#pragma once

#include <filesystem>
#include <span>

#include "forest/scene/forest.h"

namespace forest {

/// Whether a file holds neurons, as its name says: SWC, Neurolucida, NeuroML and the others of io/format.h.
bool holds_cells(const std::filesystem::path& file);

/// Whether these are neurons and no forest file: several files, a folder, or one that holds_cells.
bool are_cells(std::span<const std::filesystem::path> files);

/// A forest file, or the neurons of files and folders side by side as they were traced (scene/gallery.h), a hundred at most.
/// @param files   at least one
/// @param aspect  of the picture that they are hung for
/// Throws InputError.
scene::Forest open_forest(std::span<const std::filesystem::path> files, float aspect = 16.f / 9.f);
scene::Forest open_forest(const std::filesystem::path& file);

}  // namespace forest
