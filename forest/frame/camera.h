// SPDX-License-Identifier: Apache-2.0
// The eye: a pinhole camera in the world (µm).
#pragma once

#include "forest/core/bounds.h"
#include "forest/core/vec.h"
#include "forest/geometry/round_cone.h"

namespace forest::frame {

struct Camera {
  Vec3 eye{0.f, 0.f, 1000.f};
  Vec3 target = Vec3::Zero();
  Vec3 up = Vec3::UnitY();
  float field_of_view = 40.f;  // vertical, degrees, in (0, 180)
  float near = .5f;            // nothing nearer is drawn, µm

  /// Columns: right, up, backward. Orthonormal also when `up` is parallel to the view.
  Mat3 axes() const;
  float focal(float height) const;  // pixels per unit slope for a picture `height` pixels high
};

/// A picture's pixels as seen by a camera: x to the right, y down, (0, 0) the upper left corner.
struct Viewport {
  float width = 1280.f, height = 720.f;
};

/// Pixel and depth (µm along the view) of a point; the pixel is meaningless when the depth is not positive.
Vec3 project(const Camera& camera, const Viewport& viewport, const Vec3& point);
Ray ray_through(const Camera& camera, const Viewport& viewport, const Vec2& pixel);

/// The five planes that bound what a camera sees (no far plane), normals inwards.
class Frustum {
 public:
  Frustum(const Camera& camera, const Viewport& viewport);
  bool may_see(const Sphere& sphere) const;

 private:
  Eigen::Matrix<float, 5, 4> planes_;
};

}  // namespace forest::frame
