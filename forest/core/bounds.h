// SPDX-License-Identifier: Apache-2.0
// Axis-aligned boxes and spheres that enclose things.
#pragma once

#include <limits>

#include "forest/core/vec.h"

namespace forest {

/// An axis-aligned box; empty (low > high) until something is added.
struct Bounds {
  Vec3 low = Vec3::Constant(std::numeric_limits<float>::infinity());
  Vec3 high = Vec3::Constant(-std::numeric_limits<float>::infinity());

  bool empty() const { return low.x() > high.x(); }
  Vec3 centre() const { return 0.5f * (low + high); }
  Vec3 extent() const { return high - low; }

  void add(const Vec3& point, float radius = 0.f) {
    low = low.cwiseMin(point - Vec3::Constant(radius));
    high = high.cwiseMax(point + Vec3::Constant(radius));
  }
  void add(const Bounds& other) {
    low = low.cwiseMin(other.low);
    high = high.cwiseMax(other.high);
  }
};

struct Sphere {
  Vec3 centre = Vec3::Zero();
  float radius = 0.f;  // µm
};

}  // namespace forest
