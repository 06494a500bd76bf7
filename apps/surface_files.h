// SPDX-License-Identifier: Apache-2.0
// Surfaces of a cortex and what colours them, from files: what the command line and the studio share.
#pragma once

#include <filesystem>

#include "forest/scene/surfaces.h"

namespace forest {

/// Whether a file that was named as the forest is a surface of a cortex.
bool is_surface(const std::filesystem::path& file);

/// Throws InputError, as both do, for what cannot be read.
void add_surface(scene::Surfaces& surfaces, const std::filesystem::path& file, float opacity = 1.f);
/// Colours the last one by the values or areas of a file.
void add_overlay(scene::Surfaces& surfaces, const std::filesystem::path& file);

}  // namespace forest
