// SPDX-License-Identifier: Apache-2.0
#include "forest/render/cpu/splat.h"

#include <array>
#include <atomic>
#include <bit>
#include <cmath>
#include <limits>

#include "forest/core/half.h"
#include "forest/core/parallel.h"
#include "forest/frame/constants.h"

namespace forest::render::cpu {
namespace {

constexpr std::size_t grain = 64;  // items a thread takes at once
constexpr float tube_width =
    7.f;  // pixels; below, a capsule is shaded by its distance from the axis on screen
constexpr std::size_t run = FOREST_CLUSTER_SIZE;

// Items lie in the order of depth, their segments anywhere.
constexpr std::size_t ahead = 3;
void prefetch(const frame::Geometry& geometry, const frame::Item& item) {
  const auto* at = reinterpret_cast<const char*>(&geometry.segments[item.first_segment]);
  for (std::size_t i = 0; i < 8; i += 2) __builtin_prefetch(at + i * sizeof(frame::Segment));
  __builtin_prefetch(&geometry.instances[item.instance]);
}

// The segments of an item in camera coordinates (x right, y up, z depth), cut at the near distance, and in pixels.
struct Run {
  std::size_t count = 0;
  float ax[run], ay[run], az[run], ra[run], bx[run], by[run], bz[run], rb[run];
  float px[run], py[run], qx[run], qy[run];  // pixels of both ends
  float code_a[run], code_b[run];            // of their depths
  // As a line: along the axis of the screen that it runs along more, from `first` to before `last`, where there is one.
  float left[run], right[run], top[run], bottom[run],
      nearest[run];       // pixels around it; code of its nearest depth
  float line_width[run];  // across the axis; 0: nothing to draw
  float first[run], last[run], y[run], slope[run], z[run], rise[run];  // y and z at the first step
  std::uint32_t steep[run], payload[run];
  float width[run];                  // pixels; below 0: nothing of it lies before the eye
  float mean_width[run], rank[run];  // of its branch; in [0, 1)
  std::uint32_t entry[run];          // of the palette
  std::uint32_t meta[run];           // as frame::Segment's
  std::uint32_t opacity[run],
      key[run];  // 0: left out; below 255: a screen door with this key (frame/layout.h)
};

// A canvas seen through a screen door: only the pixels at which something of that opacity shows.
struct Door {
  Canvas& canvas;
  std::uint32_t opacity, key_of_branch, subframe;

  bool open(std::int32_t x, std::int32_t y) const {
    const std::uint32_t pixel = std::uint32_t(y) * std::uint32_t(canvas.width()) + std::uint32_t(x);
    return frame::forest_shows(opacity, key_of_branch ^ frame::forest_mixed(pixel), subframe);
  }
  std::int32_t width() const { return canvas.width(); }
  std::int32_t height() const { return canvas.height(); }
  bool hidden(float left, float top, float right, float bottom, float nearest_code) const {
    return canvas.hidden(left, top, right, bottom, nearest_code);
  }
  bool before(std::int32_t x, std::int32_t y, std::uint32_t key) const { return canvas.before(x, y, key); }
  void put(std::int32_t x, std::int32_t y, std::uint32_t key) {
    if (open(x, y)) canvas.put(x, y, key);
  }
};

// Calls draw with the canvas of a segment; what it returns, false when the segment is left out.
bool through(const Picture& picture, const Run& r, std::size_t i, Canvas& canvas, auto&& draw) {
  if (r.opacity[i] == 255) return draw(canvas);
  if (r.opacity[i] == 0) return false;
  Door door{canvas, r.opacity[i], r.key[i], picture.constants.subframe};
  return draw(door);
}

// Of a run that is loaded, what is transparent, and what of that does not show in this subframe.
void leave_out(const Picture& picture, const frame::Item& item, const frame::State& state, Run& r) {
  const frame::Constants& c = picture.constants;
  for (std::size_t i = 0; i < r.count; ++i) {
    const std::uint32_t opacity = (state.opacity * picture.opacities[r.entry[i]] + 127u) / 255u;
    if (opacity == 255) continue;
    r.key[i] = frame::forest_branch_key(item.instance, r.meta[i]);
    r.opacity[i] = c.subframes < FOREST_DOOR_SUBFRAMES                  ? opacity
                   : frame::forest_shows(opacity, r.key[i], c.subframe) ? 255u
                                                                        : 0u;
  }
}

// `entries`: of its segments; null: the colour class says.
void load(const Picture& picture, const frame::Item& item, const std::uint8_t* entries, Run& r) {
  const frame::Segment* segments = &picture.geometry.segments[item.first_segment];
  const frame::State state = picture.state_of(item);
  const std::uint32_t colour = state.colour_class * 8u;
  const float turn = golden * float(picture.constants.subframe);
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
  if (picture.transparent) leave_out(picture, item, state, r);
  if (entries) {
    std::size_t i = 0;
    for (std::uint32_t drawn = item.drawn; drawn; drawn &= drawn - 1)
      r.entry[i++] = entries[std::countr_zero(drawn)];
  }
}

// A segment of a branch as a string of beads: spheres that cover as much of the picture together, a bead for two
// diameters of its length, none shorter than two pixels. A soma is one already.
struct Beads {
  Vec3 a, b;
  std::uint32_t count;
  float radius;

