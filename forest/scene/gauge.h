// SPDX-License-Identifier: Apache-2.0
// Branches in the colours of what they measure from place to place: their order, their radius, how far from the soma. As activity
// does, it colours single segments; nothing of it is stored in a forest file.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "forest/scene/colour_map.h"
#include "forest/scene/colouring.h"

namespace forest::scene {

/// A quantity on all branches of a forest, in steps of a map from 0 to `high`.
struct Gauge {
  static constexpr std::uint8_t steps = 40, none = 255;  // none: of a soma

  ColourBy by = ColourBy::order;
  const char *title = "", *unit = "";
  bool whole = false;              // its values are whole numbers
  float high = 1.f;                // of the most, where a few of them are far above all others
  bool above = false;              // whether there are such
  std::vector<std::uint8_t> step;  // of every segment that is no straw: at the middle of what it stands for
};
/// Whether colours mean such a quantity: order, radius or distance.
bool is_gauged(ColourBy by);
/// The order of a section is 0 for a stem and one more after every branch point; the radius is that of the original segment there, however
/// much wider a coarse one is drawn; the distance goes along the branches, from the beginning of their stem.
Gauge gauge_of(const Forest& forest, ColourBy by);

/// Viridis without the end that is lost on the ground.
const ColourMap& gauge_map(Background background);
/// Of somata, neither here nor there in the map.
Vec3 gauge_soma(Background background);

/// Fills Cut::entries as the colouring has it (Colouring::entry).
void paint(const Forest& forest, const Colouring& colouring, Cut& cut);

}  // namespace forest::scene
