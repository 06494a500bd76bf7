// SPDX-License-Identifier: Apache-2.0
#include "apps/studio/camera_control.h"

#include <algorithm>
#include <cmath>

namespace forest::studio {
namespace {

// From directions where y is up to directions where the camera's `up` is. Between directions that are nearly opposite
// FromTwoVectors is not of unit length to the last digits.
Quat upright(const frame::Camera& camera) {
  return camera.up.squaredNorm() > 0.f ? Quat::FromTwoVectors(Vec3::UnitY(), camera.up).normalized()
                                       : Quat::Identity();
}

Vec3 direction(const frame::Camera& camera, const Bearing& b) {
  const float azimuth = radians(b.azimuth), elevation = radians(b.elevation);
  return upright(camera) * Vec3(std::cos(elevation) * std::sin(azimuth), std::sin(elevation),
                                -std::cos(elevation) * std::cos(azimuth));
}

Bearing turned(Bearing b, float azimuth, float elevation) {
  b.azimuth = std::remainder(b.azimuth + azimuth, 360.f);
  b.elevation = std::clamp(b.elevation + elevation, -steepest, steepest);
  return b;
}

// Nearer than this the eye and its target could not be told apart in single precision.
float clamped(const frame::Camera& camera, float distance) {
  return std::clamp(distance, std::max(shortest, 1e-5f * camera.target.cwiseAbs().maxCoeff()), longest);
}

// µm that a pixel covers at the target's depth.
float micrometres_a_pixel(const frame::Camera& camera, const frame::Viewport& viewport) {
  return camera.pixel_size(viewport.height, (camera.eye - camera.target).norm());
}

}  // namespace

Bearing bearing(const frame::Camera& camera) {
  const Vec3 way = camera.target - camera.eye;
  const Vec3 d = upright(camera).conjugate() * way.stableNormalized();
  return {degrees(std::atan2(d.x(), -d.z())), degrees(std::asin(std::clamp(d.y(), -1.f, 1.f))), way.norm()};
}

frame::Camera looking(frame::Camera camera, Bearing b) {
  camera.target = camera.eye + clamped(camera, b.distance) * direction(camera, b);
  return camera;
}

frame::Camera around_target(frame::Camera camera, Bearing b) {
  camera.eye = camera.target - clamped(camera, b.distance) * direction(camera, b);
  return camera;
}

frame::Camera orbit(const frame::Camera& camera, const Vec2& pixels) {
  const Vec2 angle = degrees_a_pixel * pixels;
  return around_target(camera, turned(bearing(camera), angle.x(), -angle.y()));
}

frame::Camera look(const frame::Camera& camera, const Vec2& pixels) {
  const Vec2 angle = .5f * degrees_a_pixel * pixels;
  return looking(camera, turned(bearing(camera), angle.x(), -angle.y()));
}

frame::Camera pan(const frame::Camera& camera, const frame::Viewport& viewport, const Vec2& pixels) {
  const Vec2 way = -micrometres_a_pixel(camera, viewport) * pixels;
  return fly(camera, {way.x(), -way.y(), 0.f});
}

frame::Camera dolly(const frame::Camera& camera, const frame::Viewport& viewport, const Vec2& pixel,
                    float factor) {
  const Bearing b = bearing(camera);
  const float distance = clamped(camera, b.distance * factor);
  const Vec2 off =
      (pixel - .5f * Vec2(viewport.width, viewport.height)) * micrometres_a_pixel(camera, viewport);
  const float share = 1.f - distance / b.distance;  // of the way to the point under the pixel
  const float ahead = factor < 1.f ? std::max(0.f, distance - b.distance * factor) : 0.f;
  frame::Camera moved = fly(camera, {share * off.x(), -share * off.y(), ahead});
  moved.eye += (b.distance - distance) * (moved.target - moved.eye).stableNormalized();
  return moved;
}

frame::Camera focused(frame::Camera camera, float depth) {
  if (camera.orthographic() || !(depth > 0.f)) return camera;
  camera.target = camera.eye + clamped(camera, depth) * (camera.target - camera.eye).stableNormalized();
  return camera;
}

frame::Camera fly(const frame::Camera& camera, const Vec3& way) {
  const Vec3 step = camera.axes() * Vec3(way.x(), way.y(), -way.z());
  frame::Camera moved = camera;
  moved.eye += step;
  moved.target += step;
  return moved;
}

frame::Camera centred_on(const frame::Camera& camera, const Sphere& sphere) {
  frame::Camera moved = camera;
  Bearing b = bearing(camera);
  b.distance = std::max(sphere.radius, 4.f) / std::sin(.5f * radians(camera.field_of_view));
  moved.eye += sphere.centre - moved.target;
  moved.target = sphere.centre;
  return around_target(moved, b);
}

}  // namespace forest::studio