  Beads(const Run& r, float pixels_a_unit)
      : a(r.ax[0], r.ay[0], r.az[0]), b(r.bx[0], r.by[0], r.bz[0]), count(1), radius(r.ra[0]) {
    const float length = (b - a).norm(), width = r.ra[0] + r.rb[0];
    if (!(length > 0.f)) return;
    const float most = std::min({.5f * length / std::max(width, 1e-6f), .5f * length * pixels_a_unit, 16.f});
    count = std::uint32_t(std::max(most, 1.f));
    radius = std::sqrt(length * width / (3.14159f * float(count)));
  }
  void put(std::uint32_t k, Run& r) const {
    const Vec3 at = a + (float(k) + .5f) / float(count) * (b - a);
    r.ra[0] = r.rb[0] = radius;
    r.ax[0] = r.bx[0] = at.x(), r.ay[0] = r.by[0] = at.y(), r.az[0] = r.bz[0] = at.z();
  }
};

// From the coordinates of their neuron to pixels: camera = turn · p + at.
[[gnu::target_clones("default", "arch=haswell")]] void project(const frame::Constants& c, const Mat3& turn,
                                                               const Vec3& at, const Vec3& light, Run& r) {
  const float m00 = turn(0, 0), m01 = turn(0, 1), m02 = turn(0, 2), m10 = turn(1, 0), m11 = turn(1, 1),
              m12 = turn(1, 2), m20 = turn(2, 0), m21 = turn(2, 1), m22 = turn(2, 2);
  const float tx = at.x(), ty = at.y(), tz = at.z(), lx = light.x(), ly = light.y(), lz = light.z();
  const float near = c.near, focal = c.focal, converge = c.converge, parallel = c.parallel,
              centre_x = c.centre_x, centre_y = c.centre_y;
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
    const float fa = focal / (converge * az + parallel), fb = focal / (converge * bz + parallel);
    r.ax[i] = ax, r.ay[i] = ay, r.az[i] = az, r.ra[i] = ra;
    r.bx[i] = bx, r.by[i] = by, r.bz[i] = bz, r.rb[i] = rb;
    r.px[i] = centre_x + fa * ax, r.py[i] = centre_y - fa * ay;
    r.qx[i] = centre_x + fb * bx, r.qy[i] = centre_y - fb * by;
    r.code_a[i] = depth_code(az), r.code_b[i] = depth_code(bz);
    r.width[i] = seen ? fa * ra + fb * rb : -1.f;
    r.mean_width[i] = r.mean_width[i] * (fa + fb);
    // The mean light of the half cylinder one sees: see draw_line in render/opengl/shaders/common.glsl.
    const float ex = -converge * (ax + bx), ey = -converge * (ay + by), ez = -(az + bz);
    const float per_length = 1.f / std::sqrt(larger(dx * dx + dy * dy + dz * dz, 1e-18f)),
                per_distance = 1.f / std::sqrt(ex * ex + ey * ey + ez * ez);
    const float along = (dx * lx + dy * ly + dz * lz) * per_length,
                end_on = (dx * ex + dy * ey + dz * ez) * per_length * per_distance,
                towards = (ex * lx + ey * ly + ez * lz) * per_distance;
    const float b = (towards - end_on * along) / std::sqrt(larger(1.f - end_on * end_on, 1e-4f));
    const float a2 = larger(0.f, 1.f - along * along - b * b);
    const float shade = .5f * std::sqrt(larger(0.f, 1.f + 1.5707963f * b + (a2 + 2.f * b * b) * (1.f / 3.f)));
    const float rank = fraction(r.rank[i]);
    r.rank[i] = rank;
    r.payload[i] = payload_of(r.entry[i], shade, fraction(rank * 7.f));
  }
}

// What draw_line needs, after draw_line in render/opengl/shaders/common.glsl.
[[gnu::target_clones("default", "arch=haswell")]] void prepare_lines(const frame::Constants& c, Run& r) {
  const std::size_t count = (r.count + 7) & ~std::size_t(7);
  const float width = float(c.width), height = float(c.height);
  const bool single = c.subframes == 1;
  for (std::size_t i = 0; i < count; ++i) {
    const float px = r.px[i], py = r.py[i], qx = r.qx[i], qy = r.qy[i], za = r.code_a[i], zb = r.code_b[i];
    const float dx = qx - px, dy = qy - py, wide = std::abs(dx), high = std::abs(dy);
    const bool steep = high > wide;
    const float major = steep ? high : wide;
    const float across = r.width[i] * (major > 0.f ? std::sqrt(dx * dx + dy * dy) / major : 1.f);
    const float of_branch = smaller(r.mean_width[i] * float(FOREST_MEAN_STRETCH), 1.f);
    const float fair = across < 1.f && r.mean_width[i] > 0.f ? of_branch : across;
    const float whole = std::floor(fair + 1.f - r.rank[i] - 1.f / 512.f);
    const float line = single ? whole : across;
    // From the end of the smaller coordinate to the other.
    const float ax = steep ? py : px, ay = steep ? px : py, bx = steep ? qy : qx, by = steep ? qx : qy;
    const bool turned = ax > bx;
    const float x0 = turned ? bx : ax, y0 = turned ? by : ay, z0 = turned ? zb : za;
    const float x1 = turned ? ax : bx, y1 = turned ? ay : by, z1 = turned ? za : zb;
    const float limit = steep ? height : width;
    const float first = smaller(larger(std::ceil(x0 - .5f), 0.f), limit),
                last = smaller(larger(std::ceil(x1 - .5f), 0.f), limit);
    const float inverse = 1.f / (x1 - x0), slope = (y1 - y0) * inverse, rise = (z1 - z0) * inverse;
    const float begin = first + .5f - x0, half = .5f * line;
    r.line_width[i] = r.width[i] >= 0.f && first < last ? line : 0.f;
    r.left[i] = smaller(px, qx) - half, r.right[i] = larger(px, qx) + half;
    r.top[i] = smaller(py, qy) - half, r.bottom[i] = larger(py, qy) + half;
    r.nearest[i] = smaller(za, zb);
    r.first[i] = first, r.last[i] = last;
    r.y[i] = y0 + begin * slope - .5f, r.slope[i] = slope;
    r.z[i] = z0 + begin * rise, r.rise[i] = rise;
    r.steep[i] = steep;
  }
}

// What a length at this depth is divided by to be seen.
float lens(const frame::Constants& c, float z) { return c.converge * z + c.parallel; }

// The whole number of `x`, cut at the edges of the picture: what stands right before the eye reaches far beyond all of them.
std::int32_t clipped(float x, float limit) { return std::int32_t(smaller(larger(x, 0.f), limit)); }

// As draw_line in render/opengl/shaders/common.glsl. Whether there was anything to draw.
bool draw_line(const Run& r, std::size_t i, auto& canvas) {
  if (!(r.line_width[i] > 0.f) || canvas.hidden(r.left[i], r.top[i], r.right[i], r.bottom[i], r.nearest[i]))
    return false;
  const bool steep = r.steep[i];
  const float half = .5f * r.line_width[i], slope = r.slope[i], rise = r.rise[i];
  const float limit_across = float(steep ? canvas.width() : canvas.height());
  const std::int32_t last = std::int32_t(r.last[i]);
  const std::uint32_t payload = r.payload[i];
  float y = r.y[i], z = r.z[i];
  for (std::int32_t x = std::int32_t(r.first[i]); x < last; ++x, y += slope, z += rise) {
    const std::int32_t low = clipped(std::ceil(y - half), limit_across),
                       end = clipped(std::ceil(y + half), limit_across);
    const std::uint32_t key = key_of(smaller(larger(z, 0.f), float(FOREST_DEPTH_MAX)), payload);
    for (std::int32_t across = low; across < end; ++across)
      steep ? canvas.put(across, x, key) : canvas.put(x, across, key);
  }
  return true;
}

// A thin capsule by its distance from the axis on screen: as draw_tube in render/opengl/shaders/capsule.glsl.
void draw_tube(const Picture& picture, const Run& r, std::size_t i, auto& canvas) {
  const frame::Constants& c = picture.constants;
  float px = r.px[i], py = r.py[i], qx = r.qx[i], qy = r.qy[i];
  float wp = c.focal * r.ra[i] / lens(c, r.az[i]), wq = c.focal * r.rb[i] / lens(c, r.bz[i]),
        za = r.code_a[i], zb = r.code_b[i];
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
  const Vec3 tangent = (b - a).normalized(),
             eye = -(a + b).cwiseProduct(Vec3(c.converge, c.converge, 1.f)).normalized();
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

// A tapered capsule as a ray meets it: the hull of two spheres, or the larger of them alone.
struct Body {
  Vec3 a, b, u;  // ends; axis, unit or zero
  float ra, rb, length, s, c2, cosine;
  bool nested;  // one sphere lies within the other

  Body(const Run& r, std::size_t i)
      : a(r.ax[i], r.ay[i], r.az[i]), b(r.bx[i], r.by[i], r.bz[i]), ra(r.ra[i]), rb(r.rb[i]) {
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

// The pixels of a tile that lie in one row.
constexpr std::int32_t lanes = std::int32_t(FOREST_TILE);
using Keys = std::array<std::uint32_t, lanes>;

// Every pixel meets the capsule with its own ray: as draw_capsule in render/opengl/shaders/capsule.glsl. Pixels that miss it
// get the key of none.
[[gnu::target_clones("default", "arch=haswell")]] void meet(const frame::Constants& c, const Vec3& light,
                                                            const Body& body, std::uint32_t entry,
                                                            std::int32_t first_x, std::int32_t y,
                                                            Keys& keys) {
  const float az = body.a.z(), bz = body.b.z(), ux = body.u.x(), uy = body.u.y(), uz = body.u.z(),
              lx = light.x(), ly = light.y(), lz = light.z();
  const float ra = body.ra, rb = body.rb, s = body.s, c2 = body.c2, cosine = body.cosine;
  const float begin = s * ra, end = body.length + s * rb;  // of the cone's surface, along the axis
  const float per_focal = 1.f / c.focal, near = c.near, converge = c.converge, parallel = c.parallel;
  const float above = (c.centre_y - float(y) - .5f) * per_focal, slope_y = converge * above;
  // From where the rays begin, which for an orthographic camera is beside the eye.
  const float ay = body.a.y() - parallel * above, by = body.b.y() - parallel * above;
  const float body_ax = body.a.x(), body_bx = body.b.x();
  const float from_x = .5f - c.centre_x, per_ra = 1.f / larger(ra, 1e-9f), per_rb = 1.f / larger(rb, 1e-9f);
  const std::int32_t cone = body.nested ? 0 : 1;
  const std::uint32_t subframe = c.subframe;
  for (std::int32_t lane = 0; lane < lanes; ++lane) {
    const std::int32_t x = first_x + lane;
    const float beside = (float(x) + from_x) * per_focal, slope_x = converge * beside;
    const float ax = body_ax - parallel * beside, bx = body_bx - parallel * beside;
    const float dz = 1.f / std::sqrt(slope_x * slope_x + slope_y * slope_y + 1.f), dx = slope_x * dz,
                dy = slope_y * dz;
    const float shift = ax * dx + ay * dy + az * dz;
    const float ox = shift * dx - ax, oy = shift * dy - ay, oz = shift * dz - az;
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
    const float shift_b = bx * dx + by * dy + bz * dz;
    const float qx = shift_b * dx - bx, qy = shift_b * dy - by, qz = shift_b * dz - bz;
    const float ha = ra * ra - o2, hb = rb * rb - (qx * qx + qy * qy + qz * qz);
    const float ta = shift - std::sqrt(larger(ha, 0.f)), tb = shift_b - std::sqrt(larger(hb, 0.f));
    const bool on_a = (ha >= 0.f) & (ta > 0.f), on_b = (hb >= 0.f) & (tb > 0.f);
    const bool take_b = on_b & (!on_a | (tb < ta));
    const float t_sphere = take_b ? tb : ta;
    const float facing_sphere =
        take_b ? ((tb * dx - bx) * lx + (tb * dy - by) * ly + (tb * dz - bz) * lz) * per_rb
               : ((ta * dx - ax) * lx + (ta * dy - ay) * ly + (ta * dz - az) * lz) * per_ra;
    const bool within = (cone == 0) | (root >= 0.f);  // the cone, within which both spheres lie
    const bool hit = on_cone | (within & (on_a | on_b));
    const float t = on_cone ? t_cone : t_sphere, facing = on_cone ? facing_cone : facing_sphere;
    const float code = depth_code(larger(t * dz, near));
    const std::uint32_t key = key_of(code, payload_of(entry, .5f + .5f * facing, noise_at(x, y, subframe)));
    keys[std::size_t(lane)] = hit ? key : FOREST_KEY_EMPTY;
  }
}

// Two discs of the picture and all between them: where a capsule is seen.
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

// The discs are exact where spheres are small beside their distance and not far from the middle of the picture.
Outline outline_of(const frame::Constants& c, const Run& r, std::size_t i, const Body& body) {
  const auto small = [&](const Vec3& p, float radius) {
    return c.parallel > 0.f || (radius < .25f * p.z() && p.squaredNorm() < 2.5f * p.z() * p.z());
  };
  const bool exact = small(body.a, body.ra) && small(body.b, body.rb);
  const auto reach = [&](const Vec3& p, float radius) {
    if (c.parallel > 0.f) return 1.f + c.focal * radius;
    return 1.f + c.focal * radius *
                     (exact ? p.norm() / (p.z() * (p.z() - radius))  // as scene/occlusion.cpp
                            : 1.05f / std::max(p.z() - .5f * radius, c.near));
  };
  return {{r.px[i], r.py[i]}, {r.qx[i], r.qy[i]}, reach(body.a, body.ra), reach(body.b, body.rb), exact};
}

void draw_capsule(const Picture& picture, const Run& r, std::size_t i, auto& canvas) {
  const frame::Constants& c = picture.constants;
  const Body body(r, i);
  const Outline outline = outline_of(c, r, i, body);
  const float width = float(canvas.width()), height = float(canvas.height());
  const std::int32_t first = clipped(std::floor(outline.top()), height),
                     last = clipped(std::ceil(outline.bottom()), height);
  const float thickest = std::max(body.ra, body.rb), from = 1.f / body.a.z(), to = 1.f / body.b.z();
  const auto scan = [&](std::int32_t y) {
    const float at = float(y) + .5f;
    const auto [left, right] = outline.across(at);
    if (!(left < right)) return;
    const auto [begin, end] = outline.part(at);
    const float depth = c.parallel > 0.f
                            ? std::min(body.a.z(), body.b.z())
                            : 1.f / std::max(from + begin * (to - from), from + end * (to - from));
    const std::uint32_t nearest = key_of(depth_code(std::max(depth * .9999f - thickest, c.near)), 0);
    const std::int32_t low = clipped(std::floor(left), width), high = clipped(std::ceil(right), width);
    Keys keys;
    for (std::int32_t x = low & -lanes; x < high; x += lanes) {
      if (canvas.before(x, y, nearest)) continue;
      meet(c, picture.light, body, r.entry[i], x, y, keys);
      for (std::int32_t k = std::max(low - x, 0); k < std::min(lanes, high - x); ++k)
        canvas.put(x + k, y, keys[std::size_t(k)]);
    }
  };
  constexpr std::int32_t shared = 128;  // rows from which on other threads help
  if (last - first >= shared)
    parallel_for(std::size_t(last - first), 16, [&](std::size_t k) { scan(first + std::int32_t(k)); });
  else
    for (std::int32_t y = first; y < last; ++y) scan(y);
}

bool draw_near(const Picture& picture, const Run& r, std::size_t i, auto& canvas) {
  const frame::Constants& c = picture.constants;
  if (r.width[i] < 0.f) return false;
  const float width = c.focal * std::max(r.ra[i] / lens(c, r.az[i]), r.rb[i] / lens(c, r.bz[i]));
  if (width < .75f) return draw_line(r, i, canvas);
  const float reach = 1.f + 1.05f * width;
  const float nearest = std::max(std::min(r.az[i] - r.ra[i], r.bz[i] - r.rb[i]), c.near);
  if (canvas.hidden(std::min(r.px[i], r.qx[i]) - reach, std::min(r.py[i], r.qy[i]) - reach,
                    std::max(r.px[i], r.qx[i]) + reach, std::max(r.py[i], r.qy[i]) + reach,
                    depth_code(nearest)) &&
      nearest > c.near)
    return false;
  const float distance = std::hypot(r.qx[i] - r.px[i], r.qy[i] - r.py[i]);
  if (2.f * width < tube_width && distance > .5f * width)
    draw_tube(picture, r, i, canvas);
  else
    draw_capsule(picture, r, i, canvas);
  return true;
}

// Small spheres: as render/opengl/shaders/dots.glsl.
void draw_dot(const Picture& picture, const Run& r, float rank, auto& canvas) {
  if (r.width[0] < 0.f) return;
  const frame::Constants& c = picture.constants;
  const float px = r.px[0], py = r.py[0], z = r.az[0], radius = c.focal * r.ra[0] / lens(c, z);
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

// The one segment of a dot.
void draw_beads(const Picture& picture, const frame::Item& item, const Mat3& turn, const Vec3& at,
                float depth, Run& r, Canvas& canvas) {
  const frame::Constants& c = picture.constants;
  const Beads beads(r, c.focal / lens(c, std::max(depth, c.near)));
  const float of_branch = (r.entry[0] & 7) == 1 ? 0.f : float(item.first_segment & 0xffff) * .5698403f;
  for (std::uint32_t k = 0; k < beads.count; ++k) {
    beads.put(k, r);
    project(c, turn, at, picture.light, r);
    const float rank = fraction(float(item.instance) * .7548777f + of_branch + float(k) * .3819660f +
                                golden * float(c.subframe));
    through(picture, r, 0, canvas, [&](auto& seen) { return draw_dot(picture, r, rank, seen), true; });
  }
}

}  // namespace

std::uint64_t splat(const Picture& picture, std::span<const frame::Item> items,
                    std::span<const std::uint8_t> entries, Kind kind, Canvas& canvas) {
  const frame::Constants& c = picture.constants;
  std::atomic<std::uint64_t> all = 0;
  parallel_ranges(items.size(), grain, [&](std::size_t begin, std::size_t end) {
    Run r{};
    std::uint64_t drawn = 0;
    for (std::size_t k = begin; k < end; ++k) {
      const frame::Item& item = items[k];
      if (!item.drawn) continue;
      if (k + ahead < end) prefetch(picture.geometry, items[k + ahead]);
      const Vec3 centre = picture.to_camera * (Vec3(item.x, item.y, item.z) - picture.eye);
      const float nearest = centre.z() - item.radius;
      if (nearest > c.near) {
        const float scale = c.focal / lens(c, centre.z());
        const float reach =
            c.focal * item.radius * (c.parallel + c.converge * centre.norm() / (centre.z() * nearest)) + 2.f;
        const float x = c.centre_x + scale * centre.x(), y = c.centre_y - scale * centre.y();
        if (canvas.hidden(x - reach, y - reach, x + reach, y + reach, depth_code(nearest))) continue;
      }
      const frame::Instance& instance = picture.geometry.instances[item.instance];
      const Mat3 turn =
          picture.to_camera * Quat(instance.qw, instance.qx, instance.qy, instance.qz).toRotationMatrix();
      const Vec3 at = picture.to_camera * (Vec3(instance.x, instance.y, instance.z) - picture.eye);
      load(picture, item, entries.empty() ? nullptr : &entries[kind == Kind::dots ? k : k * run], r);
      if (kind == Kind::dots) {
        draw_beads(picture, item, turn, at, centre.z(), r, canvas);
        ++drawn;
        continue;
      }
      project(c, turn, at, picture.light, r);
      switch (kind) {
        case Kind::lines:
          prepare_lines(c, r);
          for (std::size_t i = 0; i < r.count; ++i)
            if (r.line_width[i] > 0.f)
              drawn += through(picture, r, i, canvas, [&](auto& seen) { return draw_line(r, i, seen); });
          break;
        case Kind::capsules:
          prepare_lines(c, r);
          for (std::size_t i = 0; i < r.count; ++i)
            drawn +=
                through(picture, r, i, canvas, [&](auto& seen) { return draw_near(picture, r, i, seen); });
          break;
        case Kind::dots:
          break;
      }
    }
    all += drawn;
  });
  return all;
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
        return std::max(o.radius, lens(c, picture.to_camera.row(2).dot(p) + at.z()) / c.focal);
      };
      r.ra[0] = least(o.a), r.rb[0] = least(o.b);
      project(c, picture.to_camera, at, picture.light, r);
      prepare_lines(c, r);
      draw_near(picture, r, 0, canvas);
    }
  });
}

}  // namespace forest::render::cpu
