// SPDX-License-Identifier: Apache-2.0
#include "forest/scene/seen.h"

#include <cmath>

#include "forest/core/clones.h"

namespace forest::scene {
namespace {

// A camera as plain numbers: rows of the turn, then the eye.
struct Turn {
  float m[9], eye[3], near, converge,
      parallel;  // what a length is divided by to be seen: converge z + parallel
};

FOREST_CLONES void see(const Turn& turn, const Spheres& spheres, SeenTogether& __restrict seen) {
  const auto [m00, m01, m02, m10, m11, m12, m20, m21, m22] = turn.m;
  const auto [eye_x, eye_y, eye_z] = turn.eye;
  const float near = turn.near, converge = turn.converge, parallel = turn.parallel;
  std::uint32_t known[Spheres::most];
  FOREST_LANES
  for (std::size_t i = 0; i < Spheres::most; ++i) {
    const float dx = spheres.x[i] - eye_x, dy = spheres.y[i] - eye_y, dz = spheres.z[i] - eye_z;
    const float x = m00 * dx + m01 * dy + m02 * dz, y = m10 * dx + m11 * dy + m12 * dz,
                z = m20 * dx + m21 * dy + m22 * dz, radius = spheres.radius[i], nearest = z - radius;
    const float scale = 1.f / (converge * z + parallel);
    const float spread =
        converge * std::sqrt(x * x + y * y + z * z) / (converge * nearest + parallel) + parallel;
    seen.x[i] = x, seen.y[i] = y, seen.z[i] = z, seen.radius[i] = radius, seen.nearest[i] = nearest;
    seen.place_x[i] = x * scale, seen.place_y[i] = -y * scale;
    seen.reach[i] = scale * radius * spread;
    known[i] = nearest > near;
  }
  std::uint32_t all = 0;
  for (std::size_t i = 0; i < Spheres::most; ++i) all |= known[i] << i;
  seen.known = all;
}

}  // namespace

void Viewer::operator()(const Spheres& spheres, SeenTogether& seen) const {
  Turn turn;
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 3; ++column) turn.m[3 * row + column] = to_camera_(row, column);
    turn.eye[row] = eye_[row];
  }
  turn.near = near_, turn.converge = orthographic_ ? 0.f : 1.f, turn.parallel = orthographic_ ? 1.f : 0.f;
  see(turn, spheres, seen);
  seen.orthographic = orthographic_;
}

}  // namespace forest::scene
