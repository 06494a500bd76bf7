// SPDX-License-Identifier: Apache-2.0
// Which branches of a neuron come first where it is so far that few are drawn for all: by lot, but none before the one that it leaves.
// Neurons of one shape have different orders, or a forest of a few shapes would show the same branches of each.
#pragma once

#include <cstddef>
#include <cstdint>

#include "forest/frame/layout.h"

namespace forest::scene {

inline constexpr std::size_t order_count = 4;

inline std::size_t order_of(std::uint32_t instance) { return frame::forest_mixed(instance) % order_count; }

}  // namespace forest::scene
