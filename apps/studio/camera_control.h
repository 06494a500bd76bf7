// SPDX-License-Identifier: Apache-2.0
// How a hand moves the eye: orbit, pan and dolly about a target, look around, fly. Pure functions of a camera; no window
// and no clock in here, the viewport hands over pixels and micrometres.
#pragma once

#include "forest/frame/camera.h"

namespace forest::studio {

/// The direction of view in a person's terms. For up = y: azimuth 0° looks towards -z, 90° towards +x; elevation 90°
/// looks straight up.
struct Bearing {
  float azimuth = 0.f;    // degrees, in (-180, 180]
  float elevation = 0.f;  // degrees, in [-steepest, steepest] once a hand has moved it
  float distance = 1.f;   // from the eye to the target, µm
};

inline constexpr float steepest = 89.f;        // degrees; beyond it left and right would change places
inline constexpr float shortest = .5f;         // the eye comes no nearer to its target than this, µm
inline constexpr float longest = 1e6f;         // … and goes no farther away, µm
inline constexpr float degrees_a_pixel = .3f;  // of a dragged mouse

Bearing bearing(const frame::Camera& camera);

/// The same eye, looking along `bearing`.
frame::Camera looking(frame::Camera camera, Bearing bearing);
/// The same target, looked at along `bearing`.
frame::Camera around_target(frame::Camera camera, Bearing bearing);

/// The eye on a sphere about the target; what is seen follows the mouse, dragged by `pixels` (x right, y down).
frame::Camera orbit(const frame::Camera& camera, const Vec2& pixels);
/// The eye stays and turns towards where the mouse went.
frame::Camera look(const frame::Camera& camera, const Vec2& pixels);
/// Eye and target move together: what lies at the target's depth stays under the mouse.
frame::Camera pan(const frame::Camera& camera, const frame::Viewport& viewport, const Vec2& pixels);
/// The eye's distance from its target is multiplied by `factor`; what lies at the target's depth under `pixel` stays
/// there. At the shortest distance the target moves on ahead, so that one never gets stuck.
frame::Camera dolly(const frame::Camera& camera, const frame::Viewport& viewport, const Vec2& pixel,
                    float factor);
/// The same picture with its target straight ahead at `depth`, where something is: what follows orbits and approaches that.
/// Of parallel rays the target gives the size of all, and stays.
frame::Camera focused(frame::Camera camera, float depth);
/// Eye and target move by `way` µm to the right, up and forward as the eye sees them.
frame::Camera fly(const frame::Camera& camera, const Vec3& way);
/// The same direction of view, from where the sphere fills the height of the picture.
frame::Camera centred_on(const frame::Camera& camera, const Sphere& sphere);

}  // namespace forest::studio
