// SPDX-License-Identifier: Apache-2.0
#include "forest/geometry/polyline.h"

#include <algorithm>

namespace forest {

float distance_to_segment(const Vec3& point, const Vec3& a, const Vec3& b) {
  const Vec3 ab = b - a;
  const float squared = ab.squaredNorm();
  const float along = squared > 0.f ? std::clamp((point - a).dot(ab) / squared, 0.f, 1.f) : 0.f;
  return (point - (a + along * ab)).norm();
}

}  // namespace forest
