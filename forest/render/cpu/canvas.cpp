// SPDX-License-Identifier: Apache-2.0
#include "forest/render/cpu/canvas.h"

#include <algorithm>
#include <bit>
#include <cmath>

#include "forest/core/clones.h"
#include "forest/frame/constants.h"

namespace forest::render::cpu {
namespace {

constexpr std::int32_t tile = std::int32_t(FOREST_TILE), tile_of_tiles = tile * tile;

std::int32_t parts(std::int32_t pixels, std::int32_t of) { return (pixels + of - 1) / of; }

// A square's keys stay within the second cache: 64 KiB with one sample, 256 KiB with more.
std::int32_t side_for(int samples) { return samples <= 4 ? Canvas::most_across : 64; }

// Of tiles that follow one another, each of so many keys: the farthest key of each.
FOREST_CLONES void find_farthest(const std::uint32_t* keys, std::size_t tiles, std::size_t keys_a_tile,
                                 std::uint32_t* far) {
  constexpr std::size_t lanes = 16,
                        part = 64;  // keys that are looked at before it is asked whether any is empty
  for (std::size_t t = 0; t < tiles; ++t) {
    const std::uint32_t* tile_keys = keys + t * keys_a_tile;
    std::uint32_t all = 0;
    for (std::size_t from = 0; from < keys_a_tile && all != FOREST_KEY_EMPTY; from += part) {
      std::uint32_t farthest_of[lanes] = {};
      for (std::size_t i = from; i < std::min(from + part, keys_a_tile); i += lanes) {
        FOREST_LANES
        for (std::size_t k = 0; k < lanes; ++k)
          farthest_of[k] = tile_keys[i + k] > farthest_of[k] ? tile_keys[i + k] : farthest_of[k];
      }
      FOREST_LANES
      for (std::size_t k = 0; k < lanes; ++k) all = farthest_of[k] > all ? farthest_of[k] : all;
    }
    far[t] = all;
  }
}

FOREST_CLONES std::uint32_t count_up_to(const std::uint32_t* keys, std::size_t count, std::uint32_t limit) {
  std::uint32_t n = 0;
  for (std::size_t i = 0; i < count; ++i) n += keys[i] <= limit;
  return n;
}

// A key that so many of them are not behind, hardly farther than need be.
std::uint32_t farthest_but(const std::uint32_t* keys, std::size_t count, std::size_t so_many) {
  constexpr std::uint32_t last = FOREST_KEY_EMPTY - 1;
  if (count_up_to(keys, count, last) < so_many) return FOREST_KEY_EMPTY;
  // Halved until it is within .2 % of the distance: 2¹⁹ keys are 128 of the 43,240 depths of an octave.
  std::uint32_t low = 0, high = last;
  while (high - low > 1u << 19) {
    const std::uint32_t middle = low + (high - low) / 2;
    (count_up_to(keys, count, middle) < so_many ? low : high) = middle;
  }
  return high;
}

}  // namespace

void Canvas::resize(std::uint32_t width, std::uint32_t height, int samples, std::uint32_t wanted,
                    const frame::Area& area, std::span<const std::uint8_t> unwanted, float gaps) {
  area_ = area, unwanted_ = unwanted, gaps_ = gaps;
  samples_ = samples, wanted_ = wanted;
  width_ = std::int32_t(width), height_ = std::int32_t(height);
  fine_.width = parts(width_, tile), fine_.height = parts(height_, tile);
  coarse_.width = parts(fine_.width, tile), coarse_.height = parts(fine_.height, tile);
  const std::size_t tiles = std::size_t(fine_.width) * std::size_t(fine_.height);
  lines_.resize(tiles * tile * tile * std::size_t(samples) / 16);
  constexpr std::int32_t beyond = 2;
  columns_.resize(std::size_t(fine_.width * tile + beyond)),
      rows_.resize(std::size_t(fine_.height * tile + beyond));
  const auto in_tiles = [&](std::size_t i, std::size_t next_tile, std::size_t next) {
    return std::uint32_t((i / tile * next_tile + i % tile * next) * std::size_t(samples));
  };
  for (std::size_t x = 0; x < columns_.size(); ++x) columns_[x] = in_tiles(x, tile * tile, 1);
  for (std::size_t y = 0; y < rows_.size(); ++y)
    rows_[y] = in_tiles(y, std::size_t(fine_.width) * tile * tile, tile);
  // Squares that are never cleared are beside the area.
  fine_.farthest.assign(tiles, 0u);
  coarse_.farthest.assign(std::size_t(coarse_.width) * std::size_t(coarse_.height), 0u);
  side_ = side_for(samples), tiles_shift_ = std::countr_zero(std::uint32_t(side_ / tile));
  squares_left_ = std::int32_t(area.left) / side_, squares_top_ = std::int32_t(area.top) / side_;
  squares_wide_ = parts(std::int32_t(area.right), side_) - squares_left_;
  squares_high_ = parts(std::int32_t(area.bottom), side_) - squares_top_;
}

Square Canvas::square(std::size_t number) const {
  const std::int32_t left = (squares_left_ + std::int32_t(number) % squares_wide_) * side_,
                     top = (squares_top_ + std::int32_t(number) / squares_wide_) * side_;
  const auto up = [](std::uint32_t x, std::int32_t limit) {
    return std::min(parts(std::int32_t(x), tile) * tile, limit);
  };
  const auto down = [](std::uint32_t x) { return std::int32_t(x) / tile * tile; };
  return {std::max(left, down(area_.left)), std::max(top, down(area_.top)),
          std::min(left + side_, up(area_.right, width_)), std::min(top + side_, up(area_.bottom, height_))};
}

Square Canvas::touched(float left, float top, float right, float bottom) const {
  const auto part = [](float x) {
    return std::int32_t(std::floor(smaller(larger(x, -1e6f), 1e6f))) >> tile_bits;
  };
  return touched(Tiles{part(left), part(top), part(right), part(bottom)});
}

void Canvas::clear(const Square& s) {
  std::array<std::uint32_t, most_samples> none{};
  for (int k = 0; k < samples_; ++k) none[std::size_t(k)] = wanted_ >> k & 1 ? FOREST_KEY_EMPTY : 0u;
  const auto samples = std::size_t(samples_);
  const auto fill = [&](std::uint32_t* keys, std::size_t pixels) {
    if (wanted_ == (1ull << samples_) - 1)
      std::fill(keys, keys + pixels * samples, FOREST_KEY_EMPTY);
    else
      for (std::size_t i = 0; i < pixels; ++i)
        std::copy(none.begin(), none.begin() + samples_, keys + i * samples);
  };
  for (std::int32_t y = s.top; y < s.bottom; y += tile) {
    fill(at(s.left, y), std::size_t(parts(s.right - s.left, tile)) * tile * tile);
    // Beyond the picture's edges.
    for (std::int32_t row = y; row < y + tile; ++row)
      for (std::int32_t x = row < height_ ? std::max(s.left, width_) : s.left;
           x < parts(s.right, tile) * tile; ++x)
        std::fill(at(x, row), at(x, row) + samples, 0u);
  }
  for (std::int32_t ty = s.top / tile; ty < parts(s.bottom, tile); ++ty)
    for (std::int32_t tx = s.left / tile; tx < parts(s.right, tile); ++tx)
      if (const auto n = std::size_t(ty * fine_.width + tx); wanted(n)) fine_.farthest[n] = FOREST_KEY_EMPTY;
  for (std::int32_t y = s.top / tile_of_tiles; y < parts(s.bottom, tile_of_tiles); ++y)
    for (std::int32_t x = s.left / tile_of_tiles; x < parts(s.right, tile_of_tiles); ++x)
      coarse_.farthest[std::size_t(y * coarse_.width + x)] = FOREST_KEY_EMPTY;
}

void Canvas::read_row(std::int32_t y, std::int32_t from, std::int32_t to, std::uint32_t* keys) const {
  for (std::int32_t x = from; x < to;) {
    const std::int32_t next = std::min((x | (tile - 1)) + 1, to);
    const std::uint32_t* pixel = at(x, y);
    keys = std::copy(pixel, pixel + std::size_t(next - x) * std::size_t(samples_), keys);
    x = next;
  }
}

// Whether all pixels of a rectangle of tiles lie in the area, and the farthest of a tile's decides.
bool Canvas::whole(const Square& tiles) const {
  const std::int32_t left = tiles.left * tile, top = tiles.top * tile, right = tiles.right * tile,
                     bottom = tiles.bottom * tile;
  const auto reaches = [](std::int32_t to, std::uint32_t edge, std::int32_t end) {
    return to <= std::int32_t(edge) || std::int32_t(edge) == end;
  };
  return gaps_ == 0.f && left >= std::int32_t(area_.left) && top >= std::int32_t(area_.top) &&
         reaches(right, area_.right, width_) && reaches(bottom, area_.bottom, height_);
}

// The farthest key of a tile's wanted samples but for the share of gaps; 0 when there are none.
std::uint32_t Canvas::far_in_tile(std::int32_t tx, std::int32_t ty) const {
  const auto within = [&](std::int32_t low, std::uint32_t from, std::uint32_t to) {
    return std::pair(std::max(low, std::int32_t(from)), std::min(low + tile, std::int32_t(to)));
  };
  const auto [left, right] = within(tx * tile, area_.left, area_.right);
  const auto [top, bottom] = within(ty * tile, area_.top, area_.bottom);
  if (left >= right || top >= bottom) return 0;
  const std::size_t all = std::size_t(tile * tile) * std::size_t(samples_);
  if (right - left == tile && bottom - top == tile && wanted_ == (1ull << samples_) - 1)
    return farthest_but(at(left, top), all, all - std::size_t(float(all) * gaps_));
  std::array<std::uint32_t, std::size_t(tile) * std::size_t(tile) * most_samples> keys;
  std::size_t count = 0;
  for (std::int32_t y = top; y < bottom; ++y)
    for (std::int32_t x = left; x < right; ++x)
      for (int k = 0; k < samples_; ++k)
        if (wanted_ >> k & 1) keys[count++] = at(x, y)[k];
  const auto nth = keys.begin() + std::ptrdiff_t(float(count - 1) * (1.f - gaps_));
  std::nth_element(keys.begin(), nth, keys.begin() + std::ptrdiff_t(count));
  return *nth;
}

void Canvas::look(const Square& s) {
  const std::int32_t left = s.left / tile, right = parts(s.right, tile), top = s.top / tile,
                     bottom = parts(s.bottom, tile);
  const std::size_t keys_a_tile = std::size_t(tile * tile) * std::size_t(samples_);
  const bool every = unwanted_.empty() && whole({left, top, right, bottom});
  for (std::int32_t ty = top; ty < bottom; ++ty) {
    std::uint32_t* far = &fine_.farthest[std::size_t(ty * fine_.width)];
    if (every)
      find_farthest(at(left * tile, ty * tile), std::size_t(right - left), keys_a_tile, far + left);
    else
      for (std::int32_t tx = left; tx < right; ++tx)
        if (!wanted(std::size_t(ty * fine_.width + tx)))
          far[tx] = 0;
        else if (whole({tx, ty, tx + 1, ty + 1}))
          find_farthest(at(tx * tile, ty * tile), 1, keys_a_tile, far + tx);
        else
          far[tx] = far_in_tile(tx, ty);
  }
  for (std::int32_t cy = top / tile; cy < parts(bottom, tile); ++cy)
    for (std::int32_t cx = left / tile; cx < parts(right, tile); ++cx) {
      std::uint32_t far = 0;
      for (std::int32_t ty = std::max(cy * tile, top); ty < std::min((cy + 1) * tile, bottom); ++ty)
        for (std::int32_t tx = std::max(cx * tile, left); tx < std::min((cx + 1) * tile, right); ++tx)
          far = std::max(far, fine_.farthest[std::size_t(ty * fine_.width + tx)]);
      coarse_.farthest[std::size_t(cy * coarse_.width + cx)] = far;
    }
}

bool Canvas::hidden(const Square& s, float left, float top, float right, float bottom,
                    float nearest_code) const {
  if (!(left < float(s.right) && top < float(s.bottom) && right >= float(s.left) && bottom >= float(s.top)))
    return true;
  return hidden(
      Tiles{std::int32_t(larger(left, float(s.left))) / tile, std::int32_t(larger(top, float(s.top))) / tile,
            std::int32_t(smaller(right, float(s.right - 1))) / tile,
            std::int32_t(smaller(bottom, float(s.bottom - 1))) / tile},
      key_of(nearest_code, 0));
}

frame::DepthMap Canvas::depth_map() const {
  const auto up = [](std::uint32_t pixels) { return std::uint32_t(parts(std::int32_t(pixels), tile)); };
  frame::DepthMap map;
  map.left = area_.left / FOREST_TILE, map.top = area_.top / FOREST_TILE;
  map.width = up(area_.right) - map.left, map.height = up(area_.bottom) - map.top;
  map.depths.reserve(std::size_t(map.width) * map.height);
  for (std::uint32_t y = map.top; y < map.top + map.height; ++y)
    for (std::uint32_t x = map.left; x < map.left + map.width; ++x) {
      const std::uint32_t key = fine_.farthest[std::size_t(y) * std::size_t(fine_.width) + x];
      map.depths.push_back(key == FOREST_KEY_EMPTY ? INFINITY : frame::depth_of_code(key >> 12));
    }
  return map;
}

}  // namespace forest::render::cpu
