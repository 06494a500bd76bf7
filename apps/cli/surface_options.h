// SPDX-License-Identifier: Apache-2.0
// Surfaces of a cortex in a picture, as render and movie take them (docs/scene/surfaces.md).
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "forest/scene/surfaces.h"

namespace CLI {
class App;
}

namespace forest::cli {

class Console;

struct SurfaceOptions {
  std::vector<std::filesystem::path> files, overlays;
  std::vector<float> opacities;
  std::string map, range;
};

/// --surface, --surface-opacity, --overlay, --colour-map, --range
void add_surfaces(CLI::App& command, SurfaceOptions& options);

/// Reads all of them. Values that belong to no surface, and what cannot be read, throw Error.
scene::Surfaces read_surfaces(const SurfaceOptions& options, Console& console);

}  // namespace forest::cli
