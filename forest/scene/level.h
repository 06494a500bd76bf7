// SPDX-License-Identifier: Apache-2.0
// How much detail a place in the picture deserves: pure functions of bounds, error, camera and gaze.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <utility>

#include "forest/frame/camera.h"
#include "forest/scene/seen.h"

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
  std::optional<frame::Area> hole = {};  // … and of them not these
  // Branches wider than this many pixels are drawn as capsules, thinner ones as lines. Pixels at the gaze: elsewhere as many times
  // more as the acceptable error is.
  float surface_width = 3.f;
  // Branches thinner than this many pixels are drawn as wide, as many of them as cover the same area: whole branches stand
  // for their like. 0: all are drawn as they are. A picture of one sample cannot draw less than a pixel.
  float thinnest = 0.f;
  // Pixels of the picture as wide as one that is drawn: a picture for which there is no time is drawn smaller and enlarged
  // (fovea.h). All else here counts pixels that are drawn.
  float pixel = 1.f;
  // Neurons of which nothing was seen in the picture before are looked at in every so-many-th one only, where there is no time for all:
  // what comes into sight is seen as much later.
  std::uint32_t turns = 1;
  float fog =
      0.f;  // strength of the depth cue, as View::fog: what is seen through it may be wrong by more; 0: none
};

/// What depth takes away: light falls to 1 / e over `length` from `start` on; µm along the view.
struct Fog {
  float start = 0.f, length = INFINITY;

  /// Beyond this less than a grey level of 255 is left of anything, on the darkest background.
  float end() const { return start + 7.f * length; }
  /// How many times larger an error may be that is seen through it: contrast counts as its root, and no error as four times
  /// what it is.
  float forgives(float depth) const { return std::clamp(std::exp(.5f * (depth - start) / length), 1.f, 4.f); }
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
  const frame::Viewport& viewport() const { return viewport_; }
  const Detail& detail() const { return detail_; }
  const frame::Frustum& frustum() const { return frustum_; }  // of what is wanted of the picture

  /// Whether another one's picture shows the same, whatever its size.
  bool sees_the_same(const Eye& other) const {
    return camera_ == other.camera_ && whole_.low == other.whole_.low && whole_.high == other.whole_.high;
  }
  /// The same for all eyes whose cameras are the same, whatever the size of their pictures.
  Seen see(const Sphere& sphere) const { return viewer_(sphere); }
  const Viewer& viewer() const { return viewer_; }
  /// Of which anything may be in what is wanted of the picture.
  std::uint32_t may_see(const SeenTogether& seen) const { return within(wanted_, seen); }
  /// … and in the picture, wanted or not.
  std::uint32_t may_be_in_picture(const SeenTogether& seen) const { return within(whole_, seen); }

  /// Depth along the view of the nearest point of a sphere, never less than the near distance, µm.
  float nearest_depth(const Sphere& sphere) const { return nearest_depth(see(sphere)); }
  float nearest_depth(const Seen& seen) const { return std::max(seen.nearest, camera_.near); }
  /// Pixels that a length of 1 µm covers at the nearest point of the sphere.
  float magnification(const Sphere& sphere) const { return magnification(see(sphere)); }
  float magnification(const Seen& seen) const {
    return camera_.orthographic() ? focal_ : focal_ / nearest_depth(seen);
  }
  /// Pixels that a length of 1 µm covers which is so close (Seen::closeness).
  float magnification(float closeness) const { return focal_ * closeness; }
  /// Acceptable error in pixels for what lies within the sphere: that of its point nearest to the gaze.
  float acceptable(const Sphere& sphere) const { return acceptable(see(sphere)); }
  float acceptable(const Seen& seen) const;
  /// Whether something in `sphere`, wrong by `error` µm, may be shown so.
  bool good_enough(const Sphere& sphere, float error) const { return good_enough(see(sphere), error); }
  bool good_enough(const Seen& seen, float error) const {
    const float wrong = error * focal_, unit = camera_.orthographic() ? 1.f : nearest_depth(seen);
    // Most are by far good enough, or are not anywhere.
    return wrong <= detail_.error * unit ||
           (wrong <= most_acceptable_ * unit && wrong <= acceptable(seen) * unit);
  }
  /// Whether branches of this radius, µm, are so thin there that they are drawn as lines.
  bool thin(const Seen& seen, float radius) const {
    const float width = 2.f * radius * magnification(seen), wrong = width / detail_.surface_width;
    return wrong <= 1.f ||
           (wrong * detail_.error <= most_acceptable_ && wrong * detail_.error <= acceptable(seen));
  }

