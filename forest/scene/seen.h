// SPDX-License-Identifier: Apache-2.0
// A sphere as a camera sees it: worked out once, then asked about by everybody who decides what is drawn of it. Hundreds of
// thousands are looked at for a picture, so several that belong together are beside one another, for vector instructions.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>

#include "forest/core/bounds.h"
#include "forest/frame/camera.h"

namespace forest::scene {

struct Seen {
  Seen() = default;  // no aggregate: {centre, radius} is a Sphere

  Vec3 at = Vec3::Zero();  // its centre: to the right, up and ahead of the eye, µm
  float radius = 0.f;      // µm
  float nearest = 0.f;     // how far ahead its nearest point lies, µm
  bool known = false;      // whether it is wholly before the eye; of others nothing below is known
  bool orthographic = false;
  // In a picture of any size, times that picture's focal length (frame::Camera::focal): pixels from its middle to where the
  // centre is seen, y downwards; and how far beside it anything of the sphere is seen at most. A point at distance r from the
  // centre is seen f · r · |p| / (depth · nearest) beside it at most.
  Vec2 place = Vec2::Zero();
  float reach = 0.f;

  /// What a length at its centre measures in a picture, times that picture's focal length; what lies behind the eye's near
  /// distance is as close as that.
  float closeness(float near) const { return orthographic ? 1.f : 1.f / std::max(at.z(), near); }
};

/// Spheres that are looked at together.
struct Spheres {
  static constexpr std::size_t most = 8;
  float x[most], y[most], z[most], radius[most];

  /// What sphere(i) returns for each of a few; where there are fewer than the most, the first stands in for the others.
  Spheres(std::size_t count, auto&& sphere) {
    for (std::size_t i = 0; i < count; ++i) put(i, sphere(i));
    for (std::size_t i = count; i < most; ++i) x[i] = x[0], y[i] = y[0], z[i] = z[0], radius[i] = radius[0];
  }
  explicit Spheres(const Sphere& sphere) : Spheres(1, [&](std::size_t) { return sphere; }) {}
  Sphere operator[](std::size_t i) const { return {{x[i], y[i], z[i]}, radius[i]}; }

 private:
  void put(std::size_t i, const Sphere& sphere) {
    x[i] = sphere.centre.x(), y[i] = sphere.centre.y(), z[i] = sphere.centre.z(), radius[i] = sphere.radius;
  }
};

/// What decides whether a sphere is hidden, in a picture of any size: its place and how far beside it anything of it is seen (as
/// Seen has them), and how far ahead its nearest point lies.
struct Glimpse {
  float x = 0.f, y = 0.f, reach = INFINITY,
        nearest = 0.f;  // of a sphere that is not wholly before the eye: anywhere
};

/// The same of each as Seen has of one; sets of them are bits, that of sphere i being 1 << i.
struct SeenTogether {
  static constexpr std::size_t most = Spheres::most;
  float x[most], y[most], z[most], radius[most], nearest[most];
  float place_x[most], place_y[most], reach[most];  // of the known
  std::uint32_t known = 0;
  bool orthographic = false;

  Glimpse glimpse(std::size_t i) const {
    if (!(known >> i & 1u)) return {};
    return {place_x[i], place_y[i], reach[i], nearest[i]};
  }
  Seen operator[](std::size_t i) const {
    Seen seen;
    seen.at = {x[i], y[i], z[i]}, seen.radius = radius[i], seen.nearest = nearest[i];
    seen.known = known >> i & 1u, seen.orthographic = orthographic;
    seen.place = {place_x[i], place_y[i]}, seen.reach = reach[i];
    return seen;
  }
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

  bool operator==(const Viewer&) const = default;

  /// The same for spheres in the coordinates of something that stands there and is turned so.
  Viewer within(const Vec3& position, const Mat3& turn) const {
    Viewer viewer = *this;
    viewer.to_camera_ = to_camera_ * turn;
    viewer.eye_ = turn.transpose() * (eye_ - position);
    return viewer;
  }
  Seen operator()(const Sphere& sphere) const {
    SeenTogether seen;
    (*this)(Spheres(sphere), seen);
    return seen[0];
  }
  void operator()(const Spheres& spheres, SeenTogether& seen) const;

 private:
  Mat3 to_camera_;  // rows: right, up, forward
  Vec3 eye_;
  float near_;
  bool orthographic_;
};

}  // namespace forest::scene
