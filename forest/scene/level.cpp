// SPDX-License-Identifier: Apache-2.0
#include "forest/scene/level.h"

#include <algorithm>
#include <cmath>

namespace forest::scene {

Eye::Eye(const frame::Camera& camera, const frame::Viewport& viewport, const Detail& detail)
    : camera_(camera),
      detail_(detail),
      axes_(camera.axes()),
      focal_(camera.focal(viewport.height)),
      pixel_degrees_(degrees(1.f / focal_)) {
  if (detail.gaze) gaze_ray_ = frame::ray_through(camera, viewport, *detail.gaze).direction;
}

float Eye::nearest_depth(const Sphere& sphere) const {
  const float depth = -axes_.col(2).dot(sphere.centre - camera_.eye);
  return std::max(depth - sphere.radius, camera_.near);
}

float Eye::acceptable(const Sphere& sphere) const {
  if (!detail_.gaze) return detail_.error;
  const Vec3 to = sphere.centre - camera_.eye;
  const float distance = to.norm();
  if (distance <= sphere.radius) return detail_.error;
  const float between = std::acos(std::clamp(to.dot(gaze_ray_) / distance, -1.f, 1.f));
  const float eccentricity = degrees(std::max(0.f, between - std::asin(sphere.radius / distance)));
  // Guenter et al. 2012, equation 1: smallest resolved angle = slope × eccentricity + that of the fovea, which here is
  // at least the pixel.
  const float resolved = detail_.acuity_slope / 60.f * eccentricity + std::max(pixel_degrees_, 1.f / 60.f);
  return detail_.error * std::max(1.f, resolved / pixel_degrees_);
}

void Budget::took(double milliseconds) {
  const double ratio = std::clamp(milliseconds / milliseconds_, .5, 2.);
  error_ = std::clamp(error_ * float(std::sqrt(ratio)), 1.f, worst_);
}

}  // namespace forest::scene
