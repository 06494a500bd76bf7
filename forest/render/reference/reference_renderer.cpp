// SPDX-License-Identifier: Apache-2.0
#include "forest/render/reference/reference_renderer.h"

#include <algorithm>
#include <array>
#include <bit>
#include <chrono>
#include <cmath>
#include <numeric>

#include "forest/core/error.h"
#include "forest/core/half.h"
#include "forest/core/parallel.h"
#include "forest/core/srgb.h"
#include "forest/frame/constants.h"

namespace forest::render {
namespace {

using frame::Item;
using frame::Segment;

constexpr int lanes = 16;  // samples of a pixel that are met at once
// Plain loops over these become vector instructions; Eigen's select would not.
struct alignas(64) Lanes : std::array<float, lanes> {
  static Lanes constant(float value) {
    Lanes result;
    result.fill(value);
    return result;
  }
};
void root(Lanes& v) {
  using Row = Eigen::Map<Eigen::Array<float, lanes, 1>, Eigen::Aligned64>;
  Row(v.data()) = Row(v.data()).sqrt();
}

constexpr int tile = 8;                  // pixels; one thread draws a tile
constexpr std::size_t chunk = 1u << 18;  // segments projected at once

// The samples of one pixel: the depth of what is nearest (µm, infinite for nothing), how it is lit, its palette entry.
struct Pixel {
  Lanes depth = Lanes::constant(INFINITY), shade = Lanes::constant(0.f);
  std::array<std::uint8_t, lanes> entry{};
  float farthest = INFINITY;  // of the depths
};

// A tapered capsule before the camera (x right, y up, z depth), and all that a ray must know of it.
struct Capsule {
  Vec3 a, b, u;          // u: from a to b, unit
  float ra, rb, length;  // µm
  float s, c2;           // sine of half the cone's angle, cosine squared
  Vec3 moment;           // of the axis about the eye: a × u
  float p[2], q[2];      // pixels of a and b
  float reach;           // what lies further than this from the line p–q, in pixels, does not meet it
  float nearest;         // depth
  int left, right, top, bottom;  // pixels, [left, right) × [top, bottom)
  std::uint8_t entry;
  std::uint32_t opacity, key;  // 0–255, of a screen door; see frame/layout.h
};

// A triangle before the camera.
struct Facet {
  std::array<Vec3, 3> at, normal;
  std::array<float, 3> openness, opacity;
  std::array<std::uint8_t, 3> entry;
  float nearest;
  int left, right, top, bottom;  // as a Capsule's
  std::uint32_t key;             // of its surface's screen door
};

// One picture's camera.
struct Eye {
  Mat3 to_camera;
  Vec3 at;
  float focal, near, centre_x, centre_y;
  bool orthographic;
  int width, height;
  Vec3 light;

