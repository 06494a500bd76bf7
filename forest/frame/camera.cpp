// SPDX-License-Identifier: Apache-2.0
#include "forest/frame/camera.h"

#include <cmath>

namespace forest::frame {

Mat3 Camera::axes() const {
  Vec3 backward = eye - target;
  backward = backward.squaredNorm() > 0.f ? Vec3(backward.normalized()) : Vec3(Vec3::UnitZ());
  Vec3 right = up.cross(backward);
  if (right.squaredNorm() < 1e-8f * up.squaredNorm()) right = backward.unitOrthogonal();
  right.normalize();
  Mat3 axes;
  axes << right, backward.cross(right), backward;
  return axes;
}

float Camera::focal(float height) const {
  const float slope = 2.f * std::tan(.5f * radians(field_of_view));
  return height / (orthographic() ? slope * (eye - target).norm() : slope);
}

float Camera::pixel_size(float height, float depth) const {
  return (orthographic() ? 1.f : depth) / focal(height);
}

Vec3 project(const Camera& camera, const Viewport& viewport, const Vec3& point) {
  const Vec3 seen = camera.axes().transpose() * (point - camera.eye);
  const float depth = -seen.z(), size = camera.pixel_size(viewport.height, depth);
  return {.5f * viewport.width + seen.x() / size, .5f * viewport.height - seen.y() / size, depth};
}

Ray ray_through(const Camera& camera, const Viewport& viewport, const Vec2& pixel) {
  const float focal = camera.focal(viewport.height);
  const Vec3 beside((pixel.x() - .5f * viewport.width) / focal, (.5f * viewport.height - pixel.y()) / focal,
                    0.f);
  const Mat3 axes = camera.axes();
  if (camera.orthographic()) return {camera.eye + axes * beside, -axes.col(2)};
  return {camera.eye, (axes * (beside - Vec3::UnitZ())).normalized()};
}

Frustum::Frustum(const Camera& camera, float height, const Vec2& low, const Vec2& high) {
  const Mat3 axes = camera.axes();
  const float focal = camera.focal(height);
  const float left = low.x() / focal, right = high.x() / focal, top = -low.y() / focal,
              bottom = -high.y() / focal;
  // Through the eye, or at a distance beside it.
  const float p = camera.orthographic() ? 0.f : 1.f;
  const Vec4 sides[] = {{1, 0, p * left, (1 - p) * -left},
                        {-1, 0, -p * right, (1 - p) * right},
                        {0, 1, p * bottom, (1 - p) * -bottom},
                        {0, -1, -p * top, (1 - p) * top},
                        {0, 0, -1, 0}};
  for (int i = 0; i < 5; ++i) {
    const float length = sides[i].head<3>().norm();
    const Vec3 normal = axes * (sides[i].head<3>() / length);
    planes_.row(i) << normal.transpose(), sides[i].w() / length - normal.dot(camera.eye);
  }
}

Frustum::Frustum(const Camera& camera, const Viewport& viewport)
    : Frustum(camera, viewport.height, -.5f * Vec2(viewport.width, viewport.height),
              .5f * Vec2(viewport.width, viewport.height)) {}

Frustum::Frustum(const Camera& camera, const Viewport& viewport, const Area& area)
    : Frustum(camera, viewport.height,
              Vec2(float(area.left), float(area.top)) - .5f * Vec2(viewport.width, viewport.height),
              Vec2(float(area.right), float(area.bottom)) - .5f * Vec2(viewport.width, viewport.height)) {}

bool Frustum::may_see(const Sphere& sphere) const {
  return ((planes_.leftCols<3>() * sphere.centre + planes_.col(3)).array() >= -sphere.radius).all();
}

}  // namespace forest::frame
