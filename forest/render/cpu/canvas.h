// SPDX-License-Identifier: Apache-2.0
// The keys of all samples of all pixels (frame/layout.h) and how far one sees through them.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <span>
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

/// Shade 0–1 in five bits, the rounding moved by `noise` so that the mean over samples is smooth.
[[gnu::always_inline]] inline std::uint32_t payload_of(std::uint32_t entry, float shade, float noise) {
  return entry << 5 | std::uint32_t(std::int32_t(smaller(larger(shade * 31.f + noise, 0.f), 31.f)));
}

inline constexpr int most_samples = 16;
inline constexpr int tile_bits = 3;
static_assert(1u << tile_bits == FOREST_TILE);

/// Pixels of one square of the picture: all that a thread draws into is its own.
struct Square {
  std::int32_t left = 0, top = 0, right = 0, bottom = 0;
};

/// Tiles that something touches, the last ones included.
struct Tiles {
  std::int32_t left = 0, top = 0, right = 0, bottom = 0;
};

class Canvas {
 public:
  static constexpr std::int32_t most_across = 128;  // pixels of a square
  /// Sets the size; what the squares hold is undefined until each is cleared.
  /// Pixels beside the area may hold anything, and with those of unwanted tiles count as hidden.
  /// @param samples  of a pixel
  /// @param wanted   bit k: sample k is drawn; the others count as hidden
  /// @param unwanted  1 for each tile of which nothing is wanted, in rows; stays valid as long as it is drawn; none: all are
  /// @param gaps     share of a tile's samples that may be farther than what `hidden` goes by
  void resize(std::uint32_t width, std::uint32_t height, int samples, std::uint32_t wanted,
              const frame::Area& area, std::span<const std::uint8_t> unwanted = {}, float gaps = 0.f);

  std::int32_t width() const { return width_; }
  std::int32_t height() const { return height_; }
  int samples() const { return samples_; }
  std::uint32_t wanted() const { return wanted_; }

  /// The squares that cover the area, in rows: whole tiles, but for the picture's edges.
  std::int32_t squares_wide() const { return squares_wide_; }
  std::size_t squares() const { return std::size_t(squares_wide_) * std::size_t(squares_high_); }
  Square square(std::size_t number) const;
  /// Which squares a rectangle of pixels touches: columns and rows, the last ones included; nothing when left > right.
  Square touched(float left, float top, float right, float bottom) const;

  /// All samples empty.
  void clear(const Square& square);
  /// Finds the farthest key of the square's tiles: from now on `hidden` knows what has been drawn.
  void look(const Square& square);
  /// Whether all that lies within a rectangle of pixels, at a depth code or behind it, is hidden or beside the square. Looks at
  /// few tiles; a rectangle that has more is looked at in groups of them.
  bool hidden(const Square& square, float left, float top, float right, float bottom,
              float nearest_code) const;

  /// The same of tiles of the picture, and a key of that depth.
  [[gnu::always_inline]] bool hidden(Tiles t, std::uint32_t nearest) const {
    const Level* level = &fine_;
    if ((t.right - t.left + 1) * (t.bottom - t.top + 1) > most_tiles) {
      level = &coarse_;
      t = {t.left >> tile_bits, t.top >> tile_bits, t.right >> tile_bits, t.bottom >> tile_bits};
    }
    const std::uint32_t* row = &level->farthest[std::size_t(t.top * level->width)];
    for (std::int32_t y = t.top; y <= t.bottom; ++y, row += level->width)
      for (std::int32_t x = t.left; x <= t.right; ++x)
        if (row[x] >= nearest) return false;
    return true;
  }
  /// Which squares they lie in; nothing when left > right or top > bottom.
  Square touched(const Tiles& t) const {
    return {std::max((t.left >> tiles_shift_) - squares_left_, 0),
            std::max((t.top >> tiles_shift_) - squares_top_, 0),
            std::min((t.right >> tiles_shift_) - squares_left_, squares_wide_ - 1),
            std::min((t.bottom >> tiles_shift_) - squares_top_, squares_high_ - 1)};
  }

  /// The samples of a pixel; those of the pixels to the right follow, up to the next multiple of FOREST_TILE.
  std::uint32_t* at(std::int32_t x, std::int32_t y) {
    return keys() + columns_[std::size_t(x)] + rows_[std::size_t(y)];
  }
  const std::uint32_t* at(std::int32_t x, std::int32_t y) const {
    return keys() + columns_[std::size_t(x)] + rows_[std::size_t(y)];
  }
  /// The same: keys()[columns()[x] + rows()[y]] is the first sample of a pixel.
  std::uint32_t* keys() { return reinterpret_cast<std::uint32_t*>(lines_.data()); }
  const std::uint32_t* keys() const { return reinterpret_cast<const std::uint32_t*>(lines_.data()); }
  std::span<const std::uint32_t> columns() const { return columns_; }
  std::span<const std::uint32_t> rows() const { return rows_; }
  /// The keys of pixels of one row, sample by sample.
  void read_row(std::int32_t y, std::int32_t from, std::int32_t to, std::uint32_t* keys) const;
  frame::DepthMap depth_map() const;

 private:
  struct Level {
    std::int32_t width = 0, height = 0;
    std::vector<std::uint32_t> farthest;
  };
  // The pixels of a tile are neighbours in memory, in rows: a line in any direction stays within few cache lines and pages.
  std::vector<std::uint32_t> columns_, rows_;

  std::int32_t width_ = 0, height_ = 0;
  int samples_ = 1;
  std::uint32_t wanted_ = 1;
  frame::Area area_;
  std::span<const std::uint8_t> unwanted_;
  float gaps_ = 0.f;
  static constexpr std::int32_t most_tiles = 64;  // of a level that are looked at
  int tiles_shift_ = 3;                           // from tiles to squares
  std::int32_t side_ = 64, squares_left_ = 0, squares_top_ = 0, squares_wide_ = 0, squares_high_ = 0;
  // The sixteen samples of a pixel lie on one line of the cache; those of tiles that reach beyond the picture are 0 there.
  struct alignas(64) CacheLine {
    std::uint32_t keys[16];
  };
  std::vector<CacheLine> lines_;
  Level fine_, coarse_;  // tiles, and tiles of tiles

  bool whole(const Square& tiles) const;
  bool wanted(std::size_t tile) const { return unwanted_.empty() || !unwanted_[tile]; }
  std::uint32_t far_in_tile(std::int32_t tx, std::int32_t ty) const;
};

}  // namespace forest::render::cpu
