// SPDX-License-Identifier: Apache-2.0
// From keys to colour: as render/opengl/shaders/resolve.glsl.
#pragma once

#include "forest/render/cpu/canvas.h"

namespace forest::render::cpu {

/// Adds a subframe to the sums of those before it, and after the last one makes the image: palette × shade, a dark rim where
/// something nearer stands beside (after eye-dome lighting, Boucheny 2009), fog, the mean over subframes, sRGB.
/// @param area  the pixels that are wanted; those beside it stay as they are
/// @param sums  four floats a pixel; used when there are several subframes
void resolve(const Canvas& canvas, const frame::Constants& constants, const frame::Palette& palette,
             const frame::Area& area, std::vector<float>& sums, frame::Image& image);

}  // namespace forest::render::cpu
