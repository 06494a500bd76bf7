// SPDX-License-Identifier: Apache-2.0
#include "forest/scene/level.h"

#include <algorithm>
#include <cmath>

namespace forest::scene {

namespace {

constexpr float fovea_resolves = 1.f / 48.f;  // degrees
constexpr float margin =
    4.f;  // pixels that lines and their rims may reach beyond the bounds of what they show

float distance_of(const frame::Camera& camera, float height, const Detail& detail) {
  const float high = detail.screen > 0.f ? detail.screen : camera.field_of_view;
  return .5f * height / std::tan(.5f * radians(high));
}

}  // namespace

Gaze::Gaze(const frame::Camera& camera, const frame::Viewport& viewport, const Detail& detail)
    : middle_(.5f * viewport.width, .5f * viewport.height),
      pixel_(detail.gaze.value_or(middle_)),
      distance_(distance_of(camera, viewport.height, detail)),
      direction_(way_to(pixel_).normalized()) {}

float Gaze::eccentricity(const Vec2& pixel) const {
  const Vec3 way = way_to(pixel);
  return degrees(std::atan2(way.cross(direction_).norm(), way.dot(direction_)));
}

float Gaze::resolved(float eccentricity, const Detail& detail) const {
  return (detail.acuity_slope / 60.f * eccentricity + fovea_resolves) / angle(1.f);
}

float Gaze::where_resolved(float pixels, const Detail& detail) const {
  if (!(detail.acuity_slope > 0.f)) return INFINITY;
  return std::max(0.f, (pixels * angle(1.f) - fovea_resolves) * 60.f / detail.acuity_slope);
}

Eye::Eye(const frame::Camera& camera, const frame::Viewport& viewport, const Detail& detail)
    : camera_(camera),
      detail_(detail),
      frustum_(detail.area ? frame::Frustum(camera, viewport, *detail.area)
                           : frame::Frustum(camera, viewport)),
      axes_(camera.axes()),
      focal_(camera.focal(viewport.height)),
      middle_(.5f * viewport.width, .5f * viewport.height),
      gaze_(camera, viewport, detail) {}

float Eye::nearest_depth(const Sphere& sphere) const {
  const float depth = -axes_.col(2).dot(sphere.centre - camera_.eye);
  return std::max(depth - sphere.radius, camera_.near);
}

float Eye::acceptable(const Sphere& sphere) const {
  if (!detail_.gaze) return detail_.error;
  const Vec3 p = axes_.transpose() * (sphere.centre - camera_.eye);
  const float depth = -p.z(), nearest = depth - sphere.radius;
  float scale = focal_, reach = focal_ * sphere.radius;
  if (!camera_.orthographic()) {
    if (!(nearest > camera_.near)) return detail_.error;
    scale /= depth;
    reach *= p.norm() / (depth * nearest);  // as scene/occlusion.cpp
  }
  const float eccentricity =
      gaze_.eccentricity(middle_ + Vec2(scale * p.x(), -scale * p.y())) - gaze_.angle(reach + margin);
  if (eccentricity <= detail_.fovea) return detail_.error;
  return detail_.error * std::max(1.f, gaze_.resolved(eccentricity, detail_));
}

// Pixels of error that many samples are drawn with at most.
static float most_of_many(float worst) { return std::min(3.f, worst); }

void Budget::took(double milliseconds) {
  // Many samples at their largest error still show more than one at its smallest, in about twice the time. Changing back and
  // forth would be seen, so several pictures must agree, and what was in vain is not tried again so soon.
  constexpr std::uint32_t many = 16;
  const bool one = samples_ == 1;
  const float least = one ? 1.f : .5f, most = one ? worst_ : most_of_many(worst_);
  const bool other = one ? error_ <= least && longer_ * milliseconds < milliseconds_
                         : error_ >= most && milliseconds > 1.1 * milliseconds_;
  agreed_ = other ? agreed_ + 1 : 0;
  if (agreed_ == 3) {
    if (!one) longer_ *= 2.;
    samples_ = one ? many : 1, error_ = one ? most_of_many(worst_) : 1.f, agreed_ = 0;
    return;
  }
  const double ratio = std::clamp(milliseconds / milliseconds_, .5, 16.);  // the first picture of a large forest may take long
  error_ = std::clamp(error_ * float(std::sqrt(ratio)), least, most);
}

}  // namespace forest::scene
