// SPDX-License-Identifier: Apache-2.0
#include "forest/geometry/round_cone.h"

#include <algorithm>
#include <cmath>

namespace forest {
namespace {

std::optional<float> enter_sphere(const Ray& ray, const Vec3& centre, float radius) {
  const Vec3 to = ray.origin - centre;
  const float b = to.dot(ray.direction);
  const Vec3 closest = to - b * ray.direction;
  const float h = radius * radius - closest.squaredNorm();
  if (h < 0.f) return {};
  const float t = -b - std::sqrt(h);
  return t >= 0.f ? std::optional(t) : std::nullopt;
}

}  // namespace

std::optional<float> intersect(const Ray& ray, const RoundCone& cone) {
  // The side touches both spheres along circles; between them it is a cone with sine of half angle s = (ra -
  // rb) / l.
  const Vec3 axis = cone.b - cone.a;
  const float length = axis.norm(), taper = cone.radius_a - cone.radius_b;
  const bool nested = length <= std::abs(taper);
  if (nested)
    return cone.radius_a >= cone.radius_b ? enter_sphere(ray, cone.a, cone.radius_a)
                                          : enter_sphere(ray, cone.b, cone.radius_b);

  const Vec3 u = axis / length;
  const float s = taper / length, c2 = 1.f - s * s;
  // A point p with y = (p - a)·u lies on the infinite cone when |p - a|² - y² = ((ra - s y) ... )² scaled by
  // c: radial distance ρ = (ra - s y) / c, with c = sqrt(c2).
  const Vec3 start = ray.origin - cone.a;
  const float shift = -start.dot(ray.direction);  // work near the closest approach, for precision far away
  const Vec3 o = start + shift * ray.direction;
  const float oy = o.dot(u), dy = ray.direction.dot(u);
  const float k0 = cone.radius_a - s * oy, k1 = -s * dy;
  const float A = c2 * (1.f - dy * dy) - k1 * k1;
  const float B = c2 * (o.dot(ray.direction) - oy * dy) - k0 * k1;
  const float C = c2 * (o.squaredNorm() - oy * oy) - k0 * k0;

  std::optional<float> best;
  const auto offer = [&](float t) {
    if (t >= 0.f && (!best || t < *best)) best = t;
  };
  const float discriminant = B * B - A * C;
  if (std::abs(A) > 1e-12f && discriminant >= 0.f) {
    const float root = std::sqrt(discriminant);
    for (const float sign : {-1.f, 1.f}) {
      const float local = (-B + sign * root) / A, y = oy + local * dy;
      // The lateral part lies between the touching circles at y = s·ra and y = l + s·rb.
      if (k0 + k1 * local >= 0.f && y >= s * cone.radius_a && y <= length + s * cone.radius_b)
        offer(local + shift);
    }
  }
  if (const auto t = enter_sphere(ray, cone.a, cone.radius_a)) offer(*t);
  if (const auto t = enter_sphere(ray, cone.b, cone.radius_b)) offer(*t);
  return best;
}

float signed_distance(const Vec3& point, const RoundCone& cone) {
  const Vec3 axis = cone.b - cone.a;
  const float length = axis.norm(), taper = cone.radius_a - cone.radius_b;
  if (length <= std::abs(taper))
    return std::min((point - cone.a).norm() - cone.radius_a, (point - cone.b).norm() - cone.radius_b);
  const Vec3 u = axis / length, to = point - cone.a;
  const float s = taper / length, c = std::sqrt(1.f - s * s);
  const float y = to.dot(u), rho = (to - y * u).norm();
  const float along =
      c * y - s * rho;  // position along the slanted side, measured from the touching circle of a
  if (along <= 0.f) return to.norm() - cone.radius_a;
  if (along >= c * length) return (point - cone.b).norm() - cone.radius_b;
  return c * rho + s * y - cone.radius_a;
}

}  // namespace forest
