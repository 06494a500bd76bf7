// SPDX-License-Identifier: Apache-2.0
// A tapered capsule as rays meet it, and where on the picture that may be.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "forest/render/cpu/canvas.h"
#include "forest/render/cpu/run.h"

namespace forest::render::cpu {

/// The hull of two spheres, or the larger of them alone.
struct Body {
  Vec3 a, b, u;  // ends; axis, unit or zero
  float ra, rb, length, s, c2, cosine;
  bool nested;  // one sphere lies within the other

  Body(const Vec3& from, const Vec3& to, float r_from, float r_to) : a(from), b(to), ra(r_from), rb(r_to) {
    const Vec3 axis = b - a;
    length = axis.norm();
    const float taper = ra - rb;
    nested = length <= std::abs(taper) + 1e-6f;
    u = nested ? Vec3(0, 0, 0) : Vec3(axis / length);
    s = nested ? 0.f : taper / length;
    c2 = 1.f - s * s;
    cosine = std::sqrt(c2);
  }
};

/// Where rays meet a capsule.
template <int lanes>
struct Hits {
  float code[lanes], shade[lanes];  // of its depth; 0–1
  std::uint32_t hit[lanes];         // 1 or 0
};

/// Every place of the picture (pixels) meets the capsule with its own ray: as draw_capsule in
/// render/opengl/shaders/capsule.glsl.
template <int lanes>
[[gnu::always_inline]] inline void meet(const frame::Constants& c, const Vec3& light, const Body& body,
                                        const float* x, const float* y, Hits<lanes>& hits) {
  const float ax = body.a.x(), ay = body.a.y(), az = body.a.z(), bx = body.b.x(), by = body.b.y(),
              bz = body.b.z(), ux = body.u.x(), uy = body.u.y(), uz = body.u.z(), lx = light.x(),
              ly = light.y(), lz = light.z();
  const float ra = body.ra, rb = body.rb, s = body.s, c2 = body.c2, cosine = body.cosine;
  const float begin = s * ra, end = body.length + s * rb;  // of the cone's surface, along the axis
  const float per_focal = 1.f / c.focal, near = c.near, converge = c.converge, parallel = c.parallel,
              centre_x = c.centre_x, centre_y = c.centre_y;
  const float per_ra = 1.f / larger(ra, 1e-9f), per_rb = 1.f / larger(rb, 1e-9f);
  const std::int32_t cone = body.nested ? 0 : 1;
  FOREST_LANES
  for (int lane = 0; lane < lanes; ++lane) {
    const float beside = (x[lane] - centre_x) * per_focal, above = (centre_y - y[lane]) * per_focal;
    const float slope_x = converge * beside, slope_y = converge * above;
    // From where the rays begin, which for an orthographic camera is beside the eye.
    const float sax = ax - parallel * beside, sbx = bx - parallel * beside, say = ay - parallel * above,
                sby = by - parallel * above;
    const float dz = 1.f / std::sqrt(slope_x * slope_x + slope_y * slope_y + 1.f), dx = slope_x * dz,
                dy = slope_y * dz;
    const float shift = sax * dx + say * dy + az * dz;
    const float ox = shift * dx - sax, oy = shift * dy - say, oz = shift * dz - az;
    const float o2 = ox * ox + oy * oy + oz * oz, ou = ox * ux + oy * uy + oz * uz,
                du = dx * ux + dy * uy + dz * uz;
    const float k0 = ra - s * ou, k1 = -s * du;
    const float A = c2 * (1.f - du * du) - k1 * k1, B = -c2 * ou * du - k0 * k1,
                C = c2 * (o2 - ou * ou) - k0 * k0, root = B * B - A * C;
    const float local = (-B - std::sqrt(larger(root, 0.f))) / larger(A, 1e-9f), along = ou + local * du;
    const float t_cone = local + shift;
    const bool on_cone =
        (cone != 0) & (root >= 0.f) & (A > 1e-9f) & (along >= begin) & (along <= end) & (t_cone > 0.f);
    const float wx = ox + local * dx - along * ux, wy = oy + local * dy - along * uy,
                wz = oz + local * dz - along * uz;
    const float facing_cone =
        cosine * (wx * lx + wy * ly + wz * lz) / std::sqrt(larger(wx * wx + wy * wy + wz * wz, 1e-30f)) +
        s * (ux * lx + uy * ly + uz * lz);
    // The spheres at its ends.
    const float shift_b = sbx * dx + sby * dy + bz * dz;
    const float qx = shift_b * dx - sbx, qy = shift_b * dy - sby, qz = shift_b * dz - bz;
    const float ha = ra * ra - o2, hb = rb * rb - (qx * qx + qy * qy + qz * qz);
    const float ta = shift - std::sqrt(larger(ha, 0.f)), tb = shift_b - std::sqrt(larger(hb, 0.f));
    const bool on_a = (ha >= 0.f) & (ta > 0.f), on_b = (hb >= 0.f) & (tb > 0.f);
    const bool take_b = on_b & (!on_a | (tb < ta));
    const float t_sphere = take_b ? tb : ta;
    const float facing_sphere =
        take_b ? ((tb * dx - sbx) * lx + (tb * dy - sby) * ly + (tb * dz - bz) * lz) * per_rb
               : ((ta * dx - sax) * lx + (ta * dy - say) * ly + (ta * dz - az) * lz) * per_ra;
    const bool within = (cone == 0) | (root >= 0.f);  // the cone, within which both spheres lie
    const bool hit = on_cone | (within & (on_a | on_b));
    const float t = on_cone ? t_cone : t_sphere, facing = on_cone ? facing_cone : facing_sphere;
    hits.code[lane] = depth_code(larger(t * dz, near));
    hits.shade[lane] = .5f + .5f * facing;
    hits.hit[lane] = hit ? 1u : 0u;
  }
}

/// Two discs of the picture and all between them: where a capsule is seen.
class Outline {
 public:
  /// @param exact  nothing reaches beyond the discs; else, as before the eye, a little does
  Outline(const Vec2& p, const Vec2& q, float rp, float rq, bool exact)
      : p_(p), q_(q), rp_(rp), rq_(rq), exact_(exact) {
    const Vec2 between = q - p;
    const float distance = between.norm(), sine = distance > 0.f ? (rp - rq) / distance : 2.f;
    if (std::abs(sine) >= 1.f) return;  // one lies within the other
    const Vec2 along = between / distance, beside(-along.y(), along.x());
    const float cosine = std::sqrt(1.f - sine * sine);
    for (const float side : {-1.f, 1.f}) {
      const Vec2 normal = sine * along + side * cosine * beside;
      tangents_[side > 0.f] = {p + rp * normal, q + rq * normal};
    }
    apart_ = true;
  }
  float top() const { return std::min(p_.y() - rp_, q_.y() - rq_); }
  float bottom() const { return std::max(p_.y() + rp_, q_.y() + rq_); }
  /// Which part of the way from p to q has discs that may reach a height; 0 to 1.
  std::pair<float, float> part(float y) const {
    const float rise = q_.y() - p_.y(), reach = std::max(rp_, rq_);
    if (std::abs(rise) <= 1e-3f) return {0.f, 1.f};
    const float from = (y - reach - p_.y()) / rise, to = (y + reach - p_.y()) / rise;
    return {std::clamp(std::min(from, to), 0.f, 1.f), std::clamp(std::max(from, to), 0.f, 1.f)};
  }
  /// From where to where it reaches at a height; empty (left > right) beside it.
  std::pair<float, float> across(float y) const {
    std::pair<float, float> range{INFINITY, -INFINITY};
    const auto add = [&](float left, float right) {
      range = {std::min(range.first, left), std::max(range.second, right)};
    };
    if (!exact_) {
      const auto [from, to] = part(y);
      for (const float t : {from, to}) {
        const float x = p_.x() + t * (q_.x() - p_.x()), w = std::max(rp_, rq_);
        add(x - w, x + w);
      }
      return range;
    }
    for (const auto& [centre, radius] : {std::pair(p_, rp_), std::pair(q_, rq_)})
      if (const float h = radius * radius - (y - centre.y()) * (y - centre.y()); h >= 0.f)
        add(centre.x() - std::sqrt(h), centre.x() + std::sqrt(h));
    if (apart_)
      for (const auto& [a, b] : tangents_)
        if ((a.y() - y) * (b.y() - y) <= 0.f && a.y() != b.y()) {
          const float x = a.x() + (y - a.y()) / (b.y() - a.y()) * (b.x() - a.x());
          add(x, x);
        }
    return range;
  }

