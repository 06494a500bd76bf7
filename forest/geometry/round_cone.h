// SPDX-License-Identifier: Apache-2.0
// The tapered capsule: the hull of two spheres. It is what a segment of a neurite looks like.
#pragma once

#include <optional>

#include "forest/core/vec.h"

namespace forest {

template <class Scalar>
struct RoundConeOf {
  Eigen::Matrix<Scalar, 3, 1> a, b;  // centres of the two end spheres, µm
  Scalar radius_a, radius_b;         // µm, >= 0
};
using RoundCone = RoundConeOf<float>;
using RoundConed = RoundConeOf<double>;

template <class Scalar>
struct RayOf {
  Eigen::Matrix<Scalar, 3, 1> origin;
  Eigen::Matrix<Scalar, 3, 1> direction;  // unit length
};
using Ray = RayOf<float>;
using Rayd = RayOf<double>;

/// Distance along the ray to where it enters the cone from outside; none when it misses or the cone lies
/// behind. After the derivation in Quilez, "Round cone intersection" (iquilezles.org/articles/intersectors),
/// written anew.
std::optional<float> intersect(const Ray& ray, const RoundCone& cone);
std::optional<double> intersect(const Rayd& ray, const RoundConed& cone);

/// Signed distance from a point to the surface, negative inside.
float signed_distance(const Vec3& point, const RoundCone& cone);

}  // namespace forest
