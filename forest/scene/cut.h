// SPDX-License-Identifier: Apache-2.0
// The choice of what is drawn: for every neuron in sight the coarsest clusters that are good enough for the eye.
#pragma once

#include <optional>
#include <span>
#include <vector>

#include "forest/frame/frame.h"
#include "forest/scene/forest.h"
#include "forest/scene/level.h"
#include "forest/scene/occlusion.h"

namespace forest::scene {

/// A cluster and all below it, or a soma, that were left out because an earlier picture hid them.
struct LeftOut {
  std::uint32_t instance = 0, cluster = 0;  // 0xffffffff: the soma
};

struct Cut {
  std::vector<frame::Item> dots, lines, capsules;  // nearest neurons first
  std::vector<frame::Band> bands;
  std::uint64_t segments = 0;  // drawn
  std::uint32_t neurons = 0;   // in sight
  std::vector<LeftOut> left_out;
  // Palette entries of the lists' segments (frame::Entries), where something coloured them (playback.h).
  struct Entries {
    std::vector<std::uint8_t> dots, lines, capsules;
  };
  std::optional<Entries> entries;

  frame::Lists lists() const {
    frame::Lists lists{dots, lines, capsules, bands, {}};
    if (entries) lists.entries = {entries->dots, entries->lines, entries->capsules};
    return lists;
  }
};

/// Pure: depends on its arguments alone, and is the same at any number of threads.
/// @param before  what an earlier picture hid, as a guess: it goes to `left_out`. Null: everything in sight is chosen
Cut choose(const Forest& forest, const Eye& eye, const frame::Viewport& viewport,
           const Occluders* before = nullptr);

/// Of what was left out, that which `now`, of the same view with all else drawn, does not hide. Drawn besides, the
/// picture is the one without any guess.
Cut revealed(const Forest& forest, const Eye& eye, const frame::Viewport& viewport,
             std::span<const LeftOut> left_out, const Occluders& now);

}  // namespace forest::scene