 private:
  frame::Camera camera_;
  frame::Viewport viewport_;
  Detail detail_;
  frame::Frustum frustum_;
  Viewer viewer_;
  float focal_;
  Vec2 middle_;  // of the picture, pixels
  // A rectangle of the picture without another, as Seen::place has places.
  struct Borders {
    Vec2 low = Vec2::Zero(), high = Vec2::Zero();
    Vec2 low_length = Vec2::Ones(),
         high_length = Vec2::Ones();  // what distances from them are divided by to be µm
    Vec2 hole_low = Vec2::Constant(INFINITY), hole_high = Vec2::Constant(-INFINITY);
    float converge = 1.f,
          parallel = 0.f;  // what a length is divided by to be seen: converge × depth + parallel
  };
  static std::uint32_t within(const Borders& borders, const SeenTogether& seen);
  Borders wanted_, whole_;
  Gaze gaze_;
  float most_acceptable_;  // error anywhere in what is wanted, pixels
};

/// A frame-time budget that moves the detail of pictures that follow one another: as many samples a pixel as there is time for,
/// larger pixels where there is no time for one, and within them the acceptable error, which pictures that take too long make
/// larger and quick ones smaller.
///
/// Detail that comes and goes is seen more than detail that is not there. So what the last few pictures took is judged by its median,
/// which no single one moves, nothing changes while that is about right, and what was changed is looked at anew before it is
/// changed again.
class Budget {
 public:
  /// What a picture may take where nobody says otherwise, milliseconds: in the studio and in what measures it.
  static constexpr double usual = 30.;
  /// The same for pictures that follow a gaze: sixty a second.
  static constexpr double with_gaze = 15.;

  explicit Budget(double milliseconds = usual) : milliseconds_(milliseconds) {}
  /// For a view that stands still while what is on its branches changes: it begins as the view was seen at rest, and takes its time,
  /// for fewer pictures a second are seen less than thin branches that go and come back.
  static Budget standing();
  double milliseconds() const { return milliseconds_; }  // that a picture may take
  std::uint32_t samples() const;
  /// As Detail::pixel.
  float pixel() const;
  float error() const { return error_; }
  /// As Detail::turns.
  std::uint32_t turns() const;
  /// As Detail::thinnest: what is smaller than the error need not be there one by one.
  float thinnest() const;
  /// As frame::soften: what is drawn is nearer to the truth so, the more the fewer its samples.
  float softness() const;
  /// To be told of every picture that was drawn so. One of few segments takes no less time with fewer: where it takes long the
  /// machine has other things to do, and the forest must not fall apart for that.
  void took(double milliseconds, std::uint64_t segments = all);

 private:
  static constexpr std::uint64_t all = ~std::uint64_t(0);
  static constexpr std::size_t plain_step = 3;  // one sample of every pixel

  double median(std::size_t last) const;
  void go_to(std::size_t step, float error);
  double longer(std::size_t step) const;
  std::pair<std::size_t, double> upwards(double share) const;

  double milliseconds_;
  std::size_t step_ = plain_step;
  float error_ = 1.f;
  std::array<double, 9> times_{};   // milliseconds of the last pictures of this step and error, …
  std::size_t drawn_ = 0;           // … of which there were so many; the last first
  double calm_ = 0.;                // pictures have been quick for so many milliseconds
  std::array<double, 5> longer_{};  // times that a picture of the next step took when it was tried; fades
  std::optional<double> expected_;  // share of the time that the step should take which was just gone up to
};

}  // namespace forest::scene
