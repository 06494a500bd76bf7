// SPDX-License-Identifier: Apache-2.0
// Lines, tubes, capsules and dots: what a window shows of segments that lie on the picture already. They are the same as the
// shaders of render/opengl draw.
#pragma once

#include <algorithm>
#include <cmath>
#include <optional>

#include "forest/frame/constants.h"
#include "forest/render/cpu/capsule.h"
#include "forest/render/cpu/run.h"
#include "forest/render/cpu/window.h"

namespace forest::render::cpu {

/// A rectangle of pixels.
struct Box {
  float left, top, right, bottom;
};

/// A line.
struct Stroke {
  float y, slope, z, rise;    // at the first step, along the axis of the screen that it runs along more
  float half;                 // of its width, across
  float begin, length;        // as Run's
  float rank;                 // in [0, 1)
  float lit_side, lit_front;  // as Run's
  std::int16_t first, last;   // steps, within the picture
  std::uint16_t payload;      // entry << 5 | its mean shade
  std::uint8_t opacity, steep;
  std::uint32_t key;                      // of its door
  std::uint32_t nearest;                  // key of its nearest depth
  std::int16_t left, top, right, bottom;  // tiles

  Stroke(const Run& r, std::size_t i)
      : y(r.y[i]),
        slope(r.slope[i]),
        z(r.z[i]),
        rise(r.rise[i]),
        half(.5f * r.line_width[i]),
        begin(r.begin[i]),
        length(r.length[i]),
        rank(r.rank[i]),
        lit_side(r.lit_side[i]),
        lit_front(r.lit_front[i]),
        first(std::int16_t(r.first[i])),
        last(std::int16_t(r.last[i])),
        payload(std::uint16_t(r.payload[i])),
        opacity(std::uint8_t(r.opacity[i])),
        steep(std::uint8_t(r.steep[i])),
        key(r.key[i]),
        nearest(r.nearest[i]),
        left(std::int16_t(r.tile_left[i])),
        top(std::int16_t(r.tile_top[i])),
        right(std::int16_t(r.tile_right[i])),
        bottom(std::int16_t(r.tile_bottom[i])) {}
  // Codes of the depths of its ends.
  float code_a() const { return z - begin * rise; }
  float code_b() const { return z + (length - begin) * rise; }
  float nearest_code() const { return larger(smaller(code_a(), code_b()), 0.f); }
};

/// A capsule whose surface is seen.
struct Solid {
  Vec3 a, b;  // in camera coordinates
  float ra, rb, px, py, qx, qy, code_a, code_b;
  float reach,
      nearest;  // pixels around both ends; code of its nearest depth, 0 where it may reach before the near distance
  std::uint8_t entry, opacity;
  std::uint32_t key;

  Solid(const Run& r, std::size_t i)
      : a(r.ax[i], r.ay[i], r.az[i]),
        b(r.bx[i], r.by[i], r.bz[i]),
        ra(r.ra[i]),
        rb(r.rb[i]),
        px(r.px[i]),
        py(r.py[i]),
        qx(r.qx[i]),
        qy(r.qy[i]),
        code_a(r.code_a[i]),
        code_b(r.code_b[i]),
        reach(r.reach[i]),
        nearest(r.front[i]),
        entry(std::uint8_t(r.entry[i])),
        opacity(std::uint8_t(r.opacity[i])),
        key(r.key[i]) {}
  Box box(float spread) const {
    const float all = reach + margin_of(spread);
    return {std::min(px, qx) - all, std::min(py, qy) - all, std::max(px, qx) + all, std::max(py, qy) + all};
  }
  float nearest_code() const { return nearest; }
};

/// A small sphere.
struct Dot {
  float px, py, z, radius, pixels, code, rank;  // its radius in µm and in pixels
  std::uint8_t entry, opacity;
  std::uint32_t key;
  float nearest = 0.f;  // code of a depth before which nothing of it lies

