// SPDX-License-Identifier: Apache-2.0
// The tapered capsule: the hull of two spheres. It is what a segment of a neurite looks like.
#pragma once

#include <optional>

#include "forest/core/vec.h"

namespace forest {

struct RoundCone {
  Vec3 a, b;                 // centres of the two end spheres, µm
  float radius_a, radius_b;  // µm, >= 0
};

struct Ray {
  Vec3 origin;
  Vec3 direction;  // unit length
};

/// Distance along the ray to where it enters the cone from outside; none when it misses or the cone lies
/// behind. After the derivation in Quilez, "Round cone intersection" (iquilezles.org/articles/intersectors),
/// written anew.
std::optional<float> intersect(const Ray& ray, const RoundCone& cone);

/// Signed distance from a point to the surface, negative inside.
float signed_distance(const Vec3& point, const RoundCone& cone);

}  // namespace forest
