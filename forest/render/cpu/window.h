// SPDX-License-Identifier: Apache-2.0
// What one thread draws into: a square of the canvas, with so many samples of every pixel.
#pragma once

#include "forest/render/cpu/canvas.h"

namespace forest::render::cpu {

/// Where the samples of a pixel look, beside its middle: those of frame::sample_place. All of a pixel are drawn together, so
/// that a segment is brought to the picture once and not once a subframe.
template <int S>
struct Samples {
  float x[S], y[S];  // pixels that the picture moves by
  float turn[S];     // of the noise that rounds shades
  std::uint32_t subframe[S];

  Samples(std::uint32_t first, std::uint32_t subframes) {
    FOREST_LANES
    for (int k = 0; k < S; ++k) {
      const Vec2 place = frame::sample_place(first + std::uint32_t(k), subframes);
      x[k] = place.x(), y[k] = place.y();
      turn[k] = golden * float(k);
      subframe[k] = first + std::uint32_t(k);
    }
    for (std::size_t steep = 0; steep < 2; ++steep)
      for (std::size_t i = 0; i <= slopes; ++i) {
        const float slope = 2.f / float(slopes) * float(i) - 1.f;
        float least = INFINITY, most = -INFINITY;
        for (int k = 0; k < S; ++k) {
          const float at = steep ? x[k] - slope * y[k] : y[k] - slope * x[k];
          least = std::min(least, at), most = std::max(most, at);
        }
        least_[steep][i] = least, most_[steep][i] = most;
      }
  }
  /// How far from a pixel's middle its samples lie, across a line.
  /// @param steep  whether it runs along the vertical axis more, and then by how much it leaves that, within ± 1
  std::pair<float, float> beside(bool steep, float slope) const {
    // Between two slopes no sample lies farther away than at one of them.
    const auto i =
        std::size_t(smaller(larger((slope + 1.f) * (.5f * float(slopes)), 0.f), float(slopes - 1)));
    return {smaller(least_[steep][i], least_[steep][i + 1]), larger(most_[steep][i], most_[steep][i + 1])};
  }

 private:
  static constexpr std::size_t slopes = 32;
  float least_[2][slopes + 1], most_[2][slopes + 1];
};

/// Keys of the samples of a pixel; FOREST_KEY_EMPTY leaves a sample as it is.
template <int S>
using Keys = std::uint32_t[S];

template <int S>
class Window {
 public:
  Window(Canvas& canvas, const Square& square)
      : canvas_(canvas),
        square_(square),
        tiles_{square.left >> tile_bits, square.top >> tile_bits, (square.right - 1) >> tile_bits,
               (square.bottom - 1) >> tile_bits},
        keys_(canvas.keys()),
        columns_(canvas.columns().data()),
        rows_(canvas.rows().data()) {}

  const Square& square() const { return square_; }
  /// Of a pixel, from the picture's upper left corner on.
  std::uint32_t number(std::int32_t x, std::int32_t y) const {
    return std::uint32_t(y) * std::uint32_t(canvas_.width()) + std::uint32_t(x);
  }
  /// The nearest keys win.
  [[gnu::always_inline]] void put(std::int32_t x, std::int32_t y, const Keys<S>& keys) {
    put(columns_[x] + rows_[y], keys);
  }
  /// Where the keys of a pixel are.
  /// @param steep  whether `along` is a row and `across` a column
  [[gnu::always_inline]] std::uint32_t place(bool steep, std::int32_t along, std::int32_t across) const {
    const std::uint32_t *of_along = steep ? rows_ : columns_, *of_across = steep ? columns_ : rows_;
    return of_along[along] + of_across[across];
  }
  [[gnu::always_inline]] void put(std::uint32_t place, const Keys<S>& keys) {
    std::uint32_t* pixel = keys_ + place;
    FOREST_LANES
    for (int k = 0; k < S; ++k) pixel[k] = keys[k] < pixel[k] ? keys[k] : pixel[k];
  }
  void fetch(std::uint32_t place) const { __builtin_prefetch(keys_ + place, 1); }
  /// Of single samples, the FOREST_TILE pixels from `x`, a multiple of as many, on.
  [[gnu::always_inline]] void put_row(std::int32_t x, std::int32_t y,
                                      const std::uint32_t (&keys)[FOREST_TILE]) {
    std::uint32_t* pixel = canvas_.at(x, y);
    FOREST_LANES
    for (int k = 0; k < int(FOREST_TILE); ++k) pixel[k] = keys[k] < pixel[k] ? keys[k] : pixel[k];
  }
  /// Whether all of the FOREST_TILE pixels from `x`, a multiple of as many, on have keys before this one.
  [[gnu::always_inline]] bool before(std::int32_t x, std::int32_t y, std::uint32_t key) const {
    std::uint32_t farthest = 0;
    const std::uint32_t* pixel = canvas_.at(x, y);
    FOREST_LANES
    for (int k = 0; k < S * int(FOREST_TILE); ++k) farthest = pixel[k] > farthest ? pixel[k] : farthest;
    return farthest < key;
  }
  /// The same of tiles, those of other squares left out, and a key.
  bool hidden(const Tiles& t, std::uint32_t nearest) const {
    return canvas_.hidden(Tiles{std::max(t.left, tiles_.left), std::max(t.top, tiles_.top),
                                std::min(t.right, tiles_.right), std::min(t.bottom, tiles_.bottom)},
                          nearest);
  }
  bool hidden(float left, float top, float right, float bottom, float nearest_code) const {
    return canvas_.hidden(square_, left, top, right, bottom, nearest_code);
  }

