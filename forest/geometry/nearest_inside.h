// SPDX-License-Identifier: Apache-2.0
// Of every point of a grid the nearest that lies inside, and how far it is: an exact Euclidean distance transform that remembers
// where its distances come from, an axis after the other (Felzenszwalb & Huttenlocher 2012).
#pragma once

#include <cstdint>
#include <vector>

#include "forest/geometry/isosurface.h"

namespace forest {

constexpr std::uint32_t no_point = 0xffffffffu;

/// The index of the nearest point whose number is negative, for every point of the grid; `no_point` everywhere where there is
/// none. Of points as near the choice is the same at any number of threads. At most 2³² − 1 points.
std::vector<std::uint32_t> nearest_inside(const ScalarGrid& grid);

}  // namespace forest
