// SPDX-License-Identifier: Apache-2.0
// Elements for tests: a slab of side × side blocks of 500×500×2000 µm below z = 0, bent by a map.
#pragma once

#include <map>

#include "forest/cortex/elements.h"

namespace forest::cortex {

inline std::uint32_t slab_corner(int side, int i, int j) { return std::uint32_t(i + (side + 1) * j); }

template <class Map>
Elements make_slab(int side, Map&& map) {
  constexpr double block = 500., tall = 2000.;
  Elements result;
  const auto drop = [&](double x, double y) {
    Depths curve;
    for (std::size_t d = 0; d < 4; ++d) curve[d] = map(Place(x * block, y * block, -tall * double(d) / 3.));
    result.curves.push_back(curve);
    return std::uint32_t(result.curves.size() - 1);
  };
  std::map<std::pair<int, int>, std::uint32_t> of;  // in thirds
  for (int j = 0; j <= side; ++j)
    for (int i = 0; i <= side; ++i) of[{3 * i, 3 * j}] = drop(i, j);
  result.corners = std::uint32_t(result.curves.size());
  result.on_valley.assign(result.corners, 0);
  // u against x: seen from outside u turns to v clockwise.
  for (int j = 0; j < side; ++j)
    for (int i = side; i-- > 0;) {
      std::array<std::uint32_t, 16> e{};
      for (int v = 0; v < 4; ++v)
        for (int u = 0; u < 4; ++u) {
          const std::pair at{3 * i + 3 - u, 3 * j + v};
          if (!of.contains(at)) of[at] = drop(at.first / 3., at.second / 3.);
          e[std::size_t(u + 4 * v)] = of[at];
        }
      result.elements.push_back(e);
    }
  return result;
}

/// A large square at a height, facing up.
inline Mesh plane(double z) {
  Mesh mesh;
  for (const auto& [x, y] : {std::pair{-1e4, -1e4}, {1e4, -1e4}, {1e4, 1e4}, {-1e4, 1e4}})
    mesh.positions.emplace_back(float(x), float(y), float(z));
  mesh.triangles = {{0, 1, 2}, {0, 2, 3}};
  return mesh;
}

}  // namespace forest::cortex
