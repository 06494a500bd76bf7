// SPDX-License-Identifier: Apache-2.0
// A plane in the world with axes of its own, so that what it cuts can be drawn.
#pragma once

#include "forest/core/vec.h"

namespace forest {

/// A point on a plane, along its right and up (µm); double, since a branch of .1 µm lies a thousand µm from the origin.
using Place = Eigen::Vector2d;

/// Seen from where the normal points to: right and up are those of a sheet of paper that lies in the plane.
struct Plane {
  Vec3 origin = Vec3::Zero();
  Vec3 normal = Vec3::UnitZ(), right = Vec3::UnitX(), up = Vec3::UnitY();  // orthonormal, right-handed

  /// Up is as near to the pia as the plane allows, and -z in a plane across y where that lies.
  /// @param normal  of any length but zero
  /// @param pia     towards it, likewise
  static Plane through(const Vec3& origin, const Vec3& normal, const Vec3& pia = Vec3::UnitY()) {
    Plane plane{.origin = origin, .normal = normal.stableNormalized()};
    const Vec3 beside = pia == Vec3::UnitY() ? Vec3(0.f, 0.f, -1.f) : pia.unitOrthogonal();
    const Vec3 wish = std::abs(plane.normal.dot(pia.normalized())) > .9999f ? beside : pia;
    plane.right = wish.cross(plane.normal).normalized();
    plane.up = plane.normal.cross(plane.right);
    return plane;
  }
  /// The plane moved along its normal, µm.
  Plane moved(float distance) const {
    Plane plane = *this;
    plane.origin += distance * normal;
    return plane;
  }

  /// µm; positive on the side seen.
  float height(const Vec3& point) const { return normal.dot(point - origin); }
  Vec2 place(const Vec3& point) const { return {right.dot(point - origin), up.dot(point - origin)}; }
  Vec3 point(const Vec2& place) const { return origin + place.x() * right + place.y() * up; }
};

}  // namespace forest
