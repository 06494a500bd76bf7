// SPDX-License-Identifier: Apache-2.0
// Points in few bytes. A tracer writes decimals: places to a tenth, a hundredth or a thousandth of a micrometre. Then a
// point is its difference from the one before in such steps, and takes five to eight bytes instead of sixteen; the
// floats that come back are the very same. Neurons of other numbers are kept as they are.
//
//   packed: decimals (a byte, 0–5), then x, y, z and radius of every point: difference from the point before in steps,
//   zigzag (0, -1, 1, -2, …), seven bits a byte, the lowest first, the eighth bit set on all but the last;
//   2⁶³ stands for the number -0, from which the next difference is that from 0
#pragma once

#include <span>
#include <string>

#include "forest/morphology/morphology.h"

namespace forest::repository {

/// Empty when some number is no decimal of at most five places, or packing would not make it smaller.
std::string packed(std::span<const Point> points);

/// Throws Error when the bytes are damaged.
std::vector<Point> unpacked(const std::string& bytes);

}  // namespace forest::repository
