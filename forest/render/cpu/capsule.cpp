// SPDX-License-Identifier: Apache-2.0
#include "forest/render/cpu/capsule.h"

#include "forest/core/clones.h"

namespace forest::render::cpu {
namespace {

template <int lanes>
[[gnu::always_inline]] inline void meet_all(const frame::Constants& c, const Vec3& light, const Body& body,
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

}  // namespace

FOREST_CLONES void meet(const frame::Constants& c, const Vec3& light, const Body& body, const float* x,
                        const float* y, Hits<4>& hits) {
  meet_all<4>(c, light, body, x, y, hits);
}
FOREST_CLONES void meet(const frame::Constants& c, const Vec3& light, const Body& body, const float* x,
                        const float* y, Hits<8>& hits) {
  meet_all<8>(c, light, body, x, y, hits);
}
FOREST_CLONES void meet(const frame::Constants& c, const Vec3& light, const Body& body, const float* x,
                        const float* y, Hits<16>& hits) {
  meet_all<16>(c, light, body, x, y, hits);
}

}  // namespace forest::render::cpu
