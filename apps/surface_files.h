// SPDX-License-Identifier: Apache-2.0
// Surfaces of a cortex and what colours them, from files: what the command line and the studio share.
#pragma once

#include <filesystem>
#include <set>
#include <string>
#include <vector>

#include "forest/scene/surfaces.h"

namespace forest {

/// Whether a file that was named as the forest is a surface of a cortex.
bool is_surface(const std::filesystem::path& file);

/// Throws InputError, as both do, for what cannot be read.
void add_surface(scene::Surfaces& surfaces, const std::filesystem::path& file, float opacity = 1.f);
/// Colours the last one by the values or areas of a file. Returns what the values are, where the file says so: "thickness (mm)".
std::string add_overlay(scene::Surfaces& surfaces, const std::filesystem::path& file);

/// As options of a command line name them.
struct SurfaceFiles {
  std::vector<std::filesystem::path> surfaces, overlays;  // an overlay colours the surface in its place
  std::vector<float> opacities{};  // in their order; the last holds for all that follow, none is 1
};
/// Reads all of them, and returns of what quantities there are values. Overlays that belong to no surface, and what cannot be read,
/// throw Error.
std::set<std::string> add_surfaces(scene::Surfaces& surfaces, const SurfaceFiles& files);

}  // namespace forest
