// SPDX-License-Identifier: Apache-2.0
#include "apps/surface_files.h"

#include <cmath>
#include <string>
#include <vector>

#include "forest/core/error.h"
#include "forest/core/file.h"
#include "forest/io/surface.h"
#include "forest/scene/colouring.h"

namespace forest {

bool is_surface(const std::filesystem::path& file) {
  std::error_code none;
  return !std::filesystem::is_directory(file, none) && io::may_be_surface(MappedFile(file).text());
}

void add_surface(scene::Surfaces& surfaces, const std::filesystem::path& file, float opacity) {
  surfaces.add(io::read_surface(MappedFile(file).text(), file.string()), opacity);
}

void add_overlay(scene::Surfaces& surfaces, const std::filesystem::path& file) {
  const std::string name = file.string();
  const io::SurfaceValues read = io::read_surface_values(MappedFile(file).text(), name);
  try {
    if (read.labels.empty()) return surfaces.colour(read.values);
    std::vector<scene::AreaColour> areas;
    for (const io::SurfaceLabel& label : read.labels) {
      if (label.alpha == 0.f) continue;
      const auto byte = [&](int k) { return std::uint32_t(std::lround(255.f * label.colour[k])); };
      areas.push_back({label.key, scene::light_of(byte(0) << 16 | byte(1) << 8 | byte(2))});
    }
    surfaces.colour(read.values, areas);
  } catch (const InputError&) {
    throw;
  } catch (const Error& error) {
    throw InputError(name, 0, error.what());
  }
}

}  // namespace forest
