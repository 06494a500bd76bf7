// SPDX-License-Identifier: Apache-2.0
#include "forest/scene/group.h"

#include <algorithm>
#include <cmath>

namespace forest::scene {

std::uint32_t packed_group(const Sphere& group, const Sphere& larger) {
  const float unit = std::max(larger.radius, 1e-6f) / 127.f;
  std::uint32_t bits = 0;
  Vec3 centre;
  for (int i = 0; i < 3; ++i) {
    const float steps = std::clamp(std::round((group.centre[i] - larger.centre[i]) / unit), -127.f, 127.f);
    bits |= (std::uint32_t(int(steps)) & 255u) << (8 * i);
    centre[i] = larger.centre[i] + steps * unit;
  }
  const float radius = group.radius + (group.centre - centre).norm();
  return bits | std::uint32_t(std::clamp(std::ceil(radius * 1.0001f / unit), 0.f, 255.f)) << 24;
}

}  // namespace forest::scene
