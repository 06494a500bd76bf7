// SPDX-License-Identifier: Apache-2.0
// A surface whose vertices belong to areas, cut so that every triangle belongs to one: where its colours can meet in a line.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "forest/geometry/mesh.h"

namespace forest {

/// The old vertices stay the first ones; behind them are copies, one for each area that meets there, of the middles of edges
/// between two areas and of triangles between three.
struct SplitAreas {
  std::vector<Triangle> triangles;
  /// Of each new vertex the old ones that it lies in the middle of: three, or two and the second again.
  std::vector<std::array<std::uint32_t, 3>> middles;
  std::vector<std::uint16_t> areas;  // of all vertices

  /// What was given for each old vertex, for all: in the middle, the mean.
  template <class Value>
  std::vector<Value> carried(std::span<const Value> old) const {
    std::vector<Value> out(old.begin(), old.end());
    out.reserve(old.size() + middles.size());
    for (const auto& [a, b, c] : middles)
      out.push_back(b == c ? Value((old[a] + old[b]) / 2) : Value((old[a] + old[b] + old[c]) / 3));
    return out;
  }
};

/// @param areas  of each vertex
SplitAreas split_areas(std::span<const Triangle> triangles, std::span<const std::uint16_t> areas);

}  // namespace forest
