// SPDX-License-Identifier: Apache-2.0
// A sphere as a camera sees it: worked out once, then asked about by everybody who decides what is drawn of it.
#pragma once

#include "forest/core/bounds.h"
#include "forest/frame/camera.h"

namespace forest::scene {

struct Seen {
  Seen() = default;  // no aggregate: {centre, radius} is a Sphere

  Vec3 at = Vec3::Zero();  // its centre: to the right, up and ahead of the eye, µm
  float radius = 0.f;      // µm
  float nearest = 0.f;     // how far ahead its nearest point lies, µm
  // In a picture of any size, times that picture's focal length (frame::Camera::focal): pixels from its middle to where the
  // centre is seen, y downwards, and how far beside it anything of the sphere is seen at most. Nothing is known of a sphere that is
  // not wholly before the eye.
  Vec2 place = Vec2::Zero();
  float reach = 0.f;
  bool known = false;
};

/// From where spheres are seen.
class Viewer {
 public:
  explicit Viewer(const frame::Camera& camera)
      : to_camera_(camera.axes().transpose()),
        eye_(camera.eye),
        near_(camera.near),
        orthographic_(camera.orthographic()) {
    to_camera_.row(2) *= -1.f;
  }

  bool orthographic() const { return orthographic_; }
  Seen operator()(const Sphere& sphere) const {
    Seen seen;
    seen.at = to_camera_ * (sphere.centre - eye_);
    seen.radius = sphere.radius;
    const float depth = seen.at.z();
    seen.nearest = depth - sphere.radius;
    seen.known = seen.nearest > near_;
    // A point at distance r from the centre is seen at most f · r · |p| / (depth · nearest) beside it.
    const float scale = orthographic_ ? 1.f : 1.f / depth;
    seen.place = {scale * seen.at.x(), -scale * seen.at.y()};
    seen.reach = scale * sphere.radius * (orthographic_ ? 1.f : seen.at.norm() / seen.nearest);
    return seen;
  }

 private:
  Mat3 to_camera_;  // rows: right, up, forward
  Vec3 eye_;
  float near_;
  bool orthographic_;
};

}  // namespace forest::scene
