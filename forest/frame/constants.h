// SPDX-License-Identifier: Apache-2.0
// The constants of a picture as every renderer takes them, derived from its frame in one place.
#pragma once

#include <cmath>

#include "forest/frame/frame.h"

namespace forest::frame {

/// Of one subframe, which looks at sample_place.
Constants constants_of(const Frame& frame, std::uint32_t subframe);

/// Depth at which the ray through a place of the picture (pixels) meets the glass; infinite when it does not.
inline float glass_depth(const Constants& c, float px, float py) {
  const float x = (px - c.centre_x) / c.focal, y = (c.centre_y - py) / c.focal;
  const float beside = c.glass_x * x + c.glass_y * y;
  const float z = (c.glass_at - c.parallel * beside) / (c.converge * beside + c.glass_z);
  if (!(z > c.near)) return INFINITY;
  const float wide = c.converge * z + c.parallel;
  const float right = wide * (c.glass_right_x * x + c.glass_right_y * y) + c.glass_right_z * z,
              up = wide * (c.glass_up_x * x + c.glass_up_y * y) + c.glass_up_z * z;
  return right >= c.glass_left_edge && right <= c.glass_right_edge && up >= c.glass_low_edge &&
                 up <= c.glass_high_edge
             ? z
             : INFINITY;
}

/// How an overlay is drawn: a segment in the world whose meta word names its palette entry.
Segment segment_of(const Overlay& overlay);
/// The same of a ball: its opacity stands in bits 8–15.
Segment segment_of(const Ball& ball);
/// Of ball number `number` of a frame: the key of its screen door, and its rank among those of less than a pixel, in [0, 1).
inline std::uint32_t ball_key(std::uint32_t number) { return forest_mixed(number ^ 0x6a09e667u); }
inline float ball_rank(std::uint32_t number) { return float(forest_mixed(number) >> 8) * 0x1p-24f; }

/// Depth codes of a key (layout.h).
float depth_of_code(std::uint32_t code);

}  // namespace forest::frame
