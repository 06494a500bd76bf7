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

float Camera::focal(float height) const { return .5f * height / std::tan(.5f * radians(field_of_view)); }

Vec3 project(const Camera& camera, const Viewport& viewport, const Vec3& point) {
  const Vec3 seen = camera.axes().transpose() * (point - camera.eye);
  const float depth = -seen.z(), focal = camera.focal(viewport.height);
  return {.5f * viewport.width + focal * seen.x() / depth, .5f * viewport.height - focal * seen.y() / depth,
          depth};
}

Ray ray_through(const Camera& camera, const Viewport& viewport, const Vec2& pixel) {
  const float focal = camera.focal(viewport.height);
  const Vec3 seen((pixel.x() - .5f * viewport.width) / focal, (.5f * viewport.height - pixel.y()) / focal,
                  -1.f);
  return {camera.eye, (camera.axes() * seen).normalized()};
}

Frustum::Frustum(const Camera& camera, const Viewport& viewport) {
  const Mat3 axes = camera.axes();
  const float x = .5f * viewport.width / camera.focal(viewport.height),
              y = .5f * viewport.height / camera.focal(viewport.height);
  const Vec3 normals[] = {{1, 0, -x}, {-1, 0, -x}, {0, 1, -y}, {0, -1, -y}, {0, 0, -1}};
  for (int i = 0; i < 5; ++i) {
    const Vec3 normal = axes * normals[i].normalized();
    planes_.row(i) << normal.transpose(), -normal.dot(camera.eye);
  }
}

bool Frustum::may_see(const Sphere& sphere) const {
  return ((planes_.leftCols<3>() * sphere.centre + planes_.col(3)).array() >= -sphere.radius).all();
}

}  // namespace forest::frame
