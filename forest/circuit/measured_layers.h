// SPDX-License-Identifier: Apache-2.0
// Which measured layer a layer of a recipe is: by its name, in Arabic or Roman numerals, with or without an L before it and
// whatever behind it.
//
//     L1, 1, I          the first map          L5A, Vb2     a part of the fifth: parts share it by their thickness in the recipe
//     L2/3, L23, II/III the second and third
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "forest/circuit/recipe.h"

namespace forest::circuit {

/// The first and the last of the layers 1 to 9 that a name says, if it does.
struct LayerNumbers {
  std::size_t first = 0, last = 0;

  bool operator==(const LayerNumbers&) const = default;
};
std::optional<LayerNumbers> layer_numbers(std::string_view name);

/// A sentence where there are as many maps as layers, which are therefore taken in their order, though the layers' names speak of other
/// ones; else nothing.
std::string doubt_of_maps(const Recipe& recipe, std::size_t maps);

/// Of each layer of a recipe the thickness at each vertex, from the maps of measured layers: by the layers' names, or, where these do
/// not say it and there are as many of both, in their order.
/// Throws Error: layers without a number, out of order, of which there is no map, or a map of which there is no layer.
std::vector<std::vector<float>> maps_of_layers(const Recipe& recipe,
                                               const std::vector<std::vector<float>>& maps);

}  // namespace forest::circuit
