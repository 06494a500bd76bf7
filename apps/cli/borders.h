// SPDX-License-Identifier: Apache-2.0
// How near drawn sulci lie to the lines of a cortex, and figures of both: what cortex report and cortex lines have in common.
#pragma once

#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include <nlohmann/json_fwd.hpp>

#include "forest/cortex/lines.h"
#include "forest/geometry/mesh.h"

#include "apps/cli/figures.h"

namespace forest::cli {

struct BorderShare {
  std::string name;
  std::size_t points = 0, within = 0, half_way = 0;

  double share() const { return double(within) / double(points); }
  double share_half_way() const { return double(half_way) / double(points); }
};
struct Borders {
  std::vector<BorderShare> each;  // the last one: all of them
  double by_chance = 0.;          // what points anywhere on the outer surface would have within 2 mm
};

/// How much of the borders lies within 2 mm of the floor of a sulcus, where they are put on the outer surface, and of a valley
/// half way between the two surfaces, on whose vertices they are drawn. Throws InputError.
Borders measure_borders(const std::vector<std::filesystem::path>& files, const Mesh& outer, const Mesh& inner,
                        std::span<const cortex::Line> lines);

std::vector<Figure> figures_of(const Borders& borders);
/// Of crests, valleys and floors of sulci together, mm.
Figure lengths_of(std::span<const cortex::Line> lines);

}  // namespace forest::cli
