// SPDX-License-Identifier: Apache-2.0
#include "apps/surface_files.h"

#include <algorithm>
#include <cmath>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>

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

std::string add_overlay(scene::Surfaces& surfaces, const std::filesystem::path& file) {
  const std::string name = file.string();
  const io::SurfaceValues read = io::read_surface_values(MappedFile(file).text(), name);
  try {
    if (std::ranges::none_of(read.values, [](float v) { return std::isfinite(v); }))
      throw InputError(name, 0, "has no value that is a number; give another overlay");
    if (read.labels.empty()) {
      const std::string title = read.title.empty() ? file.filename().string() : read.title;
      if (surfaces.title != title)  // of both hemispheres, often
        surfaces.title += (surfaces.title.empty() ? "" : ", ") + title;
      surfaces.colour(read.values);
      return read.title;
    }
    std::vector<scene::AreaColour> areas;
    for (const io::SurfaceLabel& label : read.labels) {
      if (label.alpha == 0.f) continue;
      const auto byte = [&](int k) { return std::uint32_t(std::lround(255.f * label.colour[k])); };
      areas.push_back({label.key, scene::light_of(byte(0) << 16 | byte(1) << 8 | byte(2)), label.name});
    }
    surfaces.colour(read.values, areas);
    return {};
  } catch (const InputError&) {
    throw;
  } catch (const Error& error) {
    throw InputError(name, 0, error.what());
  }
}

std::set<std::string> add_surfaces(scene::Surfaces& surfaces, const SurfaceFiles& files) {
  if (files.overlays.size() > files.surfaces.size())
    throw Error(fmt::format(
        "more overlays ({}) than surfaces ({}) are given; an overlay colours the surface in its place",
        files.overlays.size(), files.surfaces.size()));
  std::set<std::string> quantities;
  for (std::size_t i = 0; i < files.surfaces.size(); ++i) {
    const auto& opacities = files.opacities;
    add_surface(surfaces, files.surfaces[i],
                opacities.empty() ? 1.f : opacities[std::min(i, opacities.size() - 1)]);
    if (i >= files.overlays.size()) continue;
    if (std::string quantity = add_overlay(surfaces, files.overlays[i]); !quantity.empty())
      quantities.insert(std::move(quantity));
  }
  return quantities;
}

}  // namespace forest
