// SPDX-License-Identifier: Apache-2.0
// The keys of all pixels (frame/layout.h) and how far one sees through them.
#pragma once

#include <algorithm>
#include <atomic>
#include <cstdint>
#include <vector>

#include "forest/frame/frame.h"
#include "forest/render/cpu/arithmetic.h"

namespace forest::render::cpu {

[[gnu::always_inline]] inline float depth_code(float depth) {
  const float code = (log2_of(depth) + float(FOREST_DEPTH_BASE)) * float(FOREST_DEPTH_STEPS);
  return smaller(larger(code, 0.f), float(FOREST_DEPTH_MAX));
}

[[gnu::always_inline]] inline std::uint32_t key_of(float code, std::uint32_t payload) {
  return std::uint32_t(std::int32_t(code)) << 12 | payload;
}

/// Shade 0–1 in five bits, the rounding moved by `noise` so that the mean over subframes is smooth.
[[gnu::always_inline]] inline std::uint32_t payload_of(std::uint32_t entry, float shade, float noise) {
  return entry << 5 | std::uint32_t(std::int32_t(smaller(larger(shade * 31.f + noise, 0.f), 31.f)));
}

class Canvas {
 public:
  /// All pixels empty.
  /// Those beside the area may hold anything, and with those of the hole count as hidden.
  /// @param gaps  share of a tile's pixels that may be farther than what `hidden` goes by
  void clear(std::uint32_t width, std::uint32_t height, const frame::Area& area, const frame::Area& hole = {},
             float gaps = 0.f);

  std::int32_t width() const { return width_; }
  std::int32_t height() const { return height_; }
  /// The keys of one row, from the left.
  void read_row(std::int32_t y, std::uint32_t* keys) const;

  /// The nearest key wins, whichever thread comes first.
  void put(std::int32_t x, std::int32_t y, std::uint32_t key) {
    const std::atomic_ref<std::uint32_t> pixel(keys_[place(x, y)]);
    std::uint32_t seen = pixel.load(std::memory_order_relaxed);
    while (key < seen && !pixel.compare_exchange_weak(seen, key, std::memory_order_relaxed)) {
    }
  }
  /// Whether all of the FOREST_TILE pixels from `x`, a multiple of as many, on have a key before this one.
  bool before(std::int32_t x, std::int32_t y, std::uint32_t key) {
    std::uint32_t farthest = 0;
    for (std::uint32_t *pixel = &keys_[place(x, y)], *end = pixel + FOREST_TILE; pixel != end; ++pixel)
      farthest = std::max(farthest, std::atomic_ref(*pixel).load(std::memory_order_relaxed));
    return farthest < key;
  }

  /// Finds the farthest key of every tile: from now on `hidden` knows what has been drawn.
  void look();
  /// Whether all that lies within a rectangle of pixels, at a depth code or behind it, is hidden or beside the picture. Looks at
  /// few tiles; a rectangle that needs more is not hidden.
  bool hidden(float left, float top, float right, float bottom, float nearest_code) const;
  frame::DepthMap depth_map() const;

 private:
  struct Level {
    std::int32_t width = 0, height = 0;
    std::vector<std::uint32_t> farthest;
  };
  // The pixels of a tile are neighbours in memory, in rows: a line in any direction stays within few cache lines and pages.
  static_assert(FOREST_TILE == 8);
  std::size_t place(std::int32_t x, std::int32_t y) const {
    return std::size_t((y >> 3) * fine_.width + (x >> 3)) * 64 + std::size_t((y & 7) << 3 | (x & 7));
  }

  std::int32_t width_ = 0, height_ = 0;
  frame::Area area_, hole_;
  float gaps_ = 0.f;
  std::vector<std::uint32_t> keys_;  // those of tiles that reach beyond the picture are 0 there
  Level fine_, coarse_;              // tiles, and tiles of tiles
  bool looked_ = false;

  std::uint32_t far_in_tile(std::int32_t tx, std::int32_t ty) const;
};

}  // namespace forest::render::cpu
