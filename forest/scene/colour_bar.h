// SPDX-License-Identifier: Apache-2.0
// What colours mean, in the picture itself: the colour map from its lowest to its highest value, with their unit; or one colour.
#pragma once

#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "forest/scene/arrangement.h"
#include "forest/scene/colour_map.h"
#include "forest/scene/colouring.h"

namespace forest::scene {

class Playback;
class Surfaces;

struct ColourBar {
  const ColourMap* map = &colour_maps().front();  // null: no bar
  std::vector<Vec3> marks{};                      // sRGB 0–1, of dots before the note
  float low = 0.f, high = 1.f;                    // values at its ends
  bool below = false, above = false;              // whether values lie beyond these, too
  bool whole = false;                             // only whole numbers are values
  std::string units{};                            // of them; may be empty
  std::optional<float> threshold{};               // what is less is grey
  std::string title{}, note{};                    // above and below; may be empty
  std::optional<Background> branches{};           // its colours are those of branches there (on_branches)

  Vec3 at(float t) const;  // the colour at a share 0–1 of its length, sRGB 0–1
  /// What stands at its ends, with as many digits as tell them apart, four or more.
  std::pair<std::string, std::string> ends() const;
  struct Tick {
    float at;  // share 0–1 of its length
    std::string label;
  };
  /// What is told between its ends where there is room: the threshold alone, or else round values.
  std::vector<Tick> between() const;
};

/// Of a simulation at a moment (ms).
ColourBar bar_of(const ActivityView& activity, double time, const std::string& units, Background background);
/// Of spikes without values: what a flash is, and how fast it runs.
ColourBar bar_of_spikes(const ActivityView& activity, double time, Background background);

/// Whichever of them explains what is played.
ColourBar bar_of(const Playback& playback, const ActivityView& activity, Background background);

/// Of the gauge that a colouring has; none where it has none.
std::optional<ColourBar> bar_of(const Colouring& colouring, Background background);

/// Of values on surfaces; none where they have none.
std::optional<ColourBar> bar_of(const Surfaces& surfaces);

/// One below the other, usually at the top left; none where a picture is too small to read them in (about 280 × 130 pixels for one bar).
std::optional<Block> block_of(std::span<const ColourBar> bars, const frame::Viewport& picture,
                              Background background);

/// The names of colours, one below the other, usually at the top left too. Names that are too long are shortened, those for which there
/// is no room counted; none in a picture in which not even three have room.
std::optional<Block> block_of(std::span<const LegendEntry> names, const frame::Viewport& picture,
                              Background background);

/// The bar alone, without ground: its colours between `place`'s edges and its values below, which need twice the letters' height.
void paint(frame::Image& image, const ColourBar& bar, const Box& place, const Lettering& letters);

}  // namespace forest::scene
