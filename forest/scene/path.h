// SPDX-License-Identifier: Apache-2.0
// How the camera moves: through key views on a smooth curve, slow in and slow out.
#pragma once

#include <vector>

#include "forest/scene/view.h"

namespace forest::scene {

/// A curve through views (centripetal Catmull–Rom for the eye, the direction of view turned evenly). Turns and zooms on the spot
/// take as long as if the eye went as far as what it looks at seems to.
class CameraPath {
 public:
  /// At least one view; throws Error otherwise.
  explicit CameraPath(std::vector<View> keys);
  /// The view at time t in [0, 1]: at one speed, slow at both ends.
  View at(float t) const;

 private:
  std::vector<View> keys_;
  std::vector<float> knots_;  // of each key, in [0, 1]
};

/// The demo's walk: from outside the column to a clear place inside, between the dendrites, never through a soma.
/// Around traced neurons side by side (gallery.h).
/// @param states  of its instances: around and into those that are seen
/// @param aspect  width of the pictures over their height
CameraPath walk(const Forest& forest, std::span<const frame::State> states = {}, float aspect = 16.f / 9.f);

/// From outside the column straight to one soma near its middle, until it fills half the height: what `bench seam` walks.
/// In equal times the distance to it shrinks by equal shares, slow at both ends, so that it grows evenly.
class Dolly {
 public:
  /// Of the somata near the middle, towards the one whose way is clearest of others.
  explicit Dolly(const Forest& forest);
  View at(float time) const;  // time from 0 to 1

 private:
  View start_, end_;
};

/// Distance from a point to the nearest soma's surface, µm; infinite when there is none.
float soma_clearance(const Forest& forest, const Vec3& point);

}  // namespace forest::scene