  explicit Eye(const frame::Frame& f)
      : at(f.camera.eye),
        focal(f.camera.focal(float(f.height))),
        near(f.camera.near),
        centre_x(.5f * float(f.width)),
        centre_y(.5f * float(f.height)),
        orthographic(f.camera.orthographic()),
        width(int(f.width)),
        height(int(f.height)),
        light(frame::light_direction()) {
    to_camera = f.camera.axes().transpose();
    to_camera.row(2) *= -1.f;
  }
  Vec3 seen(const Vec3& world) const { return to_camera * (world - at); }
  // Pixels that a µm covers at a depth.
  float scale(float depth) const { return orthographic ? focal : focal / depth; }
};

// The rectangle that a sphere covers, in pixels to the right of and below the centre; none when the eye is too near.
bool extent(const Eye& eye, const Vec3& c, float r, float& left, float& right, float& top, float& bottom) {
  if (eye.orthographic) {
    left = eye.focal * (c.x() - r), right = eye.focal * (c.x() + r);
    top = eye.focal * (-c.y() - r), bottom = eye.focal * (-c.y() + r);
    return true;
  }
  if (c.z() <= 1.001f * r) return false;
  const float scale = eye.focal / (c.z() * c.z() - r * r);
  const auto edge = [&](float across, float side) {
    return scale *
           (across * c.z() + side * r * std::sqrt(std::max(0.f, across * across + c.z() * c.z() - r * r)));
  };
  left = edge(c.x(), -1.f), right = edge(c.x(), 1.f);
  top = edge(-c.y(), -1.f), bottom = edge(-c.y(), 1.f);
  return true;
}

// False when nothing of it lies in the picture. It is cut at the near distance, as in the other renderers.
/// @param least  pixels: its radii are no smaller
bool project(const Eye& eye, Capsule& c, float least = 0.f) {
  if (c.a.z() < eye.near && c.b.z() < eye.near) return false;
  if (c.a.z() < eye.near || c.b.z() < eye.near) {
    const float t = (eye.near - c.a.z()) / (c.b.z() - c.a.z());
    const Vec3 cut = c.a + t * (c.b - c.a);
    const float r = c.ra + t * (c.rb - c.ra);
    if (c.a.z() < eye.near)
      c.a = cut, c.ra = r;
    else
      c.b = cut, c.rb = r;
  }
  c.ra = std::max(c.ra, least / eye.scale(c.a.z())), c.rb = std::max(c.rb, least / eye.scale(c.b.z()));
  const auto pixel = [&](const Vec3& v, float out[2]) {
    out[0] = eye.centre_x + eye.scale(v.z()) * v.x(), out[1] = eye.centre_y - eye.scale(v.z()) * v.y();
  };
  pixel(c.a, c.p);
  pixel(c.b, c.q);
  float la, ra, ta, ba, lb, rb, tb, bb;
  if (extent(eye, c.a, c.ra, la, ra, ta, ba) && extent(eye, c.b, c.rb, lb, rb, tb, bb)) {
    // A sample lies up to half a pixel beside the middle of its pixel.
    const auto whole = [](float v) { return int(std::floor(std::clamp(v, -1e6f, 1e6f))); };
    const auto low = [&](float centre, float x, float y) { return whole(centre + std::min(x, y)); };
    const auto high = [&](float centre, float x, float y) { return whole(centre + std::max(x, y)) + 1; };
    c.left = std::max(low(eye.centre_x, la, lb) - 1, 0);
    c.right = std::min(high(eye.centre_x, ra, rb) + 1, eye.width);
    c.top = std::max(low(eye.centre_y, ta, tb) - 1, 0);
    c.bottom = std::min(high(eye.centre_y, ba, bb) + 1, eye.height);
    const auto corner = [&](const float at[2], float l, float r, float t, float b) {
      const float x = at[0] - eye.centre_x, y = at[1] - eye.centre_y;
      return std::hypot(std::max(r - x, x - l), std::max(b - y, y - t));
    };
    c.reach = std::max(corner(c.p, la, ra, ta, ba), corner(c.q, lb, rb, tb, bb)) * 1.001f + .75f;
  } else {  // around the eye: anywhere
    c.left = c.top = 0, c.right = eye.width, c.bottom = eye.height;
    c.reach = INFINITY;
  }
  if (c.left >= c.right || c.top >= c.bottom) return false;
  c.nearest = std::max(std::min(c.a.z() - c.ra, c.b.z() - c.rb), 0.f);
  const float taper = c.ra - c.rb;
  c.length = (c.b - c.a).norm();
  const bool nested = c.length <= std::abs(taper) + 1e-6f;  // one sphere inside the other: no side
  c.u = nested ? Vec3(Vec3::Zero()) : Vec3((c.b - c.a) / c.length);
  c.s = nested ? 0.f : taper / c.length;
  c.c2 = nested ? 0.f : 1.f - c.s * c.s;
  c.moment = c.a.cross(c.u);
  return true;
}

// False when nothing of it lies in the picture.
bool project(const Eye& eye, Facet& f) {
  float left = INFINITY, right = -INFINITY, top = INFINITY, bottom = -INFINITY;
  f.nearest = INFINITY;
  bool cut = false, seen = false;
  for (const Vec3& p : f.at) {
    if (p.z() < eye.near) {
      cut = true;
      continue;
    }
    const float scale = eye.scale(p.z());
    left = std::min(left, scale * p.x()), right = std::max(right, scale * p.x());
    top = std::min(top, -scale * p.y()), bottom = std::max(bottom, -scale * p.y());
    f.nearest = std::min(f.nearest, p.z());
    seen = true;
  }
  if (!seen) return false;
  f.left = f.top = 0, f.right = eye.width, f.bottom = eye.height;
  if (cut) {  // it reaches the near distance: anywhere
    f.nearest = eye.near;
    return true;
  }
  const auto whole = [](float v, int limit) { return std::clamp(int(std::clamp(v, -1e6f, 1e6f)), 0, limit); };
  f.left = whole(eye.centre_x + left - 1.f, eye.width),
  f.right = whole(eye.centre_x + right + 2.f, eye.width);
  f.top = whole(eye.centre_y + top - 1.f, eye.height),
  f.bottom = whole(eye.centre_y + bottom + 2.f, eye.height);
  return f.left < f.right && f.top < f.bottom;
}

float distance_to_line(const Capsule& c, float x, float y) {
  const float dx = c.q[0] - c.p[0], dy = c.q[1] - c.p[1], square = dx * dx + dy * dy;
  const float t = square > 0.f ? std::clamp(((x - c.p[0]) * dx + (y - c.p[1]) * dy) / square, 0.f, 1.f) : 0.f;
  return std::hypot(x - c.p[0] - t * dx, y - c.p[1] - t * dy);
}

// Rays (x, y, 1) that begin at (from_x, from_y, 0): slopes of a perspective camera, beginnings of an orthographic one.
struct Rays {
  Lanes x = Lanes::constant(0.f), y = x, from_x = x, from_y = x;
};

// Lowers depth to where the rays enter a sphere.
void meet_sphere(const Vec3& centre, float radius, const Rays& rays, Lanes& depth) {
  Lanes shift, h, under;
  const Lanes &x = rays.x, &y = rays.y;
  for (std::size_t i = 0; i < lanes; ++i) {
    const float dd = x[i] * x[i] + y[i] * y[i] + 1.f;
    const float cx = centre.x() - rays.from_x[i], cy = centre.y() - rays.from_y[i];
    shift[i] = (x[i] * cx + y[i] * cy + centre.z()) / dd;  // the closest approach
    const float ox = shift[i] * x[i] - cx, oy = shift[i] * y[i] - cy, oz = shift[i] - centre.z();
    h[i] = radius * radius - ox * ox - oy * oy - oz * oz;
    under[i] = (h[i] > 0.f ? h[i] : 0.f) / dd;
  }
  root(under);
  for (std::size_t i = 0; i < lanes; ++i) {
    const float t = shift[i] - under[i];
    const bool hit = (h[i] >= 0.f) & (t > 0.f) & (t < depth[i]);
    depth[i] = hit ? t : depth[i];
  }
}

// The same for the side between the spheres. Returns whether a ray may still meet one of them: both lie within the
// infinite cone, and what enters by the side enters there first.
bool meet_side(const Capsule& c, const Rays& rays, Lanes& depth) {
  Lanes shift, ou, du, A, B, under, upper, t, along;
  const Lanes &x = rays.x, &y = rays.y;
  for (std::size_t i = 0; i < lanes; ++i) {
    const float dd = x[i] * x[i] + y[i] * y[i] + 1.f;
    const float gx = rays.from_x[i], gy = rays.from_y[i], ax = c.a.x() - gx, ay = c.a.y() - gy;
    shift[i] = (x[i] * ax + y[i] * ay + c.a.z()) / dd;  // start there, for precision far away
    const float ox = shift[i] * x[i] - ax, oy = shift[i] * y[i] - ay, oz = shift[i] - c.a.z();
    ou[i] = ox * c.u.x() + oy * c.u.y() + oz * c.u.z();
    du[i] = x[i] * c.u.x() + y[i] * c.u.y() + c.u.z();
    // What is across the axis of the start (p) and of the ray (d).
    const float px = ox - ou[i] * c.u.x(), py = oy - ou[i] * c.u.y(), pz = oz - ou[i] * c.u.z();
    const float dx = x[i] - du[i] * c.u.x(), dy = y[i] - du[i] * c.u.y(), dz = 1.f - du[i] * c.u.z();
    const float k0 = c.ra - c.s * ou[i], k1 = -c.s * du[i];
    A[i] = c.c2 * (dx * dx + dy * dy + dz * dz) - k1 * k1;
    B[i] = c.c2 * (px * dx + py * dy + pz * dz) - k0 * k1;
    // B² - A·C, without the difference of large numbers: by the moment of the axis about the ray.
    const float mx = k0 * dx - k1 * px, my = k0 * dy - k1 * py, mz = k0 * dz - k1 * pz;
    const float moment = (c.moment.x() - gy * c.u.z()) * x[i] + (c.moment.y() + gx * c.u.z()) * y[i] +
                         c.moment.z() - gx * c.u.y() + gy * c.u.x();
    under[i] = c.c2 * (mx * mx + my * my + mz * mz - c.c2 * moment * moment);
    upper[i] = under[i] > 0.f ? under[i] : 0.f;
  }
  root(upper);
  for (std::size_t i = 0; i < lanes; ++i) {
    const float local = (-B[i] - upper[i]) / A[i];
    along[i] = ou[i] + local * du[i];
    t[i] = local + shift[i];
  }
  const float from = c.s * c.ra, to = c.length + c.s * c.rb;
  int open = 0;
  for (std::size_t i = 0; i < lanes; ++i) {
    const bool inside = under[i] >= 0.f;
    const bool hit =
        inside & (std::abs(A[i]) > 1e-12f) & (along[i] >= from) & (along[i] <= to) & (t[i] > 0.f);
    depth[i] = hit ? t[i] : depth[i];
    open += inside & !hit;
  }
  return open > 0;
}

// Cosine between the light and the normal at a place of the capsule's surface.
float facing(const Capsule& c, const Vec3& place, const Vec3& light) {
  const auto on_sphere = [&](const Vec3& centre, float r) {
    return (place - centre).dot(light) / std::max(r, 1e-9f);
  };
  if (c.c2 <= 0.f) return c.ra >= c.rb ? on_sphere(c.a, c.ra) : on_sphere(c.b, c.rb);
  const Vec3 from_a = place - c.a;
  const float along = from_a.dot(c.u);
  if (along < c.s * c.ra) return on_sphere(c.a, c.ra);
  if (along > c.length + c.s * c.rb) return on_sphere(c.b, c.rb);
  const Vec3 across = from_a - along * c.u;
  return std::sqrt(c.c2) * across.dot(light) / std::max(across.norm(), 1e-9f) + c.s * c.u.dot(light);
}

// Where the rays (x, y, 1) enter the capsule, as geometry/round_cone.h but for sixteen rays, none of unit length: what
// is solved for is the depth itself.
// Only the samples whose bits are set in `shown` change.
void meet(const Capsule& c, const Rays& rays, const Eye& eye, std::uint32_t shown, Pixel& pixel) {
  Lanes depth = Lanes::constant(INFINITY);
  if (c.c2 <= 0.f || meet_side(c, rays, depth)) {
    meet_sphere(c.a, c.ra, rays, depth);
    meet_sphere(c.b, c.rb, rays, depth);
  }
  bool changed = false;
  for (std::size_t i = 0; i < lanes; ++i) {
    const float z = std::max(depth[i], eye.near);
    if (!(z < pixel.depth[i]) || !(shown >> i & 1)) continue;
    pixel.depth[i] = z;
    const Vec3 place = depth[i] * Vec3(rays.x[i], rays.y[i], 1.f) + Vec3(rays.from_x[i], rays.from_y[i], 0.f);
    pixel.shade[i] = std::clamp(.5f + .5f * facing(c, place, eye.light), 0.f, 1.f);
    pixel.entry[i] = c.entry;
    changed = true;
  }
  if (changed) pixel.farthest = *std::ranges::max_element(pixel.depth);
}

// Interleaved gradient noise (Jimenez 2014), which moves from subframe to subframe: as in the other renderers.
float noise_at(int x, int y, std::uint32_t subframe) {
  const auto fraction = [](float v) { return v - std::floor(v); };
  return fraction(52.9829189f * fraction(.06711056f * float(x) + .00583715f * float(y)) +
                  .61803399f * float(subframe));
}

// Draws sixteen samples of every pixel. `shift`: where in the pixel they lie.
class Canvas {
 public:
  /// @param first, last  the samples are subframes, from the first on; those beyond the last repeat it
  Canvas(const Eye& eye, const std::array<Vec2, lanes>& shift, std::uint32_t first, std::uint32_t last,
         std::uint32_t subframes)
      : eye_(eye),
        first_(first),
        last_(last),
        by_pixel_(subframes < FOREST_DOOR_SUBFRAMES),
        wide_((eye.width + tile - 1) / tile),
        tall_((eye.height + tile - 1) / tile),
        pixels_(std::size_t(eye.width) * std::size_t(eye.height)),
        farthest_(std::size_t(wide_) * std::size_t(tall_), INFINITY) {
    for (std::size_t i = 0; i < lanes; ++i) shift_x_[i] = shift[i].x(), shift_y_[i] = shift[i].y();
  }