 private:
  Vec2 p_, q_;
  float rp_, rq_;
  bool exact_, apart_ = false;
  std::array<std::pair<Vec2, Vec2>, 2> tangents_;
};

/// Where a capsule, whose ends lie at p and q on the picture, may be seen by any sample of a pixel, by its middle.
/// The discs are exact where spheres are small beside their distance and not far from the middle of the picture.
inline Outline outline_of(const frame::Constants& c, float spread, const Vec2& p, const Vec2& q,
                          const Body& body) {
  const auto small = [&](const Vec3& at, float radius) {
    return c.parallel > 0.f || (radius < .25f * at.z() && at.squaredNorm() < 2.5f * at.z() * at.z());
  };
  const bool exact = small(body.a, body.ra) && small(body.b, body.rb);
  const float margin = 1.f + 1.4143f * spread;
  const auto reach = [&](const Vec3& at, float radius) {
    if (c.parallel > 0.f) return margin + c.focal * radius;
    return margin + c.focal * radius *
                        (exact ? at.norm() / (at.z() * (at.z() - radius))  // as scene/occlusion.cpp
                               : 1.05f / std::max(at.z() - .5f * radius, c.near));
  };
  return {p, q, reach(body.a, body.ra), reach(body.b, body.rb), exact};
}

/// Where every sample of a pixel certainly meets it, by the pixel's middle.
inline Outline inner_outline_of(const frame::Constants& c, const Vec2& p, const Vec2& q, const Body& body) {
  const auto reach = [&](const Vec3& at, float radius) {
    return std::max(c.focal * radius / lens(c, at.z()) - 1.f, 0.f);
  };
  return {p, q, reach(body.a, body.ra), reach(body.b, body.rb), true};
}

}  // namespace forest::render::cpu
