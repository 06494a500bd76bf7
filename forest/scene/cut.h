// SPDX-License-Identifier: Apache-2.0
// The choice of what is drawn: for every neuron in sight the coarsest clusters that are good enough for the eye.
#pragma once

#include <algorithm>
#include <cmath>
#include <optional>
#include <span>
#include <vector>

#include "forest/frame/frame.h"
#include "forest/scene/closeness.h"
#include "forest/scene/forest.h"
#include "forest/scene/level.h"
#include "forest/scene/occlusion.h"

namespace forest::scene {

/// What was left out because an earlier picture hid it, or because it is far: a cluster or a brick and all below it, one of the groups that it
/// draws, a soma, or the neurons of a grove.
struct LeftOut {
  enum What : std::uint32_t { cluster, soma, grove, brick };
  What what = cluster;
  std::uint32_t standing = 0;  // of a cluster or a soma: whose, in Forest::standing()
  std::uint32_t number = 0;    // of the cluster, the grove or the brick
  std::uint32_t groups = 0;    // bit i: group i; 0: all of it, and all below
  Glimpse seen = {};           // by the camera of the cut
};

/// A branch that is shown otherwise than its neuron: a section and all that grows out of it.
struct Part {
  std::uint32_t instance = 0, section = 0;  // soma_section: the whole neuron
  frame::State state;
};

/// How neurons are shown. Lists that are not there: all are visible, each drawn with the kind that fits its size.
struct Shown {
  frame::States states;         // one an instance
  std::span<const Part> parts;  // by instance; later ones win. Their neurons are flagged as parted
};

/// The states of the sections of a neuron that has parts; null: that of the neuron.
std::vector<const frame::State*> section_states(const Forest& forest, const Shown& shown,
                                                std::uint32_t instance);

struct Cut {
  std::vector<frame::Item> dots, lines, capsules;  // nearest neurons first
  std::vector<frame::Band> bands;
  std::uint64_t segments = 0;  // drawn
  std::uint32_t far = 0;       // neurons that straws do for, in a part of the forest that is in sight
  std::vector<LeftOut> left_out;
  // Palette entries of the lists' segments (frame::Entries), where something coloured them (playback.h, gauge.h).
  struct Entries {
    std::vector<std::uint8_t> dots, lines, capsules;
    bool of_activity = false;  // whose colours the palette is to have then
  };
  std::optional<Entries> entries;

  frame::Lists lists() const {
    frame::Lists lists{dots, lines, capsules, bands, {}};
    if (entries) lists.entries = {entries->dots, entries->lines, entries->capsules};
    return lists;
  }
};

/// Of how many neurons something is drawn, cut after cut of one picture.
class NeuronsInSight {
 public:
  void clear(std::size_t neurons) { marked_.assign(neurons, false), count_ = 0; }
  void add(const Cut& cut);
  std::uint32_t count() const {
    return std::min(count_, std::uint32_t(marked_.size()));
  }  // far ones overlap near ones

 private:
  std::vector<bool> marked_;
  std::uint32_t count_ = 0;
};

/// µm from the middle of a forest to its end along a unit direction, with room: of somata even all through it nearly twice as
/// far as they lie, so that a column is as deep as it is wide and only a slab is less.
float reach_along(const Forest& forest, const Vec3& direction);
/// The depth cue of a picture.
/// @param strength  as Detail::fog
Fog fog_of(const Forest& forest, const frame::Camera& camera, float strength);

/// One of the pictures that are chosen for together: parts of one view, seen by one camera, at sizes of their own (fovea.h).
struct Sight {
  const Eye& eye;
  // What a picture shows; what it hides is left out. Null: nothing is hidden. All were seen by one camera, which may be an earlier one.
  const Occluders* before = nullptr;
  float horizon = INFINITY;  // µm along the view: what begins beyond is left out
};

/// Which neurons are looked at (Detail::turns): those of which something was seen in the picture before, and of the others every
/// so-many-th.
struct Turn {
  std::span<const std::uint8_t> seen = {};  // one an instance; empty: nothing is known, and all are looked at
  std::uint32_t turn = 0, of = 1;           // turn < of

  /// @param standing  its number in Forest::standing()
  bool has(std::uint32_t standing, std::uint32_t instance) const {
    return seen.empty() || seen[instance] || standing % of == turn;
  }
};

/// What is drawn for each sight, the same as for it alone, in one walk over the forest.
/// Pure: depends on its arguments alone, and is the same at any number of threads.
/// @param sights  what they leave out goes to `left_out`: earlier pictures are a guess
/// @param closeness  that of this camera; null: it is worked out
/// @param turn       neurons that do not have it are as if they were not there
std::vector<Cut> choose(const Forest& forest, std::span<const Sight> sights, const Shown& shown = {},
                        Closeness* closeness = nullptr, const Turn& turn = {});
Cut choose(const Forest& forest, const Eye& eye, const Shown& shown = {});

/// Of what was left out, that which `now`, a picture of the same view with all else drawn, does not hide; what lies beyond its
/// horizon is left out again. Drawn besides until nothing is left out, it gives the picture without any guess.
Cut revealed(const Forest& forest, const Sight& now, std::span<const LeftOut> left_out,
             const Shown& shown = {}, Closeness* closeness = nullptr);

}  // namespace forest::scene
