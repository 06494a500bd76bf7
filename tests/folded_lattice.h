// SPDX-License-Identifier: Apache-2.0
// Elements of a made-up fold, of which everything is known.
#pragma once

#include <array>
#include <cstdint>

#include "forest/cortex/elements.h"

namespace forest::cortex {

/// `across` × `along` elements, s in [0, across] over the fold and t in [0, along] along it; place(s, t, w) in µm.
template <class PlaceOf>
Elements folded_lattice(int across, int along, PlaceOf&& place) {
  Elements elements;
  const int wide = 3 * across + 1, high = 3 * along + 1;
  std::vector<std::uint32_t> curve(std::size_t(wide * high));  // of every third of an element
  const auto add = [&](bool corners) {
    for (int j = 0; j < high; ++j)
      for (int i = 0; i < wide; ++i) {
        if ((i % 3 == 0 && j % 3 == 0) != corners) continue;
        curve[std::size_t(j * wide + i)] = std::uint32_t(elements.curves.size());
        Depths depths;
        for (std::size_t k = 0; k < 4; ++k) depths[k] = place(i / 3., j / 3., double(k) / 3.);
        elements.curves.push_back(depths);
      }
  };
  add(true);
  elements.corners = std::uint32_t(elements.curves.size());
  elements.on_valley.assign(elements.corners, 0);
  add(false);
  for (int row = 0; row < along; ++row)
    for (int column = 0; column < across; ++column) {
      std::array<std::uint32_t, 16> e{};
      for (int j = 0; j < 4; ++j)
        for (int i = 0; i < 4; ++i)
          e[std::size_t(4 * j + i)] = curve[std::size_t((3 * row + j) * wide + 3 * column + i)];
      elements.elements.push_back(e);
    }
  return elements;
}

}  // namespace forest::cortex
