// SPDX-License-Identifier: Apache-2.0
// Surfaces drawn into a canvas.
#pragma once

#include <span>
#include <vector>

#include "forest/render/cpu/canvas.h"
#include "forest/render/cpu/splat.h"

namespace forest::render::cpu {

/// Draws every triangle of every surface; the picture is the same in any order and at any number of threads.
void splat(const Picture& picture, std::span<const frame::Surface> surfaces, Canvas& canvas);

}  // namespace forest::render::cpu