  // Capsules or facets.
  template <class Primitive>
  void add(const std::vector<Primitive>& list) {
    // Which of them each tile has to draw.
    std::vector<std::uint32_t> begin(farthest_.size() + 1), next;
    const auto tiles_of = [&](const Primitive& c, const auto& visit) {
      for (int y = c.top / tile; y <= (c.bottom - 1) / tile; ++y)
        for (int x = c.left / tile; x <= (c.right - 1) / tile; ++x)
          if (const std::size_t at = std::size_t(y * wide_ + x); c.nearest < farthest_[at]) visit(at);
    };
    for (const Primitive& c : list) tiles_of(c, [&](std::size_t t) { ++begin[t + 1]; });
    std::partial_sum(begin.begin(), begin.end(), begin.begin());
    std::vector<std::uint32_t> drawn(begin.back());
    next = begin;
    for (std::size_t i = 0; i < list.size(); ++i)
      tiles_of(list[i], [&](std::size_t t) { drawn[next[t]++] = std::uint32_t(i); });
    parallel_for(farthest_.size(), 1, [&](std::size_t t) {
      if (begin[t] == begin[t + 1]) return;
      const int x = int(t) % wide_ * tile, y = int(t) / wide_ * tile;
      for (std::uint32_t i = begin[t]; i < begin[t + 1]; ++i) draw(list[drawn[i]], x, y);
      float farthest = 0.f;
      for (int row = y; row < std::min(y + tile, eye_.height); ++row)
        for (int column = x; column < std::min(x + tile, eye_.width); ++column)
          farthest = std::max(farthest, at(column, row).farthest);
      farthest_[t] = farthest;
    });
  }

