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

/// What was left out because an earlier picture hid it: a cluster and all below it, some of the groups that a cluster draws,
/// or a soma.
struct LeftOut {
  std::uint32_t instance = 0, cluster = 0;  // 0xffffffff: the soma
  std::uint32_t groups = 0;                 // bit i: group i of the cluster; 0: all of it, and all below
};

/// A branch that is shown otherwise than its neuron: a section and all that grows out of it.
struct Part {
  std::uint32_t instance = 0, section = 0;  // soma_section: the whole neuron
  frame::State state;
};

/// How neurons are shown. Lists that are not there: all are visible, each drawn with the kind that fits its size.
struct Shown {
  std::span<const frame::State> states;  // one an instance
  std::span<const Part> parts;           // by instance; later ones win. Their neurons are flagged as parted
};

/// The states of the sections of a neuron that has parts; null: that of the neuron.
std::vector<const frame::State*> section_states(const Forest& forest, const Shown& shown,
                                                std::uint32_t instance);

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

/// One of the pictures that clusters are chosen for together: parts of one view, seen by one camera, at sizes of their own (fovea.h).
struct Sight {
  const Eye& eye;
  // What an earlier picture hid, as a guess: it goes to `left_out`. Null: everything in sight is chosen. All of the earlier pictures
  // were seen by one camera too.
  const Occluders* before = nullptr;
};
inline constexpr std::size_t most_sights = 32;

/// Of each sight the same cut as of it alone, in one walk over the forest.
/// Pure: depends on its arguments alone, and is the same at any number of threads.
std::vector<Cut> choose(const Forest& forest, std::span<const Sight> sights, const Shown& shown = {});
Cut choose(const Forest& forest, const Eye& eye, const frame::Viewport& viewport,
           const Occluders* before = nullptr, const Shown& shown = {});

/// Of what was left out, that which `now`, of the same view with all else drawn, does not hide. Drawn besides, the
/// picture is the one without any guess.
Cut revealed(const Forest& forest, const Eye& eye, const frame::Viewport& viewport,
             std::span<const LeftOut> left_out, const Occluders& now, const Shown& shown = {});

}  // namespace forest::scene