  Dot(const frame::Constants& c, const Run& r, float first_rank)
      : px(r.px[0]),
        py(r.py[0]),
        z(r.az[0]),
        radius(r.ra[0]),
        pixels(c.focal * r.ra[0] / lens(c, r.az[0])),
        code(r.code_a[0]),
        rank(first_rank),
        entry(std::uint8_t(r.entry[0])),
        opacity(std::uint8_t(r.opacity[0])),
        key(r.key[0]) {}
  /// @param at  before the camera, behind the near distance
  Dot(const frame::Constants& c, const frame::Ball& ball, const Vec3& at, std::uint32_t number)
      : px(c.centre_x + c.focal * at.x() / lens(c, at.z())),
        py(c.centre_y - c.focal * at.y() / lens(c, at.z())),
        z(at.z()),
        radius(ball.radius),
        pixels(c.focal * ball.radius / lens(c, at.z())),
        code(depth_code(at.z())),
        rank(fraction(frame::ball_rank(number) + golden * float(c.subframe))),
        entry(ball.colour),
        opacity(ball.opacity),
        key(frame::ball_key(number)),
        nearest(depth_code(std::max(at.z() - ball.radius, c.near))) {}
  Box box(float spread) const {
    const float reach = std::max(pixels, 1.f) + spread;
    return {px - reach, py - reach, px + reach, py + reach};
  }
  float nearest_code() const { return nearest; }
};

inline constexpr float tube_width =
    7.f;  // pixels; below, a capsule is shaded by its distance from the axis on screen

// The whole number of `x`, cut at the edges of a window: what stands right before the eye reaches far beyond all of them.
inline std::int32_t clipped(float x, std::int32_t low, std::int32_t high) {
  return std::int32_t(smaller(larger(x, float(low)), float(high)));
}

// The edges of a window along and across the axis of the screen that something runs along more.
struct Edges {
  std::int32_t first, last, low, high;
  Edges(const Square& s, bool steep)
      : first(steep ? s.top : s.left),
        last(steep ? s.bottom : s.right),
        low(steep ? s.left : s.top),
        high(steep ? s.right : s.bottom) {}
};

/// Lines, as the pixels across each of their steps, of which many are gathered before any is drawn: how many there are of a line
/// no processor foresees. As draw_line in render/opengl/shaders/common.glsl.
template <int S>
class Rows {
 public:
  explicit Rows(const Samples<S>& samples) : samples_(samples) {}

  [[gnu::always_inline]] void add(const Stroke& r, auto& window) {
    const bool steep = r.steep;
    const Edges edges(window.square(), steep);
    const float half = r.half, slope = r.slope, rise = r.rise, y = r.y, z = r.z, start = r.begin;
    const std::int32_t first = r.first, begin = std::max(first, edges.first),
                       end = std::min(std::int32_t(r.last), edges.last);
    const float nearest = r.nearest_code(),
                farthest = smaller(larger(r.code_a(), r.code_b()), float(FOREST_DEPTH_MAX));
    const std::uint32_t payload = S == 1 ? r.payload : r.payload & ~31u;
    const auto [least, most] = samples_.beside(steep, slope);
    const float per_half = 1.f / half;
    std::uint32_t line = line_of(r, per_half, window);
    constexpr std::int32_t at_once = 16;  // steps
    for (std::int32_t from = begin; from < end; from += at_once) {
      float beside[at_once], at[at_once];
      std::int32_t low[at_once], high[at_once];
      std::uint32_t key[at_once];
      FOREST_LANES
      for (int i = 0; i < at_once; ++i) {
        const float steps = float(from + i - first), middle = y + steps * slope;
        low[i] = clipped(std::ceil(middle + least - half), edges.low, edges.high);
        high[i] = clipped(std::ceil(middle + most + half), edges.low, edges.high);
        beside[i] = (float(low[i]) - middle) * per_half;
        at[i] = start + steps;
        key[i] = key_of(smaller(larger(z + steps * rise, nearest), farthest), payload);
      }
      const std::int32_t count = std::min(at_once, end - from);
      for (std::int32_t i = 0; i < count; ++i) {
        if (count_ > most_rows - most_across) draw(window), line = line_of(r, per_half, window);
        std::int32_t row = low[i];
        float middle = beside[i];
        const auto put = [&] __attribute__((always_inline)) {
          rows_[count_] = {window.place(steep, from + i, row), key[i], middle, at[i], line};
          count_ += row < high[i];
          ++row, middle += per_half;
        };
        // Most have one or two: both are written, and count if they are there.
        put(), put();
        while (row < high[i]) put();
      }
    }
  }

