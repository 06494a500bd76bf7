// SPDX-License-Identifier: Apache-2.0
// Colour maps of values: a few colours each, as their authors published them, and straight lines in sRGB between. All but
// the diverging one rise evenly in lightness, so that more is always lighter, also in print and for colour-blind eyes.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string_view>

#include "forest/core/vec.h"

namespace forest::scene {

struct ColourMap {
  const char* name;
  const char* source;                     // who made it, and where it was published
  std::span<const std::uint32_t> points;  // 0xRRGGBB, evenly spaced
  bool diverging = false;                 // lightest in the middle

  /// The colour at `t`, 0 to 1 (values beyond are its ends), sRGB 0–1.
  Vec3 screen(float t) const;
  /// The same in linear light.
  Vec3 operator()(float t) const;
};

/// The first is what is taken when nobody chooses.
std::span<const ColourMap> colour_maps();
const ColourMap* find_colour_map(std::string_view name);  // null when there is none

/// Lightness of a colour in linear light, 0 to 100 (CIE 1976 L*).
float lightness(const Vec3& linear);

}  // namespace forest::scene
