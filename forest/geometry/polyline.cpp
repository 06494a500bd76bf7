// SPDX-License-Identifier: Apache-2.0
#include "forest/geometry/polyline.h"

#include <algorithm>
#include <cmath>

namespace forest {
namespace {

// Position of the closest point on a–b, from 0 at a to 1 at b.
float closest_fraction(const Vec3& point, const Vec3& a, const Vec3& b) {
  const Vec3 ab = b - a;
  const float squared = ab.squaredNorm();
  return squared > 0.f ? std::clamp((point - a).dot(ab) / squared, 0.f, 1.f) : 0.f;
}

float deviation(const Vec4& v, const Vec4& a, const Vec4& b) {
  const float t = closest_fraction(v.head<3>(), a.head<3>(), b.head<3>());
  const Vec4 d = v - (a + t * (b - a));
  return std::max(d.head<3>().norm(), std::abs(d.w()));
}

}  // namespace

float distance_to_segment(const Vec3& point, const Vec3& a, const Vec3& b) {
  return (point - (a + closest_fraction(point, a, b) * (b - a))).norm();
}

std::vector<std::uint32_t> simplify(std::span<const Vec4> vertices, float tolerance) {
  const std::size_t count = vertices.size();
  std::vector<std::uint32_t> kept;
  if (count == 0) return kept;
  std::vector<bool> keep(count, false);
  keep.front() = keep.back() = true;
  std::vector<std::pair<std::size_t, std::size_t>> open{{0, count - 1}};
  while (!open.empty()) {
    const auto [first, last] = open.back();
    open.pop_back();
    float worst = tolerance;
    std::size_t split = 0;
    for (std::size_t i = first + 1; i < last; ++i)
      if (const float d = deviation(vertices[i], vertices[first], vertices[last]); d > worst)
        worst = d, split = i;
    if (!split) continue;
    keep[split] = true;
    open.emplace_back(first, split);
    open.emplace_back(split, last);
  }
  for (std::size_t i = 0; i < count; ++i)
    if (keep[i]) kept.push_back(std::uint32_t(i));
  return kept;
}

}  // namespace forest
