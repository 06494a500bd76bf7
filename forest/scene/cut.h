// SPDX-License-Identifier: Apache-2.0
// The choice of what is drawn: for every neuron in sight the coarsest clusters that are good enough for the eye.
#pragma once

#include <vector>

#include "forest/frame/frame.h"
#include "forest/scene/forest.h"
#include "forest/scene/level.h"

namespace forest::scene {

struct Cut {
  std::vector<frame::Item> dots, lines, capsules;  // nearest neurons first
  std::vector<frame::Band> bands;
  std::uint64_t segments = 0;  // drawn
  std::uint32_t neurons = 0;   // in sight
};

/// Pure: depends on its arguments alone, and is the same at any number of threads.
Cut choose(const Forest& forest, const Eye& eye, const frame::Viewport& viewport);

}  // namespace forest::scene
