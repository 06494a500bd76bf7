// SPDX-License-Identifier: Apache-2.0
// How much detail a place in the picture deserves: pure functions of bounds, error, camera and gaze.
#pragma once

#include <algorithm>
#include <optional>

#include "forest/frame/camera.h"

namespace forest::scene {

/// What the choice of detail depends on.
struct Detail {
  float error = 1.f;         // acceptable error at the gaze (or everywhere), pixels
  std::optional<Vec2> gaze;  // pixel looked at; none: the whole picture is looked at
  float acuity_slope =
      1.5f;            // minimum angle of resolution grows by this many arc minutes a degree of eccentricity
                       // (Guenter et al. 2012 measured 1.32–1.65)
  float fovea = 2.5f;  // degrees around the gaze in which nothing differs from a picture without one
  float screen =
      0.f;  // degrees that the picture's height takes in the viewer's sight; 0: as many as the field of view
  std::optional<frame::Area> area = {};  // only these pixels are wanted; none: all
  float surface_width =
      3.f;  // branches wider than this many pixels are drawn as capsules, thinner ones as lines
  // Branches thinner than this many pixels are drawn as wide, as many of them as cover the same area: whole branches stand
  // for their like. 0: all are drawn as they are. A picture of one sample cannot draw less than a pixel.
  float thinnest = 0.f;
};

/// Where somebody looks on a flat screen, and how far beside it things are seen. Degrees are those of the viewer, whose sight
/// the picture fills as Detail::screen says; the camera's field of view may be another.
class Gaze {
 public:
  /// @param viewport  of the whole picture; detail.gaze is in its pixels, its middle when there is none
  Gaze(const frame::Camera& camera, const frame::Viewport& viewport, const Detail& detail);

  Vec2 pixel() const { return pixel_; }
  const Vec3& direction() const { return direction_; }  // unit; x right, y down, z into the screen
  /// From the viewer to a pixel, as long as it is far, in pixels; and back.
  Vec3 way_to(const Vec2& pixel) const {
    return {pixel.x() - middle_.x(), pixel.y() - middle_.y(), distance_};
  }
  Vec2 pixel_of(const Vec3& way) const { return middle_ + way.head<2>() * (distance_ / way.z()); }

  float eccentricity(const Vec2& pixel) const;  // degrees between it and the gaze
  /// Degrees that `pixels` beside one another take at most, anywhere on the screen.
  float angle(float pixels) const { return degrees(pixels / distance_); }
  /// The smallest thing resolved at an eccentricity, in pixels: Guenter et al. 2012, equation 1, the smallest resolved angle is
  /// slope × eccentricity + that of the fovea, 1/48°. Less than 1 where the screen is coarser than the eye.
  float resolved(float eccentricity, const Detail& detail) const;
  /// Where things of so many pixels are no longer resolved, degrees; infinite when that is nowhere.
  float where_resolved(float pixels, const Detail& detail) const;

 private:
  Vec2 middle_, pixel_;
  float distance_;  // from the viewer to the screen, pixels
  Vec3 direction_;
};

/// A camera with what the functions below need precomputed.
class Eye {
 public:
  Eye(const frame::Camera& camera, const frame::Viewport& viewport, const Detail& detail);

  const frame::Camera& camera() const { return camera_; }
  const Detail& detail() const { return detail_; }
  const frame::Frustum& frustum() const { return frustum_; }  // of what is wanted of the picture

  /// Depth along the view of the nearest point of a sphere, never less than the near distance, µm.
  float nearest_depth(const Sphere& sphere) const;
  /// Pixels that a length of 1 µm covers at the nearest point of the sphere.
  float magnification(const Sphere& sphere) const {
    return camera_.orthographic() ? focal_ : focal_ / nearest_depth(sphere);
  }
  /// Acceptable error in pixels for what lies within the sphere: that of its point nearest to the gaze.
  float acceptable(const Sphere& sphere) const;
  /// Whether something in `sphere`, wrong by `error` µm, may be shown so.
  bool good_enough(const Sphere& sphere, float error) const {
    return error * magnification(sphere) <= acceptable(sphere);
  }

 private:
  frame::Camera camera_;
  Detail detail_;
  frame::Frustum frustum_;
  Mat3 axes_;
  float focal_;
  Vec2 middle_;  // of the picture, pixels
  Gaze gaze_;
};

/// A frame-time budget that moves the detail of pictures that follow one another: as many samples a pixel as stills have
/// where there is time for them, else one; and the acceptable error, which pictures that took too long make larger and quick
/// ones smaller.
class Budget {
 public:
  /// What a picture may take where nobody says otherwise, milliseconds: in the studio and in what measures it.
  static constexpr double usual = 45.;

  /// @param worst  error that is accepted at most, pixels
  explicit Budget(double milliseconds = usual, float worst = 6.f)
      : milliseconds_(milliseconds), worst_(worst) {}
  std::uint32_t samples() const { return samples_; }
  float error() const { return error_; }
  /// As Detail::thinnest: what is smaller than the error need not be there one by one.
  float thinnest() const { return samples_ == 1 ? error_ : std::max(0.f, .25f * (error_ - 1.f)); }
  /// To be told of every picture that was drawn so.
  void took(double milliseconds);

 private:
  double milliseconds_;
  double longer_ =
      1.8;  // times the one sample's that many are taken to need; more where they were tried in vain
  float worst_, error_ = 1.f;
  std::uint32_t samples_ = 1, agreed_ = 0;  // pictures that have asked for the other number of samples
};

}  // namespace forest::scene
