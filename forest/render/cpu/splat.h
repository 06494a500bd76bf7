// SPDX-License-Identifier: Apache-2.0
// Runs of segments drawn into a canvas: the same lines, tubes, capsules and dots as the shaders of render/opengl draw.
#pragma once

#include <span>

#include "forest/render/cpu/canvas.h"

namespace forest::render::cpu {

/// One picture's constants in the form that drawing needs.
struct Picture {
  frame::Geometry geometry;
  std::span<const std::uint8_t> colour_class;
  frame::Constants constants;
  Mat3 to_camera;  // rows: right, up, forward
  Vec3 eye, light;
};

enum class Kind { dots, lines, capsules };

/// Draws every item of the list; the picture is the same in any order and at any number of threads.
/// @param entries  of the list (frame::Entries); may be empty
void splat(const Picture& picture, std::span<const frame::Item> items, std::span<const std::uint8_t> entries,
           Kind kind, Canvas& canvas);
/// Overlays: at least two pixels wide, in the world.
void splat(const Picture& picture, std::span<const frame::Overlay> overlays, Canvas& canvas);

}  // namespace forest::render::cpu