  /// Adds the colours of the first `count` samples to sums.
  void resolve(const frame::Frame& f, std::size_t count, std::vector<Vec4>& sums) {
    const frame::Style& style = f.style;
    if (f.glass) {  // of the middle of the picture: samples are shifted below
      frame::Frame one = f;
      one.subframes = 1;
      glass_ = frame::constants_of(one, 0);
    }
    parallel_for(pixels_.size(), 4096, [&](std::size_t i) {  // depths as octaves, which halos compare
      for (float& d : pixels_[i].depth) d = std::log2(d);
    });
    parallel_for(std::size_t(eye_.height), 4, [&](std::size_t row) {
      const int y = int(row);
      const float down = (float(y) + .5f) / float(eye_.height);
      const Vec3 behind = style.background_top + down * (style.background_bottom - style.background_top);
      for (int x = 0; x < eye_.width; ++x) {
        const Pixel& pixel = at(x, y);
        Vec4& sum = sums[row * f.width + std::size_t(x)];
        for (std::size_t i = 0; i < count; ++i) {
          const float glass =
              f.glass ? frame::glass_depth(glass_, float(x) + .5f - shift_x_[i], float(y) + .5f - shift_y_[i])
                      : INFINITY;
          const auto tinted = [&](const Vec3& light) -> Vec3 {
            return light + f.glass->opacity * (f.glass->colour - light);
          };
          if (pixel.depth[i] == INFINITY) {
            sum.head<3>() += std::isfinite(glass) ? tinted(behind) : behind;
            continue;
          }
          const float z = std::exp2(pixel.depth[i]), shade = pixel.shade[i];
          const float fog = 1.f - std::exp(-std::max(0.f, z - style.fog_start) / style.fog_length);
          const Vec3 lit = f.palette[pixel.entry[i]] * (.16f + 1.05f * shade * shade) *
                           std::exp(-1.1f * style.halo * rim(x, y, i));
          const Vec3 seen = lit + fog * (style.fog_colour - lit);
          sum.head<3>() += glass < z ? tinted(seen) : seen;
          sum.w() += 1.f;
        }
      }
    });
  }

