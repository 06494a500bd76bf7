// SPDX-License-Identifier: Apache-2.0
// From keys to colour: as render/opengl/shaders/resolve.glsl.
#pragma once

#include "forest/render/cpu/canvas.h"
#include "forest/render/cpu/run.h"

namespace forest::render::cpu {

/// Sums over samples in fixed point, of each row its red, its green, its blue and its coverage: the same whatever samples
/// come together.
using Sums = std::vector<std::int32_t>;

/// Adds the samples of the canvas to the sums of those before them, and after the last ones makes the image: palette × shade,
/// a dark rim where something nearer stands beside (after eye-dome lighting, Boucheny 2009), fog, the mean over samples, sRGB.
/// @param last  whether the image is wanted now
/// @param area  the pixels that are wanted; those beside it stay as they are
/// @param so_far  samples in the sums, with those of the canvas
/// @param sums  used when a picture is not drawn at once
void resolve(const Canvas& canvas, const Picture& picture, const frame::Palette& palette,
             const frame::Area& area, std::uint32_t so_far, bool last, Sums& sums, frame::Image& image);

}  // namespace forest::render::cpu
