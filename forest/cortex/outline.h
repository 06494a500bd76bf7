// SPDX-License-Identifier: Apache-2.0
// Elements as a few lines, through which one sees what is planted in them.
#pragma once

#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "forest/core/vec.h"
#include "forest/cortex/borders.h"
#include "forest/cortex/warp.h"

namespace forest::cortex {

/// The edges of some elements, each once, and where their layers end on the sides beyond which nothing else of them lies. Of more than
/// a hundred only what bounds these sides: the rim of them all.
/// @param sheet    with junctions
/// @param borders  of the layers of an element; asked for those at the rim
/// @return lines of nine points each, µm
std::vector<std::vector<Vec3>> outline(const Sheet& sheet, std::span<const std::uint32_t> elements,
                                       const std::function<Borders(std::uint32_t)>& borders);

}  // namespace forest::cortex
