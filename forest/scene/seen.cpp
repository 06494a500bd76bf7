// SPDX-License-Identifier: Apache-2.0
#include "forest/scene/seen.h"

#include <cmath>

#include "forest/core/clones.h"

namespace forest::scene {
namespace {

// The camera as Viewer has it; a length is divided by converge × depth + parallel to be seen.
FOREST_CLONES std::uint32_t see(const Mat3& turn, const Vec3& eye, float near, float converge, float parallel,
                                const Spheres& spheres, SeenTogether& __restrict seen) {
  const float m00 = turn(0, 0), m01 = turn(0, 1), m02 = turn(0, 2), m10 = turn(1, 0), m11 = turn(1, 1),
              m12 = turn(1, 2), m20 = turn(2, 0), m21 = turn(2, 1), m22 = turn(2, 2);
  const float eye_x = eye.x(), eye_y = eye.y(), eye_z = eye.z();
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
  return all;
}

}  // namespace

void Viewer::operator()(const Spheres& spheres, SeenTogether& seen) const {
  seen.known =
      see(to_camera_, eye_, near_, orthographic_ ? 0.f : 1.f, orthographic_ ? 1.f : 0.f, spheres, seen);
  seen.orthographic = orthographic_;
}

}  // namespace forest::scene
