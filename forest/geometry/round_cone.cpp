// SPDX-License-Identifier: Apache-2.0
#include "forest/geometry/round_cone.h"

#include <algorithm>
#include <cmath>

namespace forest {
namespace {

template <class S>
using Vector = Eigen::Matrix<S, 3, 1>;

template <class S>
std::optional<S> enter_sphere(const RayOf<S>& ray, const Vector<S>& centre, S radius) {
  const Vector<S> to = ray.origin - centre;
  const S b = to.dot(ray.direction);
  const Vector<S> closest = to - b * ray.direction;
  const S h = radius * radius - closest.squaredNorm();
  if (h < 0) return {};
  const S t = -b - std::sqrt(h);
  return t >= 0 ? std::optional(t) : std::nullopt;
}

template <class S>
S distance(const Vector<S>& point, const RoundConeOf<S>& cone) {
  const Vector<S> axis = cone.b - cone.a;
  const S length = axis.norm(), taper = cone.radius_a - cone.radius_b;
  if (length <= std::abs(taper))
    return std::min((point - cone.a).norm() - cone.radius_a, (point - cone.b).norm() - cone.radius_b);
  const Vector<S> u = axis / length, to = point - cone.a;
  const S s = taper / length, c = std::sqrt(1 - s * s);
  const S y = to.dot(u), rho = (to - y * u).norm();
  const S along = c * y - s * rho;  // position along the slanted side, measured from the touching circle of a
  if (along <= 0) return to.norm() - cone.radius_a;
  if (along >= c * length) return (point - cone.b).norm() - cone.radius_b;
  return c * rho + s * y - cone.radius_a;
}

template <class S>
std::optional<S> enter(const RayOf<S>& ray, const RoundConeOf<S>& cone) {
  if (distance<S>(ray.origin, cone) < 0) return {};  // what begins within leaves it only
  // The side touches both spheres along circles; between them it is a cone with sine of half angle s = (ra -
  // rb) / l.
  const Vector<S> axis = cone.b - cone.a;
  const S length = axis.norm(), taper = cone.radius_a - cone.radius_b;
  const bool nested = length <= std::abs(taper);
  if (nested)
    return cone.radius_a >= cone.radius_b ? enter_sphere(ray, cone.a, cone.radius_a)
                                          : enter_sphere(ray, cone.b, cone.radius_b);

  const Vector<S> u = axis / length;
  const S s = taper / length, c2 = 1 - s * s;
  // A point p with y = (p - a)·u lies on the infinite cone when |p - a|² - y² = ((ra - s y) ... )² scaled by
  // c: radial distance ρ = (ra - s y) / c, with c = sqrt(c2).
  const Vector<S> start = ray.origin - cone.a;
  const S shift = -start.dot(ray.direction);  // work near the closest approach, for precision far away
  const Vector<S> o = start + shift * ray.direction;
  const S oy = o.dot(u), dy = ray.direction.dot(u);
  const S k0 = cone.radius_a - s * oy, k1 = -s * dy;
  const S A = c2 * (1 - dy * dy) - k1 * k1;
  const S B = c2 * (o.dot(ray.direction) - oy * dy) - k0 * k1;
  const S C = c2 * (o.squaredNorm() - oy * oy) - k0 * k0;

  std::optional<S> best;
  const auto offer = [&](S t) {
    if (t >= 0 && (!best || t < *best)) best = t;
  };
  const S discriminant = B * B - A * C;
  if (std::abs(A) > S(1e-12) && discriminant >= 0) {
    // Of the two roots that at which the ray goes from outside to within, whichever comes first.
    const S local = (-B - std::sqrt(discriminant)) / A, y = oy + local * dy;
    // The lateral part lies between the touching circles at y = s·ra and y = l + s·rb.
    if (k0 + k1 * local >= 0 && y >= s * cone.radius_a && y <= length + s * cone.radius_b)
      offer(local + shift);
  }
  if (const auto t = enter_sphere(ray, cone.a, cone.radius_a)) offer(*t);
  if (const auto t = enter_sphere(ray, cone.b, cone.radius_b)) offer(*t);
  return best;
}

}  // namespace

std::optional<float> intersect(const Ray& ray, const RoundCone& cone) { return enter(ray, cone); }
std::optional<double> intersect(const Rayd& ray, const RoundConed& cone) { return enter(ray, cone); }

float signed_distance(const Vec3& point, const RoundCone& cone) { return distance<float>(point, cone); }

}  // namespace forest
