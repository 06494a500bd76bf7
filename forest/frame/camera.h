// SPDX-License-Identifier: Apache-2.0
// The eye: a pinhole camera in the world (µm), or an orthographic one, which sees along parallel rays.
#pragma once

#include <cstdint>

#include "forest/core/bounds.h"
#include "forest/core/vec.h"
#include "forest/geometry/round_cone.h"

namespace forest::frame {

enum class Projection : std::uint8_t { perspective, orthographic };

struct Camera {
  Vec3 eye{0.f, 0.f, 1000.f};
  Vec3 target = Vec3::Zero();
  Vec3 up = Vec3::UnitY();
  float field_of_view = 40.f;  // vertical, degrees, in (0, 180)
  float near = .5f;            // nothing nearer is drawn, µm
  /// Orthographic: the picture is as high everywhere as the field of view is at the target, so that a change of projection
  /// keeps the size of what is looked at, and coming nearer enlarges.
  Projection projection = Projection::perspective;

  /// Columns: right, up, backward. Orthonormal also when `up` is parallel to the view.
  Mat3 axes() const;
  /// For a picture `height` pixels high: pixels per unit slope; of an orthographic camera pixels a µm.
  float focal(float height) const;
  /// µm that a pixel covers at a depth, for a picture `height` pixels high.
  float pixel_size(float height, float depth) const;
  bool orthographic() const { return projection == Projection::orthographic; }
  bool operator==(const Camera&) const = default;
};

/// A picture's pixels as seen by a camera: x to the right, y down, (0, 0) the upper left corner.
struct Viewport {
  float width = 1280.f, height = 720.f;
};

/// Some of a picture's pixels: [left, right) × [top, bottom).
struct Area {
  std::uint32_t left = 0, top = 0, right = 0, bottom = 0;
  bool operator==(const Area&) const = default;
};

/// Pixel and depth (µm along the view) of a point; the pixel is meaningless when the depth is not positive.
Vec3 project(const Camera& camera, const Viewport& viewport, const Vec3& point);
/// From the eye; of an orthographic camera from the plane of the eye.
Ray ray_through(const Camera& camera, const Viewport& viewport, const Vec2& pixel);

/// The five planes that bound what a camera sees (no far plane), normals inwards.
class Frustum {
 public:
  Frustum(const Camera& camera, const Viewport& viewport);
  /// What is seen in a part of the picture.
  Frustum(const Camera& camera, const Viewport& viewport, const Area& area);
  bool may_see(const Sphere& sphere) const;

 private:
  // In pixels, relative to the middle of the picture.
  Frustum(const Camera& camera, float height, const Vec2& low, const Vec2& high);

  Eigen::Matrix<float, 5, 4> planes_;
};

}  // namespace forest::frame
