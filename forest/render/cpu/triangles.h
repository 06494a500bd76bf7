// SPDX-License-Identifier: Apache-2.0
// Surfaces drawn into a canvas: every vertex is brought to the picture once, triangles are sorted into the squares that they
// touch, then every square is drawn by one thread.
#pragma once

#include <span>
#include <vector>

#include "forest/render/cpu/canvas.h"
#include "forest/render/cpu/run.h"

namespace forest::render::cpu {

/// Holds the memory that drawing needs, from picture to picture.
class SurfaceDrawer {
 public:
  /// Draws every triangle of every surface into squares that are cleared; the same in any order and at any number of threads.
  void draw(const Picture& picture, std::span<const frame::Surface> surfaces, Canvas& canvas);

  /// A vertex in camera coordinates (x right, y up, z depth).
  struct Corner {
    Vec3 at, normal;
    float openness, opacity;
    std::uint32_t entry;
  };
  struct Range {  // of squares
    std::int16_t left, top, right, bottom;
  };

 private:
  std::vector<Corner> corners_;
  std::vector<Range> ranges_;  // of triangles
  std::vector<std::uint32_t>
      places_;  // of each chunk of triangles in each square: how many, then where the next one goes
  std::vector<std::uint32_t> starts_, triangles_;
};

}  // namespace forest::render::cpu
