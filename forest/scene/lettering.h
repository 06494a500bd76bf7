// SPDX-License-Identifier: Apache-2.0
// Words in pictures that no window shows, without a font: letters are a few straight strokes each, drawn to a fraction of a
// pixel at any size.
#pragma once

#include <string>
#include <string_view>

#include "forest/frame/frame.h"

namespace forest::scene {

/// Where the strokes of a text are: capitals are `height` pixels high, x to the right, y down.
struct Lettering {
  float height = 12.f;
  Vec3 colour = Vec3::Ones();  // sRGB 0–1, as on the screen

  /// Pixels to the right, of UTF-8. Latin, Greek and their marks; other signs are boxes, and as wide as one.
  float width(std::string_view text) const;
  /// With "…" for its middle, where it has no room: names often differ in their ends.
  std::string shortened(std::string text, float room) const;
  /// @param left, base  where the line begins on which capitals stand. What lies beyond the picture is left out.
  void write(frame::Image& image, std::string_view text, float left, float base) const;
};

/// Pixels [left, right) × [top, bottom), edges by the share of each pixel that they cover; parts beyond the picture are none.
struct Box {
  float left = 0.f, top = 0.f, right = 0.f, bottom = 0.f;
};
/// Over what a pixel shows, as far as that is opaque.
/// @param colour  sRGB 0–1
void fill(frame::Image& image, const Box& box, const Vec3& colour, float opacity = 1.f);

}  // namespace forest::scene
