// SPDX-License-Identifier: Apache-2.0
#include "forest/render/cpu/splat.h"

#include <cmath>
#include <limits>

#include "forest/core/parallel.h"
#include "forest/frame/constants.h"

namespace forest::render::cpu {
namespace {

constexpr std::size_t grain = 64;  // items a thread takes at once
constexpr float tube_width =
    7.f;  // pixels; below, a capsule is shaded by its distance from the axis on screen
constexpr std::size_t run = FOREST_CLUSTER_SIZE;

// The segments of an item in camera coordinates (x right, y up, z depth), cut at the near distance, and in pixels.
struct Run {
  std::size_t count = 0;
  float ax[run], ay[run], az[run], ra[run], bx[run], by[run], bz[run], rb[run];
  float px[run], py[run], qx[run], qy[run];      // pixels of both ends
  float code_a[run], code_b[run];                // of their depths
  float width[run];                              // pixels; below 0: nothing of it lies before the eye
  float mean_width[run], rank[run], shade[run];  // of its branch; in [0, 1); of a line
  std::uint32_t entry[run];                      // of the palette
};

// `entries`: of its segments; null: the colour class says.
void load(const Picture& picture, const frame::Item& item, const std::uint8_t* entries, Run& r) {
  const frame::Segment* segments = &picture.geometry.segments[item.first_segment];
  const std::uint32_t colour = picture.colour_class[item.instance] * 8u;
  const float turn = golden * float(picture.constants.subframe);
  r.count = item.segment_count;
  for (std::size_t i = 0; i < r.count; ++i) {
    const frame::Segment& s = segments[i];
    r.ax[i] = s.ax, r.ay[i] = s.ay, r.az[i] = s.az;
    r.bx[i] = s.bx, r.by[i] = s.by, r.bz[i] = s.bz;
    r.ra[i] = from_half(s.radii), r.rb[i] = from_half(s.radii >> 16);
    r.mean_width[i] = from_half(s.meta >> 16);
    r.rank[i] = float(s.meta >> 8 & 255) * (1.f / 256.f) + turn;
    r.entry[i] = colour + (s.meta & 7);
  }
  if (entries)
    for (std::size_t i = 0; i < r.count; ++i) r.entry[i] = entries[i];
}

// From the coordinates of their neuron to pixels: camera = turn · p + at.
[[gnu::target_clones("default", "arch=haswell")]] void project(const frame::Constants& c, const Mat3& turn,
                                                               const Vec3& at, const Vec3& light, Run& r) {
  const float m00 = turn(0, 0), m01 = turn(0, 1), m02 = turn(0, 2), m10 = turn(1, 0), m11 = turn(1, 1),
              m12 = turn(1, 2), m20 = turn(2, 0), m21 = turn(2, 1), m22 = turn(2, 2);
  const float tx = at.x(), ty = at.y(), tz = at.z(), lx = light.x(), ly = light.y(), lz = light.z();
  const float near = c.near, focal = c.focal, centre_x = c.centre_x, centre_y = c.centre_y;
  const std::size_t count = (r.count + 7) & ~std::size_t(7);
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
    const float ra = r.ra[i] + from * dr, rb = r.rb[i] + to * dr;
    const float fa = focal / az, fb = focal / bz;
    r.ax[i] = ax, r.ay[i] = ay, r.az[i] = az, r.ra[i] = ra;
    r.bx[i] = bx, r.by[i] = by, r.bz[i] = bz, r.rb[i] = rb;
    r.px[i] = centre_x + fa * ax, r.py[i] = centre_y - fa * ay;
    r.qx[i] = centre_x + fb * bx, r.qy[i] = centre_y - fb * by;
    r.code_a[i] = depth_code(az), r.code_b[i] = depth_code(bz);
    r.width[i] = seen ? fa * ra + fb * rb : -1.f;
    r.mean_width[i] = r.mean_width[i] * (fa + fb);
    // The mean light of the half cylinder one sees: see draw_line in render/opengl/shaders/common.glsl.
    const float ex = -(ax + bx), ey = -(ay + by), ez = -(az + bz);
    const float per_length = 1.f / std::sqrt(larger(dx * dx + dy * dy + dz * dz, 1e-18f)),
                per_distance = 1.f / std::sqrt(ex * ex + ey * ey + ez * ez);
    const float along = (dx * lx + dy * ly + dz * lz) * per_length,
                end_on = (dx * ex + dy * ey + dz * ez) * per_length * per_distance,
                towards = (ex * lx + ey * ly + ez * lz) * per_distance;
    const float b = (towards - end_on * along) / std::sqrt(larger(1.f - end_on * end_on, 1e-4f));
    const float a2 = larger(0.f, 1.f - along * along - b * b);
    r.shade[i] = .5f * std::sqrt(larger(0.f, 1.f + 1.5707963f * b + (a2 + 2.f * b * b) * (1.f / 3.f)));
    r.rank[i] = fraction(r.rank[i]);
  }
}

// The whole number of `x`, cut at the edges of the picture: what stands right before the eye reaches far beyond all of them.
std::int32_t clipped(float x, float limit) { return std::int32_t(smaller(larger(x, 0.f), limit)); }

// As draw_line in render/opengl/shaders/common.glsl.
void draw_line(const Run& r, std::size_t i, bool single, Canvas& canvas) {
  float px = r.px[i], py = r.py[i], qx = r.qx[i], qy = r.qy[i];
  const float dx = qx - px, dy = qy - py, wide = std::abs(dx), high = std::abs(dy);
  const bool steep = high > wide;
  const float major = steep ? high : wide;
  const float stretch = major > 0.f ? std::sqrt(dx * dx + dy * dy) / major : 1.f;
  float width = r.width[i] * stretch;
  if (single) {
    if (width < 1.f && r.mean_width[i] > 0.f)
      width = std::min(r.mean_width[i] * float(FOREST_MEAN_STRETCH), 1.f);
    width = std::floor(width + 1.f - r.rank[i] - 1.f / 512.f);
    if (width < 1.f) return;
  }
  const float half = .5f * width;
  float za = r.code_a[i], zb = r.code_b[i];
  if (canvas.hidden(std::min(px, qx) - half, std::min(py, qy) - half, std::max(px, qx) + half,
                    std::max(py, qy) + half, std::min(za, zb)))
    return;
  if (steep) std::swap(px, py), std::swap(qx, qy);
  if (px > qx) std::swap(px, qx), std::swap(py, qy), std::swap(za, zb);
  const float limit = float(steep ? canvas.height() : canvas.width()),
              limit_across = float(steep ? canvas.width() : canvas.height());
  const std::int32_t first = clipped(std::ceil(px - .5f), limit), last = clipped(std::ceil(qx - .5f), limit);
  if (first >= last) return;
  const float inverse = 1.f / (qx - px), slope = (qy - py) * inverse, rise = (zb - za) * inverse;
  const float begin = float(first) + .5f - px;
  float y = py + begin * slope - .5f, z = za + begin * rise;
  const std::uint32_t payload = payload_of(r.entry[i], r.shade[i], fraction(r.rank[i] * 7.f));
  for (std::int32_t x = first; x < last; ++x, y += slope, z += rise) {
    const std::int32_t low = clipped(std::ceil(y - half), limit_across),
                       end = clipped(std::ceil(y + half), limit_across);
    for (std::int32_t across = low; across < end; ++across) {
      const std::uint32_t key = key_of(smaller(larger(z, 0.f), float(FOREST_DEPTH_MAX)), payload);
      steep ? canvas.put(across, x, key) : canvas.put(x, across, key);
    }
  }
}

// A thin capsule by its distance from the axis on screen: as draw_tube in render/opengl/shaders/capsule.glsl.
void draw_tube(const Picture& picture, const Run& r, std::size_t i, Canvas& canvas) {
  const frame::Constants& c = picture.constants;
  float px = r.px[i], py = r.py[i], qx = r.qx[i], qy = r.qy[i];
  float wp = c.focal * r.ra[i] / r.az[i], wq = c.focal * r.rb[i] / r.bz[i], za = r.code_a[i],
        zb = r.code_b[i];
  constexpr float octave = 1.442695f * float(FOREST_DEPTH_STEPS);
  const float bulge = octave * std::max(r.ra[i] / r.az[i], r.rb[i] / r.bz[i]);
  const bool steep = std::abs(qy - py) > std::abs(qx - px);
  if (steep) std::swap(px, py), std::swap(qx, qy);
  if (px > qx) std::swap(px, qx), std::swap(py, qy), std::swap(wp, wq), std::swap(za, zb);
  const float dx = qx - px, slope = (qy - py) / dx, stretch = std::sqrt(1.f + slope * slope);
  const float limit = float(steep ? canvas.height() : canvas.width()),
              limit_across = float(steep ? canvas.width() : canvas.height());
  const float over = .4f * std::min(wp, wq);
  const std::int32_t first = clipped(std::ceil(px - over - .5f), limit),
                     last = clipped(std::ceil(qx + over - .5f), limit);
  const Vec3 a(r.ax[i], r.ay[i], r.az[i]), b(r.bx[i], r.by[i], r.bz[i]);
  const Vec3 tangent = (b - a).normalized(), eye = -(a + b).normalized();
  const Vec3 facing = (eye - eye.dot(tangent) * tangent).normalized();
  Vec3 side = tangent.cross(facing);
  if ((steep ? side.x() : -side.y()) < 0.f) side = -side;
  const float lit_side = .5f * side.dot(picture.light), lit_front = .5f * facing.dot(picture.light);
  for (std::int32_t x = first; x < last; ++x) {
    const float along = (float(x) + .5f - px) / dx, within = std::min(std::max(along, 0.f), 1.f);
    const float centre = py + slope * (along * dx), half = (wp + within * (wq - wp)) * stretch;
    const float z = za + within * (zb - za), inverse = 1.f / half;
    const std::int32_t low = clipped(std::ceil(centre - half - .5f), limit_across),
                       high = clipped(std::ceil(centre + half - .5f), limit_across);
    for (std::int32_t y = low; y < high; ++y) {
      const float t = (float(y) + .5f - centre) * inverse, h = std::sqrt(std::max(0.f, 1.f - t * t));
      const std::int32_t at_x = steep ? y : x, at_y = steep ? x : y;
      canvas.put(
          at_x, at_y,
          key_of(std::max(z - bulge * h, 0.f), payload_of(r.entry[i], .5f + t * lit_side + h * lit_front,
                                                          noise_at(at_x, at_y, c.subframe))));
    }
  }
}

struct Hit {
  float t = std::numeric_limits<float>::infinity();
  Vec3 normal = Vec3::Zero();
};

void meet_sphere(const Vec3& ray, const Vec3& centre, float radius, Hit& hit) {
  const float b = ray.dot(centre), h = radius * radius - (centre - b * ray).squaredNorm();
  if (h < 0.f) return;
  const float t = b - std::sqrt(h);
  if (t > 0.f && t < hit.t) hit = {t, (t * ray - centre) / std::max(radius, 1e-9f)};
}

// Every pixel meets the tapered capsule with its own ray: as draw_capsule in render/opengl/shaders/capsule.glsl.
void draw_capsule(const Picture& picture, const Run& r, std::size_t i, Canvas& canvas) {
  const frame::Constants& c = picture.constants;
  const Vec3 a(r.ax[i], r.ay[i], r.az[i]), b(r.bx[i], r.by[i], r.bz[i]);
  const float ra = r.ra[i], rb = r.rb[i];
  const std::uint32_t nearest = key_of(depth_code(std::max(std::min(a.z() - ra, b.z() - rb), c.near)), 0);
  float px = r.px[i], py = r.py[i], qx = r.qx[i], qy = r.qy[i];
  const float rp = 1.f + 1.05f * c.focal * ra / std::max(a.z() - .5f * ra, c.near),
              rq = 1.f + 1.05f * c.focal * rb / std::max(b.z() - .5f * rb, c.near);
  const bool steep = std::abs(qy - py) > std::abs(qx - px);
  if (steep) std::swap(px, py), std::swap(qx, qy);
  const float limit = float(steep ? canvas.height() : canvas.width()),
              limit_across = float(steep ? canvas.width() : canvas.height());
  const std::int32_t first = clipped(std::floor(std::min(px - rp, qx - rq)), limit),
                     last = clipped(std::ceil(std::max(px + rp, qx + rq)), limit);
  const float reach = std::max(rp, rq);
  const Vec3 axis = b - a;
  const float length = axis.norm(), taper = ra - rb;
  const bool nested = length <= std::abs(taper) + 1e-6f;
  const Vec3 u = nested ? Vec3(0, 0, 0) : Vec3(axis / length);
  const float s = nested ? 0.f : taper / length, c2 = 1.f - s * s, cosine = std::sqrt(c2);

  const auto scan = [&](std::int32_t x) {
    const float at = float(x) + .5f, dx = qx - px;
    float t0 = 0.f, t1 = 1.f;
    if (std::abs(dx) > 1e-3f) {
      const float e0 = (at - reach - px) / dx, e1 = (at + reach - px) / dx;
      t0 = std::clamp(std::min(e0, e1), 0.f, 1.f), t1 = std::clamp(std::max(e0, e1), 0.f, 1.f);
    }
    const float y0 = py + t0 * (qy - py), y1 = py + t1 * (qy - py);
    const float w = std::max(rp + t0 * (rq - rp), rp + t1 * (rq - rp));
    const std::int32_t low = clipped(std::floor(std::min(y0, y1) - w), limit_across),
                       high = clipped(std::ceil(std::max(y0, y1) + w), limit_across);
    for (std::int32_t y = low; y < high; ++y) {
      const std::int32_t at_x = steep ? y : x, at_y = steep ? x : y;
      if (canvas.key(at_x, at_y) < nearest) continue;
      const Vec3 ray =
          Vec3((float(at_x) + .5f - c.centre_x) / c.focal, (c.centre_y - float(at_y) - .5f) / c.focal, 1.f)
              .normalized();
      Hit hit;
      if (!nested) {
        const float shift = a.dot(ray);
        const Vec3 o = shift * ray - a;
        const float oy = o.dot(u), dy = ray.dot(u), k0 = ra - s * oy, k1 = -s * dy;
        const float A = c2 * (1.f - dy * dy) - k1 * k1, B = -c2 * oy * dy - k0 * k1,
                    C = c2 * (o.squaredNorm() - oy * oy) - k0 * k0, root = B * B - A * C;
        if (root < 0.f) continue;  // beside the cone, within which both spheres lie
        if (A > 1e-9f) {
          const float local = (-B - std::sqrt(root)) / A, along = oy + local * dy;
          if (along >= s * ra && along <= length + s * rb && local + shift > 0.f)
            hit = {local + shift, cosine * (o + local * ray - along * u).normalized() + s * u};
        }
      }
      if (std::isinf(hit.t)) {
        meet_sphere(ray, a, ra, hit);
        meet_sphere(ray, b, rb, hit);
        if (std::isinf(hit.t)) continue;
      }
      const float z = std::max(hit.t * ray.z(), c.near);
      canvas.put(at_x, at_y,
                 key_of(depth_code(z), payload_of(r.entry[i], .5f + .5f * hit.normal.dot(picture.light),
                                                  noise_at(at_x, at_y, c.subframe))));
    }
  };
  constexpr std::int32_t shared = 128;  // scan lines from which on other threads help
  if (last - first >= shared)
    parallel_for(std::size_t(last - first), 16, [&](std::size_t k) { scan(first + std::int32_t(k)); });
  else
    for (std::int32_t x = first; x < last; ++x) scan(x);
}

void draw_near(const Picture& picture, const Run& r, std::size_t i, Canvas& canvas) {
  const frame::Constants& c = picture.constants;
  if (r.width[i] < 0.f) return;
  const float width = c.focal * std::max(r.ra[i] / r.az[i], r.rb[i] / r.bz[i]);
  if (width < .75f) return draw_line(r, i, c.subframes == 1, canvas);
  const float reach = 1.f + 1.05f * width;
  const float nearest = std::max(std::min(r.az[i] - r.ra[i], r.bz[i] - r.rb[i]), c.near);
  if (canvas.hidden(std::min(r.px[i], r.qx[i]) - reach, std::min(r.py[i], r.qy[i]) - reach,
                    std::max(r.px[i], r.qx[i]) + reach, std::max(r.py[i], r.qy[i]) + reach,
                    depth_code(nearest)) &&
      nearest > c.near)
    return;
  const float distance = std::hypot(r.qx[i] - r.px[i], r.qy[i] - r.py[i]);
  2.f * width<tube_width && distance> .5f * width ? draw_tube(picture, r, i, canvas)
                                                  : draw_capsule(picture, r, i, canvas);
}

// Small spheres: as render/opengl/shaders/dots.glsl.
void draw_dot(const Picture& picture, const Run& r, float rank, Canvas& canvas) {
  if (r.width[0] < 0.f) return;
  const frame::Constants& c = picture.constants;
  const float px = r.px[0], py = r.py[0], z = r.az[0], radius = c.focal * r.ra[0] / z;
  if (radius < .6f) {  // less than a pixel: drawn for its share of subframes
    const float x = std::floor(px), y = std::floor(py);
    if (3.14159f * radius * radius > rank && x >= 0.f && y >= 0.f && x < float(canvas.width()) &&
        y < float(canvas.height()))
      canvas.put(std::int32_t(x), std::int32_t(y), key_of(r.code_a[0], payload_of(r.entry[0], .8f, rank)));
    return;
  }
  const float width = float(canvas.width()), height = float(canvas.height());
  const std::int32_t top = clipped(std::ceil(py - radius - .5f), height),
                     bottom = clipped(std::floor(py + radius + .5f), height),
                     left = clipped(std::ceil(px - radius - .5f), width),
                     right = clipped(std::floor(px + radius + .5f), width);
  for (std::int32_t y = top; y < bottom; ++y)
    for (std::int32_t x = left; x < right; ++x) {
      const float dx = (float(x) + .5f - px) / radius, dy = (float(y) + .5f - py) / radius,
                  h = 1.f - dx * dx - dy * dy;
      if (h <= 0.f) continue;
      const Vec3 normal(dx, -dy, -std::sqrt(h));
      canvas.put(
          x, y,
          key_of(depth_code(std::max(z + r.ra[0] * normal.z(), c.near)),
                 payload_of(r.entry[0], .5f + .5f * normal.dot(picture.light), noise_at(x, y, c.subframe))));
    }
}

}  // namespace