 private:
  Canvas& canvas_;
  Square square_;
  Tiles tiles_;
  std::uint32_t* keys_;
  const std::uint32_t *columns_, *rows_;
};

/// A window seen through a screen door: only the samples at which something of that opacity shows.
template <int S>
class Door {
 public:
  Door(Window<S>& window, const Samples<S>& samples, std::uint32_t subframes, std::uint32_t opacity,
       std::uint32_t key)
      : window_(window),
        samples_(samples),
        opacity_(opacity),
        key_(key),
        whole_(subframes >= FOREST_DOOR_SUBFRAMES) {
    FOREST_LANES
    for (int k = 0; k < S; ++k) shows_[k] = frame::forest_shows(opacity, key, samples.subframe[k]);
  }

  /// Whether nothing shows through it.
  bool shut() const {
    std::uint32_t any = whole_ ? 0u : 1u;
    FOREST_LANES
    for (int k = 0; k < S; ++k) any |= shows_[k];
    return !any;
  }
  const Square& square() const { return window_.square(); }
  void put(std::int32_t x, std::int32_t y, const Keys<S>& keys) {
    const std::uint32_t pixel = whole_ ? 0u : frame::forest_mixed(window_.number(x, y));
    Keys<S> seen;
    FOREST_LANES
    for (int k = 0; k < S; ++k) {
      const bool shows =
          whole_ ? shows_[k] != 0 : frame::forest_shows(opacity_, key_ ^ pixel, samples_.subframe[k]);
      seen[k] = shows ? keys[k] : FOREST_KEY_EMPTY;
    }
    window_.put(x, y, seen);
  }
  std::uint32_t place(bool steep, std::int32_t along, std::int32_t across) const {
    return std::uint32_t(steep ? along : across) << 16 | std::uint32_t(steep ? across : along);
  }
  void fetch(std::uint32_t) const {}
  void put(std::uint32_t place, const Keys<S>& keys) {
    put(std::int32_t(place & 0xffff), std::int32_t(place >> 16), keys);
  }
  void put_row(std::int32_t x, std::int32_t y, const std::uint32_t (&keys)[FOREST_TILE]) {
    for (std::int32_t k = 0; k < std::int32_t(FOREST_TILE); ++k)
      if (keys[k] != FOREST_KEY_EMPTY) put(x + k, y, {keys[k]});
  }
  bool before(std::int32_t x, std::int32_t y, std::uint32_t key) const { return window_.before(x, y, key); }
  bool hidden(float left, float top, float right, float bottom, float nearest_code) const {
    return window_.hidden(left, top, right, bottom, nearest_code);
  }

 private:
  Window<S>& window_;
  const Samples<S>& samples_;
  std::uint32_t opacity_, key_;
  bool whole_;  // a branch shows at all pixels or at none
  std::uint32_t shows_[S];
};

}  // namespace forest::render::cpu