 private:
  Pixel& at(int x, int y) { return pixels_[std::size_t(y) * std::size_t(eye_.width) + std::size_t(x)]; }

  void draw(const Capsule& c, int x0, int y0) {
    for (int y = std::max(c.top, y0); y < std::min(c.bottom, y0 + tile); ++y)
      for (int x = std::max(c.left, x0); x < std::min(c.right, x0 + tile); ++x) {
        Pixel& pixel = at(x, y);
        const float px = float(x) + .5f, py = float(y) + .5f;
        if (c.nearest >= pixel.farthest || distance_to_line(c, px, py) > c.reach) continue;
        Rays rays;
        Lanes &ray_x = eye_.orthographic ? rays.from_x : rays.x,
              &ray_y = eye_.orthographic ? rays.from_y : rays.y;
        for (std::size_t i = 0; i < lanes; ++i) {
          ray_x[i] = (px - eye_.centre_x - shift_x_[i]) / eye_.focal;
          ray_y[i] = (eye_.centre_y + shift_y_[i] - py) / eye_.focal;
        }
        const auto place = std::uint32_t(y * eye_.width + x);
        meet(c, rays, eye_, shown(c, by_pixel_ ? frame::forest_mixed(place) : 0u), pixel);
      }
  }

  // Möller & Trumbore 1997, "Fast, minimum storage ray/triangle intersection".
  void draw(const Facet& f, int x0, int y0) {
    using Vec3d = Eigen::Vector3d;
    const Vec3d p = f.at[0].cast<double>(), along = f.at[1].cast<double>() - p,
                beside = f.at[2].cast<double>() - p;
    for (int y = std::max(f.top, y0); y < std::min(f.bottom, y0 + tile); ++y)
      for (int x = std::max(f.left, x0); x < std::min(f.right, x0 + tile); ++x) {
        Pixel& pixel = at(x, y);
        if (f.nearest >= pixel.farthest) continue;
        const auto place = std::uint32_t(y * eye_.width + x);
        bool changed = false;
        for (std::uint32_t i = 0; i < lanes; ++i) {
          const Vec3d slope((x + .5 - double(eye_.centre_x) - double(shift_x_[i])) / double(eye_.focal),
                            (double(eye_.centre_y) + double(shift_y_[i]) - y - .5) / double(eye_.focal), 1.);
          const Vec3d ray = eye_.orthographic ? Vec3d::UnitZ() : slope,
                      from = eye_.orthographic ? Vec3d(slope - ray) : Vec3d::Zero();
          const Vec3d across = ray.cross(beside);
          const double volume = along.dot(across);
          if (volume == 0.) continue;
          const Vec3d to = from - p, turned = to.cross(along);
          const double u = to.dot(across) / volume, v = ray.dot(turned) / volume,
                       z = beside.dot(turned) / volume;
          if (u < 0. || v < 0. || u + v > 1. || z < double(eye_.near) || !(float(z) < pixel.depth[i]))
            continue;
          // The camera's axes, with the depth away from the eye, are left-handed: a front's volume is negative.
          const bool front = volume < 0.;
          const std::uint32_t subframe = std::min(first_ + i, last_ - 1);
          const float b = float(u), c = float(v), a = 1.f - b - c;
          const auto opacity = std::uint32_t(a * f.opacity[0] + b * f.opacity[1] + c * f.opacity[2] + .5f);
          if (opacity < 255 &&
              !frame::forest_shows(opacity, frame::forest_side_key(f.key, front, place), subframe))
            continue;
          const Vec3 normal = a * f.normal[0] + b * f.normal[1] + c * f.normal[2];
          const float facing = normal.dot(eye_.light) / std::max(normal.norm(), 1e-9f);
          pixel.depth[i] = float(z);
          pixel.shade[i] = std::clamp((a * f.openness[0] + b * f.openness[1] + c * f.openness[2]) *
                                          (.5f + (front ? .5f : -.5f) * facing),
                                      0.f, 1.f);
          const float pick = noise_at(x + 37, y + 11, subframe);
          pixel.entry[i] = f.entry[pick < a ? 0 : pick < a + b ? 1 : 2];
          changed = true;
        }
        if (changed) pixel.farthest = *std::ranges::max_element(pixel.depth);
      }
  }

