// SPDX-License-Identifier: Apache-2.0
#include "forest/scene/level.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "forest/core/clones.h"

namespace forest::scene {

namespace {

constexpr float fovea_resolves = 1.f / 48.f;  // degrees
constexpr float margin =
    4.f;  // pixels that lines and their rims may reach beyond the bounds of what they show

float distance_of(const frame::Camera& camera, float height, const Detail& detail) {
  const float high = detail.screen > 0.f ? detail.screen : camera.field_of_view;
  return .5f * height / std::tan(.5f * radians(high));
}

}  // namespace

Gaze::Gaze(const frame::Camera& camera, const frame::Viewport& viewport, const Detail& detail)
    : middle_(.5f * viewport.width, .5f * viewport.height),
      pixel_(detail.gaze.value_or(middle_)),
      distance_(distance_of(camera, viewport.height, detail)),
      direction_(way_to(pixel_).normalized()) {}

float Gaze::eccentricity(const Vec2& pixel) const {
  const Vec3 way = way_to(pixel);
  return degrees(std::atan2(way.cross(direction_).norm(), way.dot(direction_)));
}

float Gaze::resolved(float eccentricity, const Detail& detail) const {
  return (detail.acuity_slope / 60.f * eccentricity + fovea_resolves) / angle(1.f);
}

float Gaze::where_resolved(float pixels, const Detail& detail) const {
  if (!(detail.acuity_slope > 0.f)) return INFINITY;
  return std::max(0.f, (pixels * angle(1.f) - fovea_resolves) * 60.f / detail.acuity_slope);
}

Eye::Eye(const frame::Camera& camera, const frame::Viewport& viewport, const Detail& detail)
    : camera_(camera),
      viewport_(viewport),
      detail_(detail),
      frustum_(detail.area ? frame::Frustum(camera, viewport, *detail.area)
                           : frame::Frustum(camera, viewport)),
      viewer_(camera),
      focal_(camera.focal(viewport.height)),
      middle_(.5f * viewport.width, .5f * viewport.height),
      gaze_(camera, viewport, detail),
      most_acceptable_(detail.error) {
  const frame::Area& area =
      detail.area.value_or(frame::Area{0, 0, std::uint32_t(viewport.width), std::uint32_t(viewport.height)});
  const Vec2 low(float(area.left), float(area.top)), high(float(area.right), float(area.bottom));
  const auto borders_of = [&](const Vec2& from, const Vec2& to) {
    Borders b;
    b.low = (from - middle_) / focal_, b.high = (to - middle_) / focal_;
    if (camera.orthographic())
      b.converge = 0.f, b.parallel = 1.f;
    else
      b.low_length = (1.f + b.low.array().square()).sqrt(),
      b.high_length = (1.f + b.high.array().square()).sqrt();
    return b;
  };
  wanted_ = borders_of(low, high), whole_ = borders_of(Vec2::Zero(), 2.f * middle_);
  if (detail.hole) {
    const Borders hole =
        borders_of({float(detail.hole->left) + margin, float(detail.hole->top) + margin},
                   {float(detail.hole->right) - margin, float(detail.hole->bottom) - margin});
    wanted_.hole_low = hole.low, wanted_.hole_high = hole.high;
  }
  if (!detail.gaze) return;
  for (const Vec2& corner : {low, high, Vec2(low.x(), high.y()), Vec2(high.x(), low.y())})
    most_acceptable_ =
        std::max(most_acceptable_, detail.error * gaze_.resolved(gaze_.eccentricity(corner), detail));
}

// Distances from the planes through the borders, as in frame::Frustum.
FOREST_CLONES std::uint32_t Eye::within(const Borders& b, const SeenTogether& seen) {
  const float low_x = b.low.x(), high_x = b.high.x(), low_y = b.low.y(), high_y = b.high.y();
  const float low_x_length = b.low_length.x(), high_x_length = b.high_length.x(),
              low_y_length = b.low_length.y(), high_y_length = b.high_length.y();
  const float left = b.hole_low.x(), right = b.hole_high.x(), top = b.hole_low.y(), bottom = b.hole_high.y();
  std::uint32_t in[SeenTogether::most], in_hole[SeenTogether::most];
  FOREST_LANES
  for (std::size_t i = 0; i < SeenTogether::most; ++i) {
    const float radius = seen.radius[i], x = seen.x[i], y = -seen.y[i], z = seen.z[i],
                across = b.converge * z + b.parallel;
    in[i] = (z >= -radius) & (x - across * low_x >= -radius * low_x_length) &
            (across * high_x - x >= -radius * high_x_length) &
            (y - across * low_y >= -radius * low_y_length) & (across * high_y - y >= -radius * high_y_length);
    const float reach = seen.reach[i], px = seen.place_x[i], py = seen.place_y[i];
    in_hole[i] = (px - reach >= left) & (px + reach <= right) & (py - reach >= top) & (py + reach <= bottom);
  }
  std::uint32_t all = 0, hole = 0;
  for (std::size_t i = 0; i < SeenTogether::most; ++i) all |= in[i] << i, hole |= in_hole[i] << i;
  return all & ~(hole & seen.known);
}

float Eye::acceptable(const Seen& seen) const {
  if (!detail_.gaze || !seen.known) return detail_.error;
  const float eccentricity =
      gaze_.eccentricity(middle_ + focal_ * seen.place) - gaze_.angle(focal_ * seen.reach + margin);
  if (eccentricity <= detail_.fovea) return detail_.error;
  return detail_.error * std::max(1.f, gaze_.resolved(eccentricity, detail_));
}

namespace {

/// What a budget may choose, and where it begins when it comes to it.
struct Step {
  float pixel;                   // as Detail::pixel
  std::uint32_t samples;         // of a pixel
  float finest, coarsest;        // acceptable error, pixels
  float from_below, from_above;  // the error that takes about as long as the step left
  std::uint32_t turns;           // as Detail::turns
  double longer;   // times what a picture at the finest error takes: one of the next step as it begins
  float softness;  // by which pictures are most like the truth
};
// Most time goes to segments and not to samples, so that four samples at an error of five pixels take little more than one at
// one, and are as much like the truth (docs/scene/seam.md); so are sixteen at three and four at two.
constexpr std::array<Step, 6> steps{{{2.8f, 1, 3.f, 6.f, 4.f, 4.f, 2, 1.3, .2f},
                                     {2.f, 1, 3.f, 6.f, 4.f, 4.f, 2, 1.3, .2f},
                                     {1.4f, 1, 3.f, 6.f, 4.f, 4.f, 2, 1.3, .16f},
                                     {1.f, 1, 1.f, 6.f, 4.f, 1.f, 1, 1.4, .12f},
                                     {1.f, 4, .5f, 5.f, 4.f, 2.f, 1, 1.3, .06f},
                                     {1.f, 16, .5f, 3.f, 1.f, 1.f, 1, 1., 0.f}}};

/// How many times longer a picture takes with a finer error, roughly: what does not depend on it is a part of its time.
double finer(float error, float to) { return std::sqrt(double(error) / double(to)); }

}  // namespace

float Budget::pixel() const { return steps[step_].pixel; }
std::uint32_t Budget::samples() const { return steps[step_].samples; }
float Budget::thinnest() const {
  return samples() == 1 ? error_ : std::max(.15f * error_, .25f * (error_ - 1.f));
}
std::uint32_t Budget::turns() const { return steps[step_].turns; }
float Budget::softness() const { return steps[step_].softness; }

Budget Budget::standing() {
  Budget budget(80.);
  budget.go_to(steps.size() - 1, 1.f);
  return budget;
}

// Of the last pictures that were drawn so.
double Budget::median(std::size_t last) const {
  auto times = times_;
  last = std::min(last, drawn_);
  const auto middle = times.begin() + std::ptrdiff_t(last / 2);
  std::nth_element(times.begin(), middle, times.begin() + std::ptrdiff_t(last));
  return *middle;
}

void Budget::go_to(std::size_t step, float error) {
  if (step == step_ && std::abs(error / error_ - 1.f) < .05f) return;
  step_ = step, error_ = error, drawn_ = 0;
}

// As the table has it, or as it was found.
double Budget::longer(std::size_t step) const { return std::max(longer_[step], steps[step].longer); }

// The highest step that there is time for, and the share of it that its first picture will take, where one of the present step at
// its finest takes that share.
std::pair<std::size_t, double> Budget::upwards(double share) const {
  std::pair to(step_, share);
  for (std::size_t i = step_; i < longer_.size(); ++i) {
    share *= longer(i);
    if (share < 1.) to = {i + 1, share};
    share *= finer(steps[i + 1].from_below, steps[i + 1].finest);
  }
  return to;
}

void Budget::took(double milliseconds, std::uint64_t segments) {
  // Of the last pictures five tell that much is wrong, and nine that a little is. What cannot be afforded is left at once. What is gone
  // back to too early is seen twice, so there must have been time for it for half a second, at sixty pictures a second; what a
  // step was found to take is forgotten in a minute.
  constexpr std::size_t least = 3, some = 5;
  constexpr double too_long = 1.15, much_too_long = 1.4, quick = .85;  // shares of the time there is
  constexpr double patience = 840., most_longer = 3., fading = .9995;
  constexpr std::uint64_t few = 40'000;  // two cores draw them in three milliseconds
  for (double& longer : longer_) longer *= fading;
  std::shift_right(times_.begin(), times_.end(), 1);
  times_[0] = milliseconds;
  if (++drawn_ < least) return;
  const Step& now = steps[step_];
  const double lately = median(some) / milliseconds_, at_finest = lately * finer(error_, now.finest);
  if (const auto expected = std::exchange(expected_, {}))
    longer_[step_ - 1] = std::min(longer(step_ - 1) * lately / *expected, most_longer);

  const bool of_few = samples() == 1 && 2 * segments < few;
  calm_ = of_few || lately < quick ? calm_ + milliseconds_ : 0.;
  if (calm_ > 0.) {
    if (calm_ < patience) return;
    if (error_ > now.finest)
      return go_to(step_, std::max(now.finest, error_ * float(of_few ? .25 : std::max(lately, .25))));
    const auto [above, expected] =
        of_few && step_ < plain_step ? std::pair(plain_step, lately) : upwards(at_finest);
    if (above > step_) go_to(above, steps[above].from_below), expected_ = expected;
    return;
  }

  const double by_all = drawn_ < times_.size() ? 1. : median(times_.size()) / milliseconds_,
               share = lately > much_too_long ? lately : by_all;
  if (share <= too_long) return;
  const float fitting = error_ * float(share),
              room = error_ * std::max(1.f, float(segments) / float(few)),  // until there are few
      coarsest = std::min(now.coarsest, room);
  if (step_ == 0 || fitting <= 1.1f * coarsest || (samples() == 1 && room < now.coarsest))
    return go_to(step_, std::min(fitting, coarsest));
  const Step& below = steps[step_ - 1];
  go_to(step_ - 1, std::min(below.from_above, std::max(below.finest, room)));
}

}  // namespace forest::scene
