// SPDX-License-Identifier: Apache-2.0
#include "forest/scene/occlusion.h"

#include <algorithm>
#include <bit>
#include <cmath>

namespace forest::scene {
namespace {

constexpr float margin = 2.f;          // pixels that a line may be wider than what it shows, and jitter
constexpr float depth_step = 1.0001f;  // more than a step of a pixel's key
constexpr float tile = float(FOREST_TILE);

}  // namespace

Occluders::Occluders(const frame::DepthMap& map, const frame::Camera& camera, const frame::Viewport& viewport)
    : axes_(camera.axes()),
      eye_(camera.eye),
      orthographic_(camera.orthographic()),
      near_(camera.near),
      focal_(camera.focal(viewport.height)),
      centre_x_(.5f * viewport.width),
      centre_y_(.5f * viewport.height) {
  if (map.depths.empty()) return;
  levels_.push_back({map.width, map.height, map.depths});
  while (levels_.back().width > 1 || levels_.back().height > 1) {
    const Level& below = levels_.back();
    Level level{(below.width + 1) / 2, (below.height + 1) / 2, {}};
    level.depths.reserve(std::size_t(level.width) * level.height);
    for (std::uint32_t y = 0; y < level.height; ++y)
      for (std::uint32_t x = 0; x < level.width; ++x) {
        const std::uint32_t right = std::min(2 * x + 1, below.width - 1),
                            lower = std::min(2 * y + 1, below.height - 1);
        level.depths.push_back(std::max({below.at(2 * x, 2 * y), below.at(right, 2 * y),
                                         below.at(2 * x, lower), below.at(right, lower)}));
      }
    levels_.push_back(std::move(level));
  }
}

bool Occluders::hide(const Sphere& sphere) const {
  if (levels_.empty()) return false;
  const Vec3 p = axes_.transpose() * (sphere.centre - eye_);
  const float depth = -p.z(), nearest = depth - sphere.radius;
  if (!(nearest > near_)) return false;
  // A point at distance r from the centre is seen at most f · r · |p| / (depth · nearest) beside it.
  const float scale = orthographic_ ? focal_ : focal_ / depth;
  const float reach = focal_ * sphere.radius * (orthographic_ ? 1.f : p.norm() / (depth * nearest)) + margin;
  const float x = centre_x_ + scale * p.x(), y = centre_y_ - scale * p.y();
  const Level& finest = levels_.front();
  const float wide = float(finest.width) * tile, high = float(finest.height) * tile;
  if (!(x + reach >= 0.f && y + reach >= 0.f && x - reach < wide && y - reach < high)) return false;
  auto left = std::uint32_t(std::max(x - reach, 0.f) / tile),
       top = std::uint32_t(std::max(y - reach, 0.f) / tile);
  auto right = std::min(std::uint32_t(std::min(x + reach, wide) / tile), finest.width - 1),
       bottom = std::min(std::uint32_t(std::min(y + reach, high) / tile), finest.height - 1);
  // The level at which the rectangle is at most four wide: few look-ups, and little that is not below it.
  const std::uint32_t span = std::max(right - left, bottom - top);
  const std::size_t k =
      std::min<std::size_t>(std::size_t(std::max(int(std::bit_width(span)) - 2, 0)), levels_.size() - 1);
  left >>= k, top >>= k, right >>= k, bottom >>= k;
  const Level& level = levels_[k];
  for (std::uint32_t row = top; row <= bottom; ++row)
    for (std::uint32_t column = left; column <= right; ++column)
      if (!(level.at(column, row) * depth_step < nearest)) return false;
  return true;
}

}  // namespace forest::scene