  // The samples in which a capsule shows.
  std::uint32_t shown(const Capsule& c, std::uint32_t pixel) const {
    if (c.opacity == 255) return ~0u;
    std::uint32_t bits = 0;
    for (std::uint32_t i = 0; i < lanes; ++i)
      bits |= std::uint32_t(frame::forest_shows(c.opacity, c.key ^ pixel, std::min(first_ + i, last_ - 1)))
              << i;
    return bits;
  }

  // The share of the pixels around in which something nearer stands (after eye-dome lighting, Boucheny 2009).
  float rim(int x, int y, std::size_t lane) {
    constexpr int ring[8][2] = {{1, 0}, {-1, 0}, {0, 1}, {0, -1}, {2, 2}, {-2, 2}, {2, -2}, {-2, -2}};
    const float here = at(x, y).depth[lane];
    float sum = 0.f;
    for (const auto& [dx, dy] : ring) {
      const Pixel& other = at(std::clamp(x + dx, 0, eye_.width - 1), std::clamp(y + dy, 0, eye_.height - 1));
      sum += std::clamp((here - other.depth[lane]) * 40.f, 0.f, 1.f);
    }
    return sum / 8.f;
  }

  const Eye& eye_;
  std::uint32_t first_, last_;
  bool by_pixel_;
  int wide_, tall_;  // in tiles
  Lanes shift_x_, shift_y_;
  std::vector<Pixel> pixels_;
  std::vector<float> farthest_;  // depth in each tile
  frame::Constants glass_{};
};

}  // namespace

frame::Timing ReferenceRenderer::draw(const frame::Frame& f) {
  frame::check(f, geometry_);
  const auto start = std::chrono::steady_clock::now();
  const Eye eye(f);
  if (f.first_subframe == 0 || width_ != f.width || height_ != f.height) {
    sums_.assign(std::size_t(f.width) * f.height, Vec4::Zero());
    samples_ = 0;
  }
  width_ = f.width, height_ = f.height, exposure_ = f.style.exposure;

  // From near to far, so that what is hidden is found early.
  struct Drawn {
    const Item* item;
    const std::uint8_t* entries;  // of its segments; null: its colour class says
  };
  std::vector<Drawn> items;
  const auto add_list = [&](std::span<const Item> list, std::span<const std::uint8_t> entries,
                            std::size_t each) {
    for (std::size_t i = 0; i < list.size(); ++i)
      items.push_back({&list[i], entries.empty() ? nullptr : &entries[i * each]});
  };
  const auto add = [&](const frame::Lists& lists) {
    add_list(lists.dots, lists.entries.dots, 1);
    add_list(lists.lines, lists.entries.lines, frame::cluster_size);
    add_list(lists.capsules, lists.entries.capsules, frame::cluster_size);
  };
  add(f);
  if (f.rest) {
    const frame::Lists rest = f.rest({}, 0);  // all of it
    frame::check(rest, geometry_);
    add(rest);
  }
  const auto depth = [&](const Drawn& d) {
    return eye.to_camera.row(2).dot(Vec3(d.item->x, d.item->y, d.item->z) - eye.at);
  };
  std::ranges::stable_sort(items, {}, depth);

  const auto capsule_of = [&](const Drawn& drawn, std::uint32_t index, Capsule& c) {
    const Item& item = *drawn.item;
    const Segment& s = geometry_.segments[item.first_segment + index];
    const bool straw = geometry_.straw(item);
    const std::uint32_t instance =
        straw ? geometry_.owner(item.first_segment + index).instance : item.instance;
    const frame::Instance i = straw ? frame::Instance{0, 0, 0, 0, 0, 0, 0, 1} : geometry_.instances[instance];
    const Quat turn(i.qw, i.qx, i.qy, i.qz);
    const Vec3 at(i.x, i.y, i.z);
    c.a = eye.seen(at + turn * Vec3(s.ax, s.ay, s.az));
    c.b = eye.seen(at + turn * Vec3(s.bx, s.by, s.bz));
    c.ra = from_half(s.radii), c.rb = from_half(s.radii >> 16);
    const frame::State state = item.state ? frame::unpacked(item.state) : f.states[instance];
    c.entry = std::uint8_t(state.colour_class * 8u + (s.meta & 7u));
    c.opacity = (state.opacity * f.opacities[c.entry] + 127u) / 255u;
    c.key = frame::forest_branch_key(instance, s.meta);
    if (drawn.entries) c.entry = drawn.entries[index];
    return c.opacity > 0 && project(eye, c, straw ? 0.f : .5f * f.least_width);
  };

  std::vector<Facet> facets;
  for (std::size_t k = 0; k < f.surfaces.size(); ++k) {
    const frame::Surface& surface = f.surfaces[k];
    Mat3 turn = eye.to_camera;
    Vec3 at = Vec3::Zero();
    if (surface.instance != frame::Surface::in_world) {
      const frame::Instance& i = geometry_.instances[surface.instance];
      turn = turn * Quat(i.qw, i.qx, i.qy, i.qz).toRotationMatrix();
      at = {i.x, i.y, i.z};
    }
    at = eye.seen(at);
    for (const Triangle& triangle : surface.triangles) {
      Facet facet;
      for (std::size_t i = 0; i < 3; ++i) {
        const std::size_t vertex = triangle[i];
        facet.at[i] = turn * surface.positions[vertex] + at;
        facet.normal[i] = turn * surface.normals[vertex];
        facet.openness[i] = surface.openness.empty() ? 1.f : float(surface.openness[vertex]) / 255.f;
        facet.opacity[i] = float(surface.opacity) *
                           (surface.presence.empty() ? 1.f : float(surface.presence[vertex]) / 255.f);
        facet.entry[i] = surface.entries[vertex];
      }
      facet.key = frame::forest_surface_key(frame::door_number(f.surfaces, k), surface.instance);
      if (surface.opacity > 0 && project(eye, facet)) facets.push_back(facet);
    }
  }

  const std::uint32_t last = std::min(f.last_subframe, f.subframes);
  for (std::uint32_t first = f.first_subframe; first < last; first += lanes) {
    std::array<Vec2, lanes> shift;
    for (std::uint32_t i = 0; i < lanes; ++i)
      shift[i] = frame::sample_place(std::min(first + i, last - 1), f.subframes);
    Canvas canvas(eye, shift, first, last, f.subframes);
    canvas.add(facets);
    std::vector<Capsule> capsules;
    for (std::size_t from = 0; from < items.size();) {
      std::size_t to = from, segments = 0;
      std::vector<std::size_t> place;
      for (; to < items.size() && segments < chunk;
           segments += std::size_t(std::popcount(items[to++].item->drawn)))
        place.push_back(segments);
      capsules.resize(segments);
      std::vector<char> in_sight(segments);
      parallel_for(to - from, 64, [&](std::size_t i) {
        std::size_t at = place[i];
        for (std::uint32_t drawn = items[from + i].item->drawn; drawn; drawn &= drawn - 1, ++at)
          in_sight[at] = capsule_of(items[from + i], std::uint32_t(std::countr_zero(drawn)), capsules[at]);
      });
      std::size_t kept = 0;
      for (std::size_t i = 0; i < segments; ++i)
        if (in_sight[i]) capsules[kept++] = capsules[i];
      capsules.resize(kept);
      canvas.add(capsules);
      from = to;
    }
    capsules.clear();
    for (const frame::Overlay& o : f.overlays) {
      Capsule c{};
      c.a = eye.seen(o.a), c.b = eye.seen(o.b);
      c.ra = std::max(o.radius, 1.f / eye.scale(c.a.z())),
      c.rb = std::max(o.radius, 1.f / eye.scale(c.b.z()));
      c.entry = std::uint8_t(o.colour);
      c.opacity = 255;
      if (project(eye, c)) capsules.push_back(c);
    }
    for (std::uint32_t i = 0; i < f.balls.size(); ++i) {
      const frame::Ball& ball = f.balls[i];
      Capsule c{};
      c.a = c.b = eye.seen(ball.centre);
      c.ra = c.rb = ball.radius;
      c.entry = ball.colour;
      c.opacity = ball.opacity, c.key = frame::ball_key(i);
      if (c.opacity > 0 && c.a.z() > eye.near && project(eye, c)) capsules.push_back(c);
    }
    canvas.add(capsules);
    canvas.resolve(f, std::min<std::uint32_t>(lanes, last - first), sums_);
  }
  samples_ += last - f.first_subframe;
  return {.draw = std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start).count(),
          .resolve = 0.};
}

frame::Image ReferenceRenderer::read() {
  frame::Image image{width_, height_, std::vector<std::uint8_t>(sums_.size() * 4)};
  double covered = 0.;
  for (std::size_t i = 0; i < sums_.size(); ++i) {
    const Vec4 mean = sums_[i] / float(std::max(samples_, 1u));
    for (int c = 0; c < 3; ++c)
      image.pixels[4 * i + std::size_t(c)] =
          std::uint8_t(255.f * to_srgb(std::clamp(mean[c] * exposure_, 0.f, 1.f)) + .5f);
    image.pixels[4 * i + 3] = 255;
    covered += double(mean.w());
  }
  image.covered = covered / double(std::max<std::size_t>(1, sums_.size()));
  return image;
}

}  // namespace forest::render
