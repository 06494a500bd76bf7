// SPDX-License-Identifier: Apache-2.0
// The six layers of human cortex as shares, from the pia inwards.
#pragma once

#include <array>
#include <cstddef>

namespace forest::cortex {

/// Means over a whole hemisphere: BigBrain, Wagstyl et al. 2020, "BigBrain 3D atlas of cortical layers".
inline constexpr std::array human_layers{.118, .101, .271, .088, .190, .232};

/// The depth at which a layer begins (0 is L1); that of 6 is 1.
constexpr double layer_top(std::size_t layer) {
  double sum = 0.;
  for (std::size_t k = 0; k < layer; ++k) sum += human_layers[k];
  return layer == human_layers.size() ? 1. : sum;
}

}  // namespace forest::cortex
