// SPDX-License-Identifier: Apache-2.0
// Planting in the elements of a cortex, as `plant --elements` does: which elements, neurons bent as they are, what it did to them.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "forest/circuit/bend.h"
#include "forest/circuit/recipe.h"

#include "apps/cli/planting.h"

namespace CLI {
class App;
class Option;
}  // namespace CLI

namespace forest::cli {

struct ElementOptions {
  std::filesystem::path file;
  std::string elements;                     // "7,12,20-29" or "all"
  std::vector<double> near, sphere, box;    // µm
  std::vector<std::string> areas;           // names of the areas of `labels`
  std::filesystem::path labels, labels_on;  // and the surface on whose vertices they are
  std::uint32_t count = 1, row = 1;
  double scale = 1.,
         density = 0.;         // density: neurons/mm³ in the mean, instead of scale; 0: as the recipe says
  std::string bend = "rigid";  // or "grid"
  std::vector<std::filesystem::path> layers;  // maps of measured thickness; none: layers by volume
  std::filesystem::path layers_on;            // the surface on whose vertices they are
};

/// --elements and those that need it.
/// @return the first, for options that it excludes
CLI::Option* add_elements(CLI::App& command, ElementOptions& options);

struct PlantedElements {
  Planted planted;
  std::vector<std::uint32_t> elements;
  std::vector<std::size_t> first;     // instance of each element, and how many there are in all
  double volume = 0.;                 // µm³ of all elements
  std::vector<double> layer_volumes;  // of it
  double seconds = 0.;                // for places and orientations
  std::optional<circuit::Bending> bending;
  std::vector<std::string>
      left_out;  // sentences on neurons that were not planted in a layer, and layers that were not measured
  bool measured = false;  // layers end where they were measured
};

/// Elements of a file that has so many: "7,12,20-29", or "all". Throws Error for what is no such list, and for numbers it has not.
std::vector<std::uint32_t> parse_elements(const std::string& text, const std::filesystem::path& file,
                                          std::size_t count);

/// Throws Error for elements that are not there, for a region without any, and for what the planter refuses.
PlantedElements plant_in_elements(const ElementOptions& options, const circuit::Recipe& recipe,
                                  const std::string& repo, std::uint64_t seed, Progress& progress);

}  // namespace forest::cli