  [[gnu::always_inline]] void draw(auto& window) {
    if (count_ > 0)
      for (std::uint32_t n = 0; n < ahead; ++n) rows_[count_ + n].place = rows_[0].place;
    for (std::uint32_t n = 0; n < count_; ++n) {
      const Row& row = rows_[n];
      const std::uint32_t key = row.key;
      window.fetch(rows_[n + ahead].place);
      Keys<S> keys;
      if constexpr (S == 1) {
        keys[0] = key;
      } else {
        const Line& line = lines_[row.line];
        const float middle = row.middle, at = row.at, side = line.side, front = line.front;
        FOREST_LANES
        for (int k = 0; k < S; ++k) {
          const float t = middle - line.beside[k], h = 1.f - t * t;
          const float shade = line.rounding[k] + t * side + std::sqrt(larger(h, 0.f)) * front;
          std::int32_t level = std::int32_t(shade);
          level = level < 0 ? 0 : level;
          level = level > 31 ? 31 : level;
          const bool covered = (h > 0.f) & (at >= line.begin[k]) & (at < line.end[k]);
          keys[k] = covered ? key | std::uint32_t(level) : FOREST_KEY_EMPTY;
        }
      }
      window.put(row.place, keys);
    }
    drawn_ += count_;
    count_ = line_count_ = 0;
  }
  /// So many since they were forgotten.
  std::uint32_t count() const { return drawn_ + count_; }
  void forget() { drawn_ = 0; }

 private:
  static constexpr std::uint32_t most_rows = 384, most_lines = 64,
                                 most_across = Canvas::most_across + 2,  // of a step, and two that may not be
      ahead = 12;                                                        // of which places are fetched
  struct Row {
    std::uint32_t place, key;
    float middle, at;  // its middle beside the line's, in halves of the width; from the line's end
    std::uint32_t line;
  };
  struct alignas(64) Line {
    float beside[S], begin[S], end[S], rounding[S];  // at each sample, as Row's; what shades are rounded by
    float side, front;                               // light, in shades
  };
  const Samples<S>& samples_;
  std::uint32_t count_ = 0, line_count_ = 0, drawn_ = 0;
  Row rows_[most_rows + ahead];
  Line lines_[most_lines];

