// SPDX-License-Identifier: Apache-2.0
// Points in few bytes. A tracer writes decimals: places to a tenth, a hundredth or a thousandth of a micrometre. Then a
// point is its difference from the one before in such steps, and takes five to eight bytes instead of sixteen; of grown neurons
// the steps are those from float to float, and a point takes eleven to fifteen. The floats that come back are the very same.
//
//   packed: decimals (a byte, 0–5; 6: floats), then x, y, z and radius of every point: difference from the point before in
//   steps, zigzag (0, -1, 1, -2, …), seven bits a byte, the lowest first, the eighth bit set on all but the last
//   in decimals 2⁶³ stands for the number -0, from which the next difference is that from 0
//   floats are counted in their order: 0 and above as their bits say, those with a sign from -0, which is -1, downwards
//   the first point of a section that grows out of another is the difference from the last point of that one, which it
//   mostly repeats
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <string_view>

#include "forest/morphology/morphology.h"

namespace forest {

/// The sections whose points follow one another: how many each has, and out of which it grows, -1 for none. Without them
/// each point is the difference from the one before.
struct PointRuns {
  std::span<const std::int32_t> parents, counts;
};

/// Empty when packing would not make it smaller.
std::string pack_points(std::span<const Point> points, const PointRuns& runs = {});

/// Throws Error when the bytes are damaged, or are not those of such sections.
std::vector<Point> unpack_points(std::string_view bytes, const PointRuns& runs = {});

}  // namespace forest