void splat(const Picture& picture, std::span<const frame::Item> items, std::span<const std::uint8_t> entries,
           Kind kind, Canvas& canvas) {
  const frame::Constants& c = picture.constants;
  parallel_ranges(items.size(), grain, [&](std::size_t begin, std::size_t end) {
    Run r{};
    for (std::size_t k = begin; k < end; ++k) {
      const frame::Item& item = items[k];
      if (!item.segment_count) continue;
      const Vec3 centre = picture.to_camera * (Vec3(item.x, item.y, item.z) - picture.eye);
      const float nearest = centre.z() - item.radius;
      if (nearest > c.near) {
        const float reach = c.focal * item.radius * centre.norm() / (centre.z() * nearest) + 2.f;
        const float x = c.centre_x + c.focal * centre.x() / centre.z(),
                    y = c.centre_y - c.focal * centre.y() / centre.z();
        if (canvas.hidden(x - reach, y - reach, x + reach, y + reach, depth_code(nearest))) continue;
      }
      const frame::Instance& instance = picture.geometry.instances[item.instance];
      const Mat3 turn =
          picture.to_camera * Quat(instance.qw, instance.qx, instance.qy, instance.qz).toRotationMatrix();
      const Vec3 at = picture.to_camera * (Vec3(instance.x, instance.y, instance.z) - picture.eye);
      load(picture, item, entries.empty() ? nullptr : &entries[kind == Kind::dots ? k : k * run], r);
      project(c, turn, at, picture.light, r);
      switch (kind) {
        case Kind::lines:
          for (std::size_t i = 0; i < r.count; ++i)
            if (r.width[i] >= 0.f) draw_line(r, i, c.subframes == 1, canvas);
          break;
        case Kind::capsules:
          for (std::size_t i = 0; i < r.count; ++i) draw_near(picture, r, i, canvas);
          break;
        case Kind::dots:
          draw_dot(picture, r, fraction(float(item.instance) * .7548777f + golden * float(c.subframe)),
                   canvas);
      }
    }
  });
}

void splat(const Picture& picture, std::span<const frame::Overlay> overlays, Canvas& canvas) {
  const frame::Constants& c = picture.constants;
  const Vec3 at = picture.to_camera * -picture.eye;
  parallel_ranges(overlays.size(), grain, [&](std::size_t begin, std::size_t end) {
    Run r{};
    for (std::size_t k = begin; k < end; ++k) {
      const frame::Overlay& o = overlays[k];
      r.count = 1;
      r.ax[0] = o.a.x(), r.ay[0] = o.a.y(), r.az[0] = o.a.z(), r.bx[0] = o.b.x(), r.by[0] = o.b.y(),
      r.bz[0] = o.b.z();
      r.rank[0] = r.mean_width[0] = 0.f;
      r.entry[0] = o.colour;
      const auto least = [&](const Vec3& p) {
        return std::max(o.radius, (picture.to_camera.row(2).dot(p) + at.z()) / c.focal);
      };
      r.ra[0] = least(o.a), r.rb[0] = least(o.b);
      project(c, picture.to_camera, at, picture.light, r);
      draw_near(picture, r, 0, canvas);
    }
  });
}

}  // namespace forest::render::cpu