  [[gnu::always_inline]] std::uint32_t line_of(const Stroke& r, float per_half, auto& window) {
    if (line_count_ == most_lines) draw(window);
    if constexpr (S > 1) set(lines_[line_count_], r, per_half);
    return line_count_++;
  }
  [[gnu::always_inline]] void set(Line& line, const Stroke& r, float per_half) const {
    const bool steep = r.steep;
    const float *along = steep ? samples_.y : samples_.x, *across = steep ? samples_.x : samples_.y;
    const float rank = r.rank * 7.f, slope = r.slope, length = r.length;
    FOREST_LANES
    for (int k = 0; k < S; ++k) {
      line.beside[k] = (across[k] - slope * along[k]) * per_half;
      line.begin[k] = along[k];
      line.end[k] = along[k] + length;
      line.rounding[k] = 15.5f + fraction(rank + samples_.turn[k]);
    }
    line.side = 31.f * r.lit_side, line.front = 31.f * r.lit_front;
  }
};

template <int S>
[[gnu::always_inline]] inline void draw(const Picture&, const Samples<S>& samples, const Stroke& r,
                                        auto& window) {
  Rows<S> rows(samples);
  rows.add(r, window);
  rows.draw(window);
}

// A thin capsule by its distance from the axis on screen: as draw_tube in render/opengl/shaders/capsule.glsl.
template <int S>
[[gnu::always_inline]] inline void draw_tube(const Picture& picture, const Samples<S>& samples,
                                             const Solid& r, auto& window) {
  const frame::Constants& c = picture.constants;
  float px = r.px, py = r.py, qx = r.qx, qy = r.qy;
  float wp = c.focal * r.ra / lens(c, r.a.z()), wq = c.focal * r.rb / lens(c, r.b.z()), za = r.code_a,
        zb = r.code_b;
  constexpr float octave = 1.442695f * float(FOREST_DEPTH_STEPS);
  const float bulge = octave * std::max(r.ra / r.a.z(), r.rb / r.b.z());
  const bool steep = std::abs(qy - py) > std::abs(qx - px);
  if (steep) std::swap(px, py), std::swap(qx, qy);
  if (px > qx) std::swap(px, qx), std::swap(py, qy), std::swap(wp, wq), std::swap(za, zb);
  const float dx = qx - px, per_dx = 1.f / dx, slope = (qy - py) / dx,
              stretch = std::sqrt(1.f + slope * slope);
  const Edges edges(window.square(), steep);
  const float over = .4f * std::min(wp, wq), spread = picture.spread;
  const std::int32_t first = clipped(std::ceil(px - over - .5f - spread), edges.first, edges.last),
                     last = clipped(std::ceil(qx + over - .5f + spread), edges.first, edges.last);
  const Vec3 &a = r.a, &b = r.b;
  const Vec3 tangent = (b - a).normalized(),
             eye = -(a + b).cwiseProduct(Vec3(c.converge, c.converge, 1.f)).normalized();
  const Vec3 facing = (eye - eye.dot(tangent) * tangent).normalized();
  Vec3 side = tangent.cross(facing);
  if ((steep ? side.x() : -side.y()) < 0.f) side = -side;
  const float lit_side = .5f * side.dot(picture.light), lit_front = .5f * facing.dot(picture.light);
  const float *along = steep ? samples.y : samples.x, *across = steep ? samples.x : samples.y;
  const float reach = std::max(wp, wq) * stretch + spread * (1.f + std::abs(slope));
  const std::uint32_t entry = r.entry, subframe = c.subframe;
  const auto share_at = [&](float step) __attribute__((always_inline)) {
    return smaller(larger(step * per_dx, 0.f), 1.f);
  };
  for (std::int32_t x = first; x < last; ++x) {
    const float column = float(x) + .5f - px, middle = py + slope * column;
    const std::int32_t low = clipped(std::ceil(middle - reach - .5f), edges.low, edges.high),
                       high = clipped(std::ceil(middle + reach - .5f), edges.low, edges.high);
    if constexpr (S == 1) {  // pixels across, beside one another
      constexpr std::int32_t lanes = 8;
      const float share = share_at(column), inverse = 1.f / ((wp + share * (wq - wp)) * stretch),
                  z = za + share * (zb - za);
      for (std::int32_t y = low; y < high; y += lanes) {
        const std::int32_t count = std::min(lanes, high - y);
        std::uint32_t keys[lanes];
        FOREST_LANES
        for (int k = 0; k < lanes; ++k) {
          const float t = (float(y + k) + .5f - middle) * inverse, h = std::sqrt(larger(1.f - t * t, 0.f));
          const float noise = noise_at(steep ? y + k : x, steep ? x : y + k, subframe);
          const std::uint32_t payload = payload_of(entry, .5f + t * lit_side + h * lit_front, noise);
          const std::uint32_t key = key_of(larger(z - bulge * h, 0.f), payload);
          keys[k] = (t >= -1.f) & (t < 1.f) ? key : FOREST_KEY_EMPTY;
        }
        for (std::int32_t k = 0; k < count; ++k)
          steep ? window.put(y + k, x, {keys[k]}) : window.put(x, y + k, {keys[k]});
      }
    } else {
      float centre[S], inverse[S], depth[S];
      std::uint32_t within[S];
      FOREST_LANES
      for (int k = 0; k < S; ++k) {
        const float step = column - along[k], share = share_at(step);
        centre[k] = py + across[k] + slope * step;
        inverse[k] = 1.f / ((wp + share * (wq - wp)) * stretch);
        depth[k] = za + share * (zb - za);
        within[k] = (step >= -over) & (step < dx + over);
      }
      for (std::int32_t y = low; y < high; ++y) {
        const std::int32_t at_x = steep ? y : x, at_y = steep ? x : y;
        const float noise = noise_at(at_x, at_y, subframe);
        Keys<S> keys;
        FOREST_LANES
        for (int k = 0; k < S; ++k) {
          const float t = (float(y) + .5f - centre[k]) * inverse[k], h = std::sqrt(larger(1.f - t * t, 0.f));
          const bool covered = (within[k] != 0) & (t >= -1.f) & (t < 1.f);
          const std::uint32_t payload =
              payload_of(entry, .5f + t * lit_side + h * lit_front, fraction(noise + samples.turn[k]));
          keys[k] = covered ? key_of(larger(depth[k] - bulge * h, 0.f), payload) : FOREST_KEY_EMPTY;
        }
        window.put(at_x, at_y, keys);
      }
    }
  }
}

template <int S>
[[gnu::always_inline]] inline void draw_capsule(const Picture& picture, const Samples<S>& samples,
                                                const Solid& r, auto& window) {
  constexpr std::int32_t lanes = std::int32_t(FOREST_TILE);
  const frame::Constants& c = picture.constants;
  const Body body(r.a, r.b, r.ra, r.rb);
  const Vec2 p(r.px, r.py), q(r.qx, r.qy);
  const bool whole = Silhouette::fits(c, body);
  std::optional<Silhouette> silhouette;
  if (whole) silhouette.emplace(c, picture.light, body, p, q);
  const auto meet_row = [&](const float* x, float y, Hits<lanes>& hits) __attribute__((always_inline)) {
    if (whole) return silhouette->meet<lanes>(x, y, c.near, hits);
    float ys[lanes];
    for (float& one : ys) one = y;
    meet(c, picture.light, body, x, ys, hits);
  };
  const Outline outline = outline_of(c, picture.spread, p, q, body), inner = inner_outline_of(c, p, q, body);
  const Square& s = window.square();
  const std::int32_t first = clipped(std::floor(outline.top()), s.top, s.bottom),
                     last = clipped(std::ceil(outline.bottom()), s.top, s.bottom);
  // An even surface's inverse depth changes evenly over the picture.
  const float thickest = std::max(body.ra, body.rb), per_z = 1.f / std::min(body.a.z(), body.b.z()),
              from = c.parallel > 0.f ? per_z : 1.f / body.a.z(),
              to = c.parallel > 0.f ? per_z : 1.f / body.b.z();
  const std::uint32_t entry = r.entry, subframe = c.subframe;
  for (std::int32_t top = first; top < last; top += rows_at_once) {
    Outline::Rows rows, inner_rows;
    outline.across(float(top) + .5f, rows);
    if constexpr (S > 1) inner.across(float(top) + .5f, inner_rows);
    std::uint32_t nearest[rows_at_once];
    FOREST_LANES
    for (int k = 0; k < rows_at_once; ++k) {
      float begin, end;
      outline.part(float(top + k) + .5f, begin, end);
      const float depth = 1.f / larger(from + begin * (to - from), from + end * (to - from));
      nearest[k] = key_of(depth_code(larger(depth * .9999f - thickest, c.near)), 0);
    }
    for (std::int32_t row = 0; row < std::min(rows_at_once, last - top); ++row) {
      const std::int32_t y = top + row;
      if (!(rows.left[row] < rows.right[row])) continue;
      const std::int32_t low = clipped(std::floor(rows.left[row]), s.left, s.right),
                         high = clipped(std::ceil(rows.right[row]), s.left, s.right);
      for (std::int32_t x = low & -lanes; x < high; x += lanes) {
        if (window.before(x, y, nearest[row])) continue;
        const float at = float(y) + .5f;
        float px[lanes];
        FOREST_LANES
        for (int k = 0; k < lanes; ++k) px[k] = float(x + k) + .5f;
        Hits<lanes> hits;
        if constexpr (S == 1) {
          meet_row(px, at, hits);
          std::uint32_t keys[lanes];
          FOREST_LANES
          for (int k = 0; k < lanes; ++k) {
            const std::uint32_t key =
                key_of(hits.code[k], payload_of(entry, hits.shade[k], noise_at(x + k, y, subframe)));
            keys[k] = hits.hit[k] ? key : FOREST_KEY_EMPTY;
          }
          window.put_row(x, y, keys);
        } else {
          const float inner_left = inner_rows.left[row], inner_right = inner_rows.right[row];
          if (px[lanes - 1] >= inner_left && px[0] <= inner_right) meet_row(px, at, hits);
          for (std::int32_t n = std::max(low - x, 0); n < std::min(lanes, high - x); ++n) {
            const float noise = noise_at(x + n, y, subframe);
            Keys<S> keys;
            if (px[n] >= inner_left && px[n] <= inner_right) {  // one ray for all samples
              const std::uint32_t hit = hits.hit[n];
              FOREST_LANES
              for (int k = 0; k < S; ++k) {
                const std::uint32_t key =
                    key_of(hits.code[n], payload_of(entry, hits.shade[n], fraction(noise + samples.turn[k])));
                keys[k] = hit ? key : FOREST_KEY_EMPTY;
              }
            } else {
              float sx[S], sy[S];
              FOREST_LANES
              for (int k = 0; k < S; ++k) sx[k] = px[n] - samples.x[k], sy[k] = at - samples.y[k];
              Hits<S> seen;
              if (whole)
                silhouette->meet<S>(sx, static_cast<const float*>(sy), c.near, seen);
              else
                meet(c, picture.light, body, sx, sy, seen);
              FOREST_LANES
              for (int k = 0; k < S; ++k) {
                const std::uint32_t key =
                    key_of(seen.code[k], payload_of(entry, seen.shade[k], fraction(noise + samples.turn[k])));
                keys[k] = seen.hit[k] ? key : FOREST_KEY_EMPTY;
              }
            }
            window.put(x + n, y, keys);
          }
        }
      }
    }
  }
}

template <int S>
[[gnu::always_inline]] inline void draw(const Picture& picture, const Samples<S>& samples, const Solid& r,
                                        auto& window) {
  const frame::Constants& c = picture.constants;
  const float width = c.focal * std::max(r.ra / lens(c, r.a.z()), r.rb / lens(c, r.b.z()));
  const float distance = std::hypot(r.qx - r.px, r.qy - r.py);
  if (2.f * width < tube_width && distance > .5f * width)
    draw_tube<S>(picture, samples, r, window);
  else
    draw_capsule<S>(picture, samples, r, window);
}

// Small spheres: as render/opengl/shaders/dots.glsl. Their ranks are those of the first of the samples.
template <int S>
[[gnu::always_inline]] inline void draw(const Picture& picture, const Samples<S>& samples, const Dot& r,
                                        auto& window) {
  const frame::Constants& c = picture.constants;
  const float px = r.px, py = r.py, z = r.z, radius = r.pixels, rank = r.rank, spread = picture.spread;
  const Square& s = window.square();
  const std::uint32_t entry = r.entry, subframe = c.subframe;
  const bool small = radius < .6f;  // less than a pixel: drawn for its share of samples
  const float share = 3.14159f * radius * radius, reach = small ? .5f : radius;
  const std::int32_t top = clipped(std::ceil(py - reach - spread - .5f), s.top, s.bottom),
                     bottom = clipped(std::floor(py + reach + spread + .5f), s.top, s.bottom),
                     left = clipped(std::ceil(px - reach - spread - .5f), s.left, s.right),
                     right = clipped(std::floor(px + reach + spread + .5f), s.left, s.right);
  const float per_radius = 1.f / radius;
  const Vec3& light = picture.light;
  for (std::int32_t y = top; y < bottom; ++y)
    for (std::int32_t x = left; x < right; ++x) {
      const float noise = noise_at(x, y, subframe);
      Keys<S> keys;
      if (small) {
        FOREST_LANES
        for (int k = 0; k < S; ++k) {
          const float turned = fraction(rank + samples.turn[k]);
          const float dx = px + samples.x[k] - float(x), dy = py + samples.y[k] - float(y);
          const bool covered = (share > turned) & (dx >= 0.f) & (dx < 1.f) & (dy >= 0.f) & (dy < 1.f);
          keys[k] = covered ? key_of(r.code, payload_of(entry, .8f, turned)) : FOREST_KEY_EMPTY;
        }
      } else {
        FOREST_LANES
        for (int k = 0; k < S; ++k) {
          const float dx = (float(x) + .5f - px - samples.x[k]) * per_radius,
                      dy = (float(y) + .5f - py - samples.y[k]) * per_radius, h = 1.f - dx * dx - dy * dy,
                      nz = -std::sqrt(larger(h, 0.f));
          const float shade = .5f + .5f * (dx * light.x() - dy * light.y() + nz * light.z());
          const std::uint32_t payload = payload_of(entry, shade, fraction(noise + samples.turn[k]));
          const std::uint32_t key = key_of(depth_code(larger(z + r.radius * nz, c.near)), payload);
          keys[k] = h > 0.f ? key : FOREST_KEY_EMPTY;
        }
      }
      window.put(x, y, keys);
    }
}

}  // namespace forest::render::cpu
