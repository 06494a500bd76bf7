// SPDX-License-Identifier: Apache-2.0
// Runs of segments drawn into a canvas: the same lines, tubes, capsules and dots as the shaders of render/opengl draw.
#pragma once

#include <span>

#include "forest/render/cpu/canvas.h"

namespace forest::render::cpu {

/// One picture's constants in the form that drawing needs.
struct Picture {
  frame::Geometry geometry;
  std::span<const frame::State> states;
  frame::Opacities opacities;
  bool transparent = false;  // something may be
  frame::Constants constants;
  Mat3 to_camera;  // rows: right, up, forward
  Vec3 eye, light;

  frame::State state_of(const frame::Item& item) const {
    return item.state ? frame::unpacked(item.state) : states[item.instance];
  }
};

enum class Kind { dots, lines, capsules };

/// Draws every item of the list; the picture is the same in any order and at any number of threads. Returns how many segments
/// were neither hidden nor beside the picture.
/// @param entries  of the list (frame::Entries); may be empty
std::uint64_t splat(const Picture& picture, std::span<const frame::Item> items,
                    std::span<const std::uint8_t> entries, Kind kind, Canvas& canvas);
/// Overlays: at least two pixels wide, in the world.
void splat(const Picture& picture, std::span<const frame::Overlay> overlays, Canvas& canvas);

}  // namespace forest::render::cpu
