// SPDX-License-Identifier: Apache-2.0
// How much detail a place in the picture deserves: pure functions of bounds, error, camera and gaze.
#pragma once

#include <optional>

#include "forest/frame/camera.h"

namespace forest::scene {

/// What the choice of detail depends on.
struct Detail {
  float error = 1.f;         // acceptable error at the gaze (or everywhere), pixels
  std::optional<Vec2> gaze;  // pixel looked at; none: the whole picture is looked at
  float acuity_slope =
      1.5f;  // minimum angle of resolution grows by this many arc minutes a degree of eccentricity
             // (Guenter et al. 2012 measured 1.32–1.65)
  float surface_width =
      3.f;            // branches wider than this many pixels are drawn as capsules, thinner ones as lines
  bool thin = false;  // leave out runs whose branches are all too thin for their rank: right for one subframe
};

/// A camera with what the functions below need precomputed.
class Eye {
 public:
  Eye(const frame::Camera& camera, const frame::Viewport& viewport, const Detail& detail);

  const frame::Camera& camera() const { return camera_; }
  const Detail& detail() const { return detail_; }

  /// Depth along the view of the nearest point of a sphere, never less than the near distance, µm.
  float nearest_depth(const Sphere& sphere) const;
  /// Pixels that a length of 1 µm covers at the nearest point of the sphere.
  float magnification(const Sphere& sphere) const { return focal_ / nearest_depth(sphere); }
  /// Acceptable error in pixels for what lies within the sphere: that of its point nearest to the gaze.
  float acceptable(const Sphere& sphere) const;
  /// Whether something in `sphere`, wrong by `error` µm, may be shown so.
  bool good_enough(const Sphere& sphere, float error) const {
    return error * magnification(sphere) <= acceptable(sphere);
  }

 private:
  frame::Camera camera_;
  Detail detail_;
  Mat3 axes_;
  float focal_, pixel_degrees_;
  Vec3 gaze_ray_ = Vec3::Zero();  // unit, world
};

/// A frame-time budget that moves the acceptable error: pictures that took too long make it larger, quick ones smaller,
/// between a pixel and `worst`.
class Budget {
 public:
  explicit Budget(double milliseconds, float worst = 6.f) : milliseconds_(milliseconds), worst_(worst) {}
  float error() const { return error_; }
  void took(double milliseconds);

 private:
  double milliseconds_;
  float worst_, error_ = 1.f;
};

}  // namespace forest::scene
