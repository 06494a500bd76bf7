// SPDX-License-Identifier: Apache-2.0
#include "forest/render/cpu/canvas.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "forest/core/parallel.h"
#include "forest/frame/constants.h"

namespace forest::render::cpu {
namespace {

constexpr std::int32_t tile = std::int32_t(FOREST_TILE);
constexpr std::int32_t most = 6;  // tiles of a level that a rectangle may cover

std::int32_t tiles_over(std::int32_t pixels) { return (pixels + tile - 1) / tile; }

}  // namespace

void Canvas::clear(std::uint32_t width, std::uint32_t height, const frame::Area& area,
                   const frame::Area& hole, float gaps) {
  area_ = area, hole_ = hole, gaps_ = gaps;
  width_ = std::int32_t(width), height_ = std::int32_t(height);
  fine_.width = tiles_over(width_), fine_.height = tiles_over(height_);
  const std::size_t tiles_wide = std::size_t(fine_.width);
  keys_.resize(tiles_wide * std::size_t(fine_.height) * tile * tile);
  const std::size_t top = area.top / tile, rows = std::size_t(tiles_over(std::int32_t(area.bottom))) - top,
                    left = area.left / tile,
                    columns = std::size_t(tiles_over(std::int32_t(area.right))) - left;
  parallel_for(rows, 16, [&](std::size_t row) {
    const std::size_t ty = top + row;
    std::uint32_t* keys = &keys_[(ty * tiles_wide + left) * tile * tile];
    std::fill(keys, keys + columns * tile * tile, FOREST_KEY_EMPTY);
    for (std::int32_t y = std::int32_t(ty) * tile; y < std::int32_t(ty + 1) * tile; ++y)
      for (std::int32_t x = y < height_ ? width_ : 0; x < fine_.width * tile; ++x) keys_[place(x, y)] = 0;
  });
  looked_ = false;
}

void Canvas::read_row(std::int32_t y, std::uint32_t* keys) const {
  const std::uint32_t* from = &keys_[place(0, y)];
  for (std::int32_t x = 0; x < width_; x += tile, from += tile * tile)
    std::copy(from, from + std::min(tile, width_ - x), keys + x);
}

// The farthest key of a tile's wanted pixels but for the share of gaps; 0 when there are none.
std::uint32_t Canvas::far_in_tile(std::int32_t tx, std::int32_t ty) const {
  const auto within = [&](std::int32_t low, std::uint32_t from, std::uint32_t to) {
    return std::pair(std::max(low, std::int32_t(from)), std::min(low + tile, std::int32_t(to)));
  };
  const auto [left, right] = within(tx * tile, area_.left, area_.right);
  const auto [top, bottom] = within(ty * tile, area_.top, area_.bottom);
  if (left >= right || top >= bottom) return 0;
  if (left >= std::int32_t(hole_.left) && right <= std::int32_t(hole_.right) &&
      top >= std::int32_t(hole_.top) && bottom <= std::int32_t(hole_.bottom))
    return 0;
  std::array<std::uint32_t, std::size_t(tile) * std::size_t(tile)> keys;
  std::size_t count = 0;
  for (std::int32_t y = top; y < bottom; ++y)
    for (std::int32_t x = left; x < right; ++x) keys[count++] = keys_[place(x, y)];
  const auto nth = keys.begin() + std::ptrdiff_t(float(count - 1) * (1.f - gaps_));
  std::nth_element(keys.begin(), nth, keys.begin() + std::ptrdiff_t(count));
  return *nth;
}

void Canvas::look() {
  fine_.farthest.resize(keys_.size() / (tile * tile));
  const frame::Area& a = area_;
  const bool partly = a.left > 0 || a.top > 0 || a.right < std::uint32_t(width_) ||
                      a.bottom < std::uint32_t(height_) || gaps_ > 0.f || hole_.right > hole_.left;
  parallel_for(fine_.farthest.size(), 512, [&](std::size_t t) {
    if (partly) {
      fine_.farthest[t] = far_in_tile(std::int32_t(t) % fine_.width, std::int32_t(t) / fine_.width);
      return;
    }
    const std::uint32_t* keys = &keys_[t * tile * tile];
    std::uint32_t far = 0;
    for (std::int32_t i = 0; i < tile * tile; ++i) far = std::max(far, keys[i]);
    fine_.farthest[t] = far;
  });
  coarse_.width = tiles_over(fine_.width), coarse_.height = tiles_over(fine_.height);
  coarse_.farthest.assign(std::size_t(coarse_.width) * std::size_t(coarse_.height), 0u);
  for (std::int32_t y = 0; y < fine_.height; ++y)
    for (std::int32_t x = 0; x < fine_.width; ++x) {
      std::uint32_t& far = coarse_.farthest[std::size_t(y / tile * coarse_.width + x / tile)];
      far = std::max(far, fine_.farthest[std::size_t(y * fine_.width + x)]);
    }
  looked_ = true;
}

bool Canvas::hidden(float left, float top, float right, float bottom, float nearest_code) const {
  if (!(left < float(width_) && top < float(height_) && right >= 0.f && bottom >= 0.f)) return true;
  if (!looked_) return false;
  std::int32_t x0 = std::int32_t(std::max(left, 0.f)) / tile, y0 = std::int32_t(std::max(top, 0.f)) / tile;
  std::int32_t x1 = std::int32_t(std::min(right, float(width_ - 1))) / tile,
               y1 = std::int32_t(std::min(bottom, float(height_ - 1))) / tile;
  const Level* level = &fine_;
  if ((x1 - x0 + 1) * (y1 - y0 + 1) > most) {
    level = &coarse_;
    x0 /= tile, y0 /= tile, x1 /= tile, y1 /= tile;
    if ((x1 - x0 + 1) * (y1 - y0 + 1) > 4 * most) return false;
  }
  const std::uint32_t key = key_of(nearest_code, 0);
  for (std::int32_t y = y0; y <= y1; ++y)
    for (std::int32_t x = x0; x <= x1; ++x)
      if (level->farthest[std::size_t(y * level->width + x)] >= key) return false;
  return true;
}

frame::DepthMap Canvas::depth_map() const {
  frame::DepthMap map{std::uint32_t(fine_.width), std::uint32_t(fine_.height), {}};
  map.depths.reserve(fine_.farthest.size());
  for (const std::uint32_t key : fine_.farthest)
    map.depths.push_back(key == FOREST_KEY_EMPTY ? INFINITY : frame::depth_of_code(key >> 12));
  return map;
}

}  // namespace forest::render::cpu
