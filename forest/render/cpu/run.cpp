// SPDX-License-Identifier: Apache-2.0
#include "forest/render/cpu/run.h"

#include <algorithm>
#include <bit>
#include <cmath>

#include "forest/core/clones.h"
#include "forest/core/half.h"
#include "forest/frame/constants.h"
#include "forest/render/cpu/arithmetic.h"
#include "forest/render/cpu/canvas.h"
#include "forest/render/cpu/capsule.h"

namespace forest::render::cpu {
namespace {

// Segment `i` of a run that is loaded, where something is transparent.
void mark_transparent(const Picture& picture, std::uint32_t instance, const frame::State& state, Run& r,
                      std::size_t i) {
  r.opacity[i] = (state.opacity * picture.opacities[r.entry[i]] + 127u) / 255u;
  if (r.opacity[i] < 255) r.key[i] = frame::forest_branch_key(instance, r.meta[i]);
}

// Straws are of a neuron each.
void load_owners(const Picture& picture, const frame::Item& item, Run& r) {
  std::size_t i = 0;
  for (std::uint32_t drawn = item.drawn; drawn; drawn &= drawn - 1, ++i) {
    const std::uint32_t instance =
        picture.geometry.owner(item.first_segment + std::size_t(std::countr_zero(drawn))).instance;
    const frame::State state = picture.states[instance];
    r.entry[i] += state.colour_class * 8u;
    if (picture.transparent) mark_transparent(picture, instance, state, r, i);
  }
}

// What lies beyond the last segment up to here is worked out, too, and never read.
std::size_t whole_vectors(std::size_t count) { return (count + 7) & ~std::size_t(7); }

}  // namespace

void load(const Picture& picture, const frame::Item& item, const std::uint8_t* entries, Run& r) {
  const frame::Segment* segments = &picture.geometry.segments[item.first_segment];
  const bool straws = picture.geometry.straw(item);
  const frame::State state = straws ? frame::State{} : picture.state_of(item);
  const std::uint32_t colour = state.colour_class * 8u;
  // Which lines are drawn for their like does not change from sample to sample.
  const float turn = picture.constants.thinnest > 0.f ? 0.f : golden * float(picture.constants.subframe);
  r.count = 0;
  for (std::uint32_t drawn = item.drawn; drawn; drawn &= drawn - 1) {
    const frame::Segment& s = segments[std::countr_zero(drawn)];
    const std::size_t i = r.count++;
    r.ax[i] = s.ax, r.ay[i] = s.ay, r.az[i] = s.az;
    r.bx[i] = s.bx, r.by[i] = s.by, r.bz[i] = s.bz;
    r.ra[i] = from_half(s.radii), r.rb[i] = from_half(s.radii >> 16);
    r.mean_width[i] = from_half(s.meta >> 16);
    r.rank[i] = float(s.meta >> 8 & 255) * (1.f / 256.f) + turn;
    r.entry[i] = colour + (s.meta & 7);
    r.meta[i] = s.meta;
    r.opacity[i] = 255;
  }
  if (straws)
    load_owners(picture, item, r);
  else if (picture.transparent)
    for (std::size_t i = 0; i < r.count; ++i) mark_transparent(picture, item.instance, state, r, i);
  if (entries) {
    std::size_t i = 0;
    for (std::uint32_t drawn = item.drawn; drawn; drawn &= drawn - 1)
      r.entry[i++] = entries[std::countr_zero(drawn)];
  }
}

void load(const frame::Overlay& o, const Picture& picture, Run& r) {
  const frame::Constants& c = picture.constants;
  r.count = 1;
  r.ax[0] = o.a.x(), r.ay[0] = o.a.y(), r.az[0] = o.a.z(), r.bx[0] = o.b.x(), r.by[0] = o.b.y(),
  r.bz[0] = o.b.z();
  r.rank[0] = r.mean_width[0] = 0.f;
  r.entry[0] = o.colour;
  r.opacity[0] = 255;
  const auto least = [&](const Vec3& p) {
    return std::max(o.radius, lens(c, picture.to_camera.row(2).dot(p - picture.eye)) / c.focal);
  };
  r.ra[0] = least(o.a), r.rb[0] = least(o.b);
}

FOREST_CLONES void place(const frame::Constants& c, const Mat3& turn, const Vec3& at, float least, Run& r) {
  const float m00 = turn(0, 0), m01 = turn(0, 1), m02 = turn(0, 2), m10 = turn(1, 0), m11 = turn(1, 1),
              m12 = turn(1, 2), m20 = turn(2, 0), m21 = turn(2, 1), m22 = turn(2, 2);
  const float tx = at.x(), ty = at.y(), tz = at.z();
  const float near = c.near, focal = c.focal, converge = c.converge, parallel = c.parallel,
              centre_x = c.centre_x, centre_y = c.centre_y;
  const std::size_t count = whole_vectors(r.count);
  for (std::size_t i = 0; i < count; ++i) {
    float ax = m00 * r.ax[i] + m01 * r.ay[i] + m02 * r.az[i] + tx;
    float ay = m10 * r.ax[i] + m11 * r.ay[i] + m12 * r.az[i] + ty;
    float az = m20 * r.ax[i] + m21 * r.ay[i] + m22 * r.az[i] + tz;
    float bx = m00 * r.bx[i] + m01 * r.by[i] + m02 * r.bz[i] + tx;
    float by = m10 * r.bx[i] + m11 * r.by[i] + m12 * r.bz[i] + ty;
    float bz = m20 * r.bx[i] + m21 * r.by[i] + m22 * r.bz[i] + tz;
    // The part of it before the near distance.
    const float dx = bx - ax, dy = by - ay, dz = bz - az, dr = r.rb[i] - r.ra[i];
    const float step = (near - az) / dz;  // used where the ends differ
    const bool seen = larger(az, bz) >= near;
    const float from = az < near ? step : 0.f, to = bz < near ? step - 1.f : 0.f;
    ax += from * dx, ay += from * dy, az = larger(az + from * dz, near);
    bx += to * dx, by += to * dy, bz = larger(bz + to * dz, near);
    const float fa = focal / (converge * az + parallel), fb = focal / (converge * bz + parallel);
    const float ra = larger(r.ra[i] + from * dr, least / fa), rb = larger(r.rb[i] + to * dr, least / fb);
    r.ax[i] = ax, r.ay[i] = ay, r.az[i] = az, r.ra[i] = ra;
    r.bx[i] = bx, r.by[i] = by, r.bz[i] = bz, r.rb[i] = rb;
    r.px[i] = centre_x + fa * ax, r.py[i] = centre_y - fa * ay;
    r.qx[i] = centre_x + fb * bx, r.qy[i] = centre_y - fb * by;
    r.code_a[i] = depth_code(az), r.code_b[i] = depth_code(bz);
    r.width[i] = seen ? fa * ra + fb * rb : -1.f;
    r.widest[i] = larger(fa * ra, fb * rb);
    r.mean_width[i] = r.mean_width[i] * (fa + fb);
    r.rank[i] = fraction(r.rank[i]);
  }
}

FOREST_CLONES void surround(const frame::Constants& c, float margin, Run& r) {
  const float near = c.near;
  const std::size_t count = whole_vectors(r.count);
  for (std::size_t i = 0; i < count; ++i) {
    const float ra = r.ra[i], rb = r.rb[i], az = r.az[i], bz = r.bz[i];
    const float a2 = r.ax[i] * r.ax[i] + r.ay[i] * r.ay[i] + az * az,
                b2 = r.bx[i] * r.bx[i] + r.by[i] * r.by[i] + bz * bz;
    const Reach of(c, a2, az, ra, b2, bz, rb);
    const float reach = larger(of.a, of.b), all = reach + margin;
    const float depth = smaller(az - ra, bz - rb);
    r.reach[i] = reach;
    r.front[i] = depth > near ? depth_code(depth) : 0.f;
    r.left[i] = smaller(r.px[i], r.qx[i]) - all, r.right[i] = larger(r.px[i], r.qx[i]) + all;
    r.top[i] = smaller(r.py[i], r.qy[i]) - all, r.bottom[i] = larger(r.py[i], r.qy[i]) + all;
  }
}

FOREST_CLONES void light(const frame::Constants& c, const Vec3& towards, Run& r) {
  const float lx = towards.x(), ly = towards.y(), lz = towards.z(), converge = c.converge;
  const std::size_t count = whole_vectors(r.count);
  for (std::size_t i = 0; i < count; ++i) {
    // The axis, and the way to the eye from twice the middle. The mean light of the half cylinder one sees: see draw_line in
    // render/opengl/shaders/common.glsl.
    const float dx = r.bx[i] - r.ax[i], dy = r.by[i] - r.ay[i], dz = r.bz[i] - r.az[i];
    const float ex = -converge * (r.ax[i] + r.bx[i]), ey = -converge * (r.ay[i] + r.by[i]),
                ez = -(r.az[i] + r.bz[i]);
    const float per_length = 1.f / std::sqrt(larger(dx * dx + dy * dy + dz * dz, 1e-18f)),
                per_distance = 1.f / std::sqrt(ex * ex + ey * ey + ez * ez);
    const float along = (dx * lx + dy * ly + dz * lz) * per_length,
                end_on = (dx * ex + dy * ey + dz * ez) * per_length * per_distance,
                facing = (ex * lx + ey * ly + ez * lz) * per_distance;
    const float b = (facing - end_on * along) / std::sqrt(larger(1.f - end_on * end_on, 1e-4f));
    const float a2 = larger(0.f, 1.f - along * along - b * b);
    const float shade = .5f * std::sqrt(larger(0.f, 1.f + 1.5707963f * b + (a2 + 2.f * b * b) * (1.f / 3.f)));
    // Across its axis and the way to the eye.
    const float sx = dy * ez - dz * ey, sy = dz * ex - dx * ez, sz = dx * ey - dy * ex;
    const float lit_side =
        .5f * (sx * lx + sy * ly + sz * lz) / std::sqrt(larger(sx * sx + sy * sy + sz * sz, 1e-30f));
    const float downwards = r.steep[i] != 0 ? sx : -sy;
    r.lit_front[i] = .5f * b;
    r.lit_side[i] = downwards < 0.f ? -lit_side : lit_side;
    r.payload[i] = payload_of(r.entry[i], shade, fraction(r.rank[i] * 7.f));
  }
}

bool trim(const frame::Constants& c, const Crop& crop, Run& r, std::size_t i) {
  const float wide = float(c.width), high = float(c.height);
  const auto far = [&](float x, float y) {
    return !(x > -.5f * wide && x < 1.5f * wide && y > -.5f * high && y < 1.5f * high);
  };
  if (!far(r.px[i], r.py[i]) && !far(r.qx[i], r.qy[i])) return true;
  Vec3 a(r.ax[i], r.ay[i], r.az[i]), b(r.bx[i], r.by[i], r.bz[i]);
  if (!crop(a, b, r.ra[i], r.rb[i])) return false;
  const float fa = c.focal / lens(c, a.z()), fb = c.focal / lens(c, b.z());
  r.ax[i] = a.x(), r.ay[i] = a.y(), r.az[i] = a.z(), r.bx[i] = b.x(), r.by[i] = b.y(), r.bz[i] = b.z();
  r.px[i] = c.centre_x + fa * a.x(), r.py[i] = c.centre_y - fa * a.y();
  r.qx[i] = c.centre_x + fb * b.x(), r.qy[i] = c.centre_y - fb * b.y();
  r.code_a[i] = depth_code(a.z()), r.code_b[i] = depth_code(b.z());
  const Reach reach(c, a, b, r.ra[i], r.rb[i]);
  const float depth = std::min(a.z() - r.ra[i], b.z() - r.rb[i]);
  r.reach[i] = std::max(reach.a, reach.b);
  r.front[i] = depth > c.near ? depth_code(depth) : 0.f;
  return true;
}

FOREST_CLONES void lengthen(const frame::Constants& c, Run& r) {
  const std::size_t count = whole_vectors(r.count);
  const float shortest = float(FOREST_STRAW_LENGTH) * c.thinnest;
  for (std::size_t i = 0; i < count; ++i) {
    const float dx = r.qx[i] - r.px[i], dy = r.qy[i] - r.py[i], length = std::sqrt(dx * dx + dy * dy);
    const bool shorter = length < shortest, none = !(length > 1e-3f);
    const float scale = .5f * shortest / larger(length, 1e-3f), mx = .5f * (r.px[i] + r.qx[i]),
                my = .5f * (r.py[i] + r.qy[i]), hx = none ? .5f * shortest : scale * dx,
                hy = none ? 0.f : scale * dy;
    r.px[i] = shorter ? mx - hx : r.px[i], r.py[i] = shorter ? my - hy : r.py[i];
    r.qx[i] = shorter ? mx + hx : r.qx[i], r.qy[i] = shorter ? my + hy : r.qy[i];
    r.mean_width[i] *= shorter ? length / shortest : 1.f;
  }
}

FOREST_CLONES void prepare_lines(const frame::Constants& c, bool straws, float spread, Run& r) {
  const std::size_t count = whole_vectors(r.count);
  const float width = float(c.width), height = float(c.height);
  const bool single = c.subframes == 1;
  const float thinnest = thinnest_of(c, straws);
  const float lot =
      straws ? 1.f : 0.f;  // whether it is drawn here; a number, for vectors are made of numbers alone
  const float per_thinnest = float(FOREST_MEAN_STRETCH) / larger(thinnest, 1e-6f);
  for (std::size_t i = 0; i < count; ++i) {
    const float px = r.px[i], py = r.py[i], qx = r.qx[i], qy = r.qy[i], za = r.code_a[i], zb = r.code_b[i];
    const float dx = qx - px, dy = qy - py, wide = std::abs(dx), high = std::abs(dy);
    const bool steep = high > wide;
    const float major = larger(high, wide), width_here = r.width[i], mean = r.mean_width[i];
    const float across = width_here * larger(std::sqrt(dx * dx + dy * dy) / larger(major, 1e-20f), 1.f);
    const bool thin = (across < thinnest) & (mean > 0.f);
    const float share = larger(smaller(mean * per_thinnest, 1.f), 1e-6f);
    // Which branches are drawn was chosen before; straws are drawn or not here.
    const float rank = r.rank[i] + 1.f / 512.f,
                among = lot > 0.f ? rank / share : fraction(float(FOREST_SPREAD) * rank);
    const float instead = single ? std::floor(thinnest + 1.f - among) : across / share;
    const float whole = single ? std::floor(across + 1.f - rank) : across;
    const float of_thin = among < 1.f ? instead : 0.f, line = thin ? of_thin : whole;
    // From the end of the smaller coordinate to the other.
    const float ax = steep ? py : px, ay = steep ? px : py, bx = steep ? qy : qx, by = steep ? qx : qy;
    const bool turned = ax > bx;
    const float x0 = turned ? bx : ax, y0 = turned ? by : ay, z0 = turned ? zb : za;
    const float x1 = turned ? ax : bx, y1 = turned ? ay : by, z1 = turned ? za : zb;
    const float limit = steep ? height : width;
    const float first = smaller(larger(std::ceil(x0 - .5f - spread), 0.f), limit),
                last = smaller(larger(std::ceil(x1 - .5f + spread), 0.f), limit);
    const float inverse = 1.f / (x1 - x0), slope = (y1 - y0) * inverse, rise = (z1 - z0) * inverse;
    const float begin = first + .5f - x0, half = .5f * line + spread;
    const float left = smaller(px, qx) - half, right = larger(px, qx) + half, top = smaller(py, qy) - half,
                bottom = larger(py, qy) + half;
    const bool inside = (left < width) & (right >= 0.f) & (top < height) & (bottom >= 0.f);
    const bool any = inside & (width_here >= 0.f) & (first < last) & (x0 < x1);
    r.line_width[i] = any ? line : 0.f;
    r.tile_left[i] = std::int32_t(smaller(larger(left, 0.f), width)) >> tile_bits;
    r.tile_top[i] = std::int32_t(smaller(larger(top, 0.f), height)) >> tile_bits;
    r.tile_right[i] = std::int32_t(larger(smaller(right, width - 1.f), 0.f)) >> tile_bits;
    r.tile_bottom[i] = std::int32_t(larger(smaller(bottom, height - 1.f), 0.f)) >> tile_bits;
    r.nearest[i] = key_of(smaller(za, zb), 0);
    r.first[i] = first, r.last[i] = last;
    r.y[i] = y0 + begin * slope - .5f, r.slope[i] = slope;
    r.z[i] = z0 + begin * rise, r.rise[i] = rise;
    r.begin[i] = begin, r.length[i] = x1 - x0;
    r.steep[i] = steep ? 1u : 0u;
  }
}

Beads::Beads(const Run& r, float pixels_a_unit)
    : a(r.ax[0], r.ay[0], r.az[0]), b(r.bx[0], r.by[0], r.bz[0]), count(1), radius(r.ra[0]) {
  const float length = (b - a).norm(), width = r.ra[0] + r.rb[0];
  if (!(length > 0.f)) return;
  const float most = std::min({.5f * length / std::max(width, 1e-6f), .5f * length * pixels_a_unit, 16.f});
  count = std::uint32_t(std::max(most, 1.f));
  radius = std::sqrt(length * width / (3.14159f * float(count)));
}

void Beads::put(std::uint32_t k, Run& r) const {
  const Vec3 at = a + (float(k) + .5f) / float(count) * (b - a);
  r.ra[0] = r.rb[0] = radius;
  r.ax[0] = r.bx[0] = at.x(), r.ay[0] = r.by[0] = at.y(), r.az[0] = r.bz[0] = at.z();
}

}  // namespace forest::render::cpu
