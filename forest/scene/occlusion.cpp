// SPDX-License-Identifier: Apache-2.0
#include "forest/scene/occlusion.h"

#include <algorithm>
#include <bit>
#include <cmath>

#include "forest/core/parallel.h"

namespace forest::scene {
namespace {

constexpr float margin = 2.f;          // pixels that a line may be wider than what it shows, and jitter
constexpr float depth_step = 1.0001f;  // more than a step of a pixel's key
constexpr float tile = float(FOREST_TILE);
constexpr std::size_t rows_at_once = 32;

}  // namespace

Occluders::Occluders(const frame::DepthMap& map, const frame::Camera& camera, const frame::Viewport& viewport)
    : width_(map.width),
      height_(map.height),
      viewer_(camera),
      focal_(camera.focal(viewport.height)),
      centre_x_(.5f * viewport.width - tile * float(map.left)),
      centre_y_(.5f * viewport.height - tile * float(map.top)) {
  if (map.depths.empty()) return;
  squares_.push_back(map.depths);
  for (std::uint32_t side = 1; 2 * side <= std::min(width_, height_); side *= 2) {
    const std::vector<float>& small = squares_.back();
    std::vector<float> large(small.size());
    parallel_for(height_, rows_at_once, [&](std::size_t y) {
      const float* row = &small[y * width_];
      const float* below = y + side < height_ ? row + std::size_t(side) * width_ : row;
      float* to = &large[y * width_];
      for (std::uint32_t x = 0; x < width_ - side; ++x)
        to[x] = std::max(std::max(row[x], row[x + side]), std::max(below[x], below[x + side]));
      for (std::uint32_t x = width_ - side; x < width_; ++x) to[x] = std::max(row[x], below[x]);
    });
    squares_.push_back(std::move(large));
  }
}

float Occluders::farthest(std::uint32_t left, std::uint32_t top, std::uint32_t right,
                          std::uint32_t bottom) const {
  // Squares as large as fit, the last of each row and column moved back so as not to reach beyond.
  const std::uint32_t shorter = std::min(right - left, bottom - top) + 1;
  const auto k = std::min<std::size_t>(std::size_t(std::bit_width(shorter) - 1), squares_.size() - 1);
  const std::uint32_t side = 1u << k, last_x = right + 1 - side, last_y = bottom + 1 - side;
  const float* squares = squares_[k].data();
  if (right - left < 2 * side && bottom - top < 2 * side) {  // of a sphere: four do, without a branch
    const float *first = squares + std::size_t(top) * width_, *last = squares + std::size_t(last_y) * width_;
    return std::max(std::max(first[left], first[last_x]), std::max(last[left], last[last_x]));
  }
  float result = 0.f;
  for (std::uint32_t y = top;; y = std::min(y + side, last_y)) {
    for (std::uint32_t x = left;; x = std::min(x + side, last_x)) {
      result = std::max(result, squares[std::size_t(y) * width_ + x]);
      if (x == last_x) break;
    }
    if (y == last_y) return result;
  }
}

bool Occluders::hide(const Glimpse& seen) const {
  if (squares_.empty() || !(seen.reach < INFINITY)) return false;
  const float reach = focal_ * seen.reach + margin;
  const float x = centre_x_ + focal_ * seen.x, y = centre_y_ + focal_ * seen.y;
  const float wide = float(width_) * tile, high = float(height_) * tile;
  if (!(x + reach >= 0.f && y + reach >= 0.f && x - reach < wide && y - reach < high)) return false;
  constexpr float tiles = 1.f / tile;
  const auto left = std::uint32_t(std::max(x - reach, 0.f) * tiles),
             top = std::uint32_t(std::max(y - reach, 0.f) * tiles);
  const auto right = std::min(std::uint32_t(std::min(x + reach, wide) * tiles), width_ - 1),
             bottom = std::min(std::uint32_t(std::min(y + reach, high) * tiles), height_ - 1);
  return farthest(left, top, right, bottom) * depth_step < seen.nearest;
}

}  // namespace forest::scene
