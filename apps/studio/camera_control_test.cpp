// SPDX-License-Identifier: Apache-2.0
#include "apps/studio/camera_control.h"

#include <cmath>

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include "forest/core/random.h"

namespace forest::studio {
namespace {

const frame::Viewport viewport{1280, 720};

float any(Random& random, double low, double high) { return float(random.uniform(low, high)); }
Vec3 any_point(Random& random, double reach) {
  return {any(random, -reach, reach), any(random, -reach, reach), any(random, -reach, reach)};
}
// A camera that a hand may have left anywhere, with any direction up.
frame::Camera any_camera(Random& random) {
  frame::Camera camera;
  camera.target = any_point(random, 500.);
  camera.up = any_point(random, 1.).stableNormalized();
  camera.field_of_view = any(random, 10., 100.);
  return around_target(camera, {any(random, -180., 180.), any(random, -85., 85.), any(random, 5., 2000.)});
}
Vec2 any_pixel(Random& random) { return {any(random, 0., 1280.), any(random, 0., 720.)}; }
// The point at the target's depth that is seen at `pixel`.
Vec3 under(const frame::Camera& camera, const Vec2& pixel) {
  const Ray ray = ray_through(camera, viewport, pixel);
  const Vec3 forward = (camera.target - camera.eye).normalized();
  return camera.eye + ray.direction * ((camera.target - camera.eye).norm() / ray.direction.dot(forward));
}
Vec2 seen_at(const frame::Camera& camera, const Vec3& point) {
  return project(camera, viewport, point).head<2>();
}

#define LAW(name) RC_GTEST_PROP(CameraControl, name, (std::uint64_t seed))

LAW(BearingIsWhatTheCameraWasTurnedTo) {
  Random random(seed);
  const frame::Camera camera = any_camera(random);
  const Bearing wanted{any(random, -180., 180.), any(random, -88., 88.), any(random, 1., 3000.)};
  for (const frame::Camera& moved : {looking(camera, wanted), around_target(camera, wanted)}) {
    const Bearing b = bearing(moved);
    RC_ASSERT(std::abs(std::remainder(b.azimuth - wanted.azimuth, 360.f)) < .1f);
    RC_ASSERT(std::abs(b.elevation - wanted.elevation) < .05f);
    RC_ASSERT(std::abs(b.distance - wanted.distance) < 1e-3f * wanted.distance + 1e-3f);
  }
}

LAW(OrbitKeepsTargetAndDistance) {
  Random random(seed);
  const frame::Camera camera = any_camera(random);
  const frame::Camera moved = orbit(camera, {any(random, -400., 400.), any(random, -400., 400.)});
  RC_ASSERT(moved.target == camera.target);
  const float before = (camera.eye - camera.target).norm(), after = (moved.eye - moved.target).norm();
  RC_ASSERT(std::abs(after - before) < 1e-4f * before);
}

LAW(OrbitFollowsTheMouseAndGoesBack) {
  Random random(seed);
  frame::Camera camera = any_camera(random);
  camera = around_target(camera, {0.f, any(random, -40., 40.), 100.f});
  // What lies before the target, towards the eye, goes where the mouse goes.
  const Vec3 front = camera.target + .2f * (camera.eye - camera.target);
  RC_ASSERT(seen_at(orbit(camera, {20, 0}), front).x() > seen_at(camera, front).x());
  RC_ASSERT(seen_at(orbit(camera, {0, 20}), front).y() > seen_at(camera, front).y());
  const frame::Camera back = orbit(orbit(camera, {30, -20}), {-30, 20});
  RC_ASSERT((back.eye - camera.eye).norm() < .05f);
}

LAW(LookKeepsTheEyeAndTurnsToTheMouse) {
  Random random(seed);
  frame::Camera camera = any_camera(random);
  camera = looking(camera, {0.f, any(random, -40., 40.), 100.f});
  const frame::Camera right = look(camera, {30, 0}), down = look(camera, {0, 30});
  RC_ASSERT(right.eye == camera.eye);
  RC_ASSERT(seen_at(right, camera.target).x() < .5f * viewport.width);
  RC_ASSERT(seen_at(down, camera.target).y() < .5f * viewport.height);
}

LAW(PanMovesTheTargetWithTheMouse) {
  Random random(seed);
  const frame::Camera camera = any_camera(random);
  const Vec2 pixels(any(random, -300., 300.), any(random, -300., 300.));
  const frame::Camera moved = pan(camera, viewport, pixels);
  RC_ASSERT((seen_at(moved, camera.target) - seen_at(camera, camera.target) - pixels).norm() < .5f);
  RC_ASSERT(((moved.eye - moved.target) - (camera.eye - camera.target)).norm() <
            1e-3f * (camera.eye - camera.target).norm());
}

LAW(DollyKeepsWhatIsUnderTheMouse) {
  Random random(seed);
  const frame::Camera camera = any_camera(random);
  const Vec2 pixel = any_pixel(random);
  const float factor = any(random, .7, 1.4);
  const frame::Camera moved = dolly(camera, viewport, pixel, factor);
  RC_ASSERT((seen_at(moved, under(camera, pixel)) - pixel).norm() < .5f);
  const float before = (camera.eye - camera.target).norm(), after = (moved.eye - moved.target).norm();
  RC_ASSERT(std::abs(after - factor * before) < 2e-3f * before);
}

LAW(DollyNeverGetsStuck) {
  Random random(seed);
  frame::Camera camera = any_camera(random);
  for (int i = 0; i < 100; ++i) camera = dolly(camera, viewport, {640, 360}, .8f);
  const frame::Camera next = dolly(camera, viewport, {640, 360}, .8f);
  const Vec3 forward = (camera.target - camera.eye).normalized();
  RC_ASSERT((next.eye - camera.eye).dot(forward) > .05f);
  RC_ASSERT((next.target - next.eye).norm() > .9f * shortest);
}

LAW(StepsTowardsAThingShrinkAndItStaysUnderTheMouse) {
  Random random(seed);
  frame::Camera camera = any_camera(random);
  const Vec2 pixel = any_pixel(random);
  const Vec3 forward = (camera.target - camera.eye).normalized();
  const Ray ray = ray_through(camera, viewport, pixel);
  const float depth = any(random, 5., 4000.);  // nearer than the target, or beyond
  const Vec3 thing = camera.eye + ray.direction * (depth / ray.direction.dot(forward));
  const float far = (thing - camera.eye).norm();
  float way = INFINITY;
  for (int i = 1; i <= 8; ++i) {
    const frame::Camera next =
        dolly(focused(camera, (thing - camera.eye).dot(forward)), viewport, pixel, .85f);
    const float step = (next.eye - camera.eye).norm();
    RC_ASSERT(step < way);
    way = step, camera = next;
    RC_ASSERT((seen_at(camera, thing) - pixel).norm() < 1.f);
  }
  RC_ASSERT(std::abs((thing - camera.eye).norm() / (std::pow(.85f, 8.f) * far) - 1.f) < .02f);
}

LAW(FocusingMovesNothingInThePicture) {
  Random random(seed);
  frame::Camera camera = any_camera(random);
  const frame::Camera moved = focused(camera, any(random, 1., 3000.));
  RC_ASSERT(moved.eye == camera.eye);
  RC_ASSERT((moved.axes() - camera.axes()).norm() < 1e-3f);
  camera.projection = frame::Projection::orthographic;
  RC_ASSERT(focused(camera, 10.f).target == camera.target);
}

LAW(FlyingIsTheSameInOneStepOrTwo) {
  Random random(seed);
  const frame::Camera camera = any_camera(random);
  const Vec3 way = any_point(random, 100.);
  const frame::Camera once = fly(camera, 2.f * way), twice = fly(fly(camera, way), way);
  RC_ASSERT((once.eye - twice.eye).norm() < .02f);
  RC_ASSERT(std::abs((once.eye - camera.eye).norm() - 2.f * way.norm()) < .02f);
}

LAW(CentredOnASphereSeesAllOfItInTheMiddle) {
  Random random(seed);
  const frame::Camera camera = any_camera(random);
  const Sphere sphere{any_point(random, 800.), any(random, 5., 300.)};
  const frame::Camera moved = centred_on(camera, sphere);
  RC_ASSERT((seen_at(moved, sphere.centre) - Vec2(640, 360)).norm() < .5f);
  const Mat3 axes = moved.axes();
  for (const float side : {-.99f, .99f}) {
    const float y = seen_at(moved, sphere.centre + side * sphere.radius * axes.col(1)).y();
    RC_ASSERT(y > 0.f);
    RC_ASSERT(y < viewport.height);
  }
  const Bearing before = bearing(camera), after = bearing(moved);
  RC_ASSERT(std::abs(before.elevation - after.elevation) < .1f);
}

LAW(NoHandBreaksTheCamera) {
  Random random(seed);
  frame::Camera camera = any_camera(random);
  for (int i = 0; i < 300; ++i) {
    const Vec2 drag(any(random, -2000., 2000.), any(random, -2000., 2000.));
    switch (random.below(5)) {
      case 0:
        camera = orbit(camera, drag);
        break;
      case 1:
        camera = look(camera, drag);
        break;
      case 2:
        camera = pan(camera, viewport, drag);
        break;
      case 3:
        camera = dolly(camera, viewport, any_pixel(random), any(random, .2, 5.));
        break;
      default:
        camera = fly(camera, any_point(random, 50.));
    }
    RC_ASSERT(camera.eye.allFinite() && camera.target.allFinite());
    RC_ASSERT((camera.eye - camera.target).norm() > .5f * shortest);
    // The horizon stays level: the eye's right is always square to up.
    RC_ASSERT(std::abs(camera.axes().col(0).dot(camera.up)) < 1e-3f);
    RC_ASSERT(camera.axes().col(1).dot(camera.up) > 0.f);
  }
}

}  // namespace
}  // namespace forest::studio
