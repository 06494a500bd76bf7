// SPDX-License-Identifier: Apache-2.0
// A tapered capsule as rays meet it, and where on the picture that may be.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>

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
void meet(const frame::Constants& c, const Vec3& light, const Body& body, const float* x, const float* y,
          Hits<4>& hits);
void meet(const frame::Constants& c, const Vec3& light, const Body& body, const float* x, const float* y,
          Hits<8>& hits);
void meet(const frame::Constants& c, const Vec3& light, const Body& body, const float* x, const float* y,
          Hits<16>& hits);

// One lane of many, or what all lanes share.
[[gnu::always_inline]] inline float lane_of(const float* values, int lane) { return values[lane]; }
[[gnu::always_inline]] inline float lane_of(float value, int) { return value; }

/// A capsule in perspective as a whole. With the ray of a pixel as (X, Y, 1), what decides whether it meets a cone or a sphere
/// is of second degree in X and Y, for the outline of either is a conic; all else, but for the roots, of first. Found once, in
/// double precision and about a pixel in its middle, where the terms are small: a place costs a third of what its own ray
/// does, and what differs is a thousandth of the radius.
class Silhouette {
 public:
  /// Whether the eye is far enough away and beside the axis for it.
  static bool fits(const frame::Constants& c, const Body& body) {
    if (c.parallel > 0.f) return false;
    const auto beside = [&](const Vec3& at, float radius) {
      const float distance2 = at.squaredNorm(), along = at.dot(body.u);
      return along * along < (.94f - 3.f * radius * radius / distance2) * distance2;  // 14 degrees and more
    };
    return body.nested || (beside(body.a, body.ra) && beside(body.b, body.rb));
  }

  /// @param p, q  its ends on the picture
  Silhouette(const frame::Constants& c, const Vec3& light, const Body& body, const Vec2& p, const Vec2& q)
      : nested_(body.nested),
        x_(std::floor(.5f * (p.x() + q.x()))),
        y_(std::floor(.5f * (p.y() + q.y()))),
        s_(body.s),
        c2_(body.c2),
        ra_(body.ra),
        begin_(body.s * body.ra),
        end_(body.length + body.s * body.rb) {
    using Vec = Eigen::Vector3d;
    const Map map{1. / double(c.focal),
                  {(double(x_) - double(c.centre_x)) / double(c.focal),
                   (double(c.centre_y) - double(y_)) / double(c.focal), 1.}};
    const Vec a = body.a.cast<double>(), b = body.b.cast<double>(), l = light.cast<double>();
    square_ = map.conic(Vec::Zero(), -1., Vec::Zero(), 0.);
    lit_ = map.slant(l);
    const auto ball = [&](const Vec& at, double radius) {
      return Ball{map.conic(at, at.squaredNorm() - radius * radius, Vec::Zero(), 0.), map.slant(at),
                  float(at.dot(l)), 1.f / std::max(float(radius), 1e-9f)};
    };
    if (nested_) {
      balls_[0] = balls_[1] = body.ra > body.rb ? ball(a, double(body.ra)) : ball(b, double(body.rb));
      return;
    }
    balls_ = {ball(a, double(body.ra)), ball(b, double(body.rb))};
    const Vec axis = b - a;
    const double length = axis.norm(), s = (double(body.ra) - double(body.rb)) / length, c2 = 1. - s * s,
                 from = double(body.ra) * s;
    const Vec u = axis / length;
    // With v from a to a point of the ray, the cone is c² v·v - (v·u)² + 2 ra s v·u = ra².
    const double au = a.dot(u),
                 C = c2 * a.squaredNorm() - au * au - 2. * from * au - double(body.ra) * double(body.ra);
    const Vec B = c2 * a - (au + from) * u;
    root_ = map.conic(B, c2 * C, u, C);
    half_ = map.slant(B), along_ = map.slant(u);
    at_axis_ = float(au), at_light_ = float(a.dot(l)), lit_axis_ = float(u.dot(l));
  }

  /// @param x, y  places, pixels
  template <int lanes>
  [[gnu::always_inline]] void meet(const float* x, const auto& y, float near, Hits<lanes>& hits) const {
    float z[lanes], facing[lanes];
    std::uint32_t within[lanes], last[lanes], beside = 1;
    if (nested_) {
      FOREST_LANES
      for (int k = 0; k < lanes; ++k) z[k] = facing[k] = 0.f, within[k] = 1, last[k] = 0, hits.hit[k] = 0;
    } else {
      beside = 0;
      const float s = s_, c2 = c2_, ra = ra_, begin = begin_, end = end_;
      FOREST_LANES
      for (int k = 0; k < lanes; ++k) {
        const float dx = x[k] - x_, dy = lane_of(y, k) - y_;
        const float root = root_(dx, dy), du = along_(dx, dy), A = c2 * square_(dx, dy) - du * du;
        const float t = (half_(dx, dy) - std::sqrt(larger(root, 0.f))) / larger(A, 1e-9f),
                    along = t * du - at_axis_;
        const bool in = root >= 0.f, on_cone = in & (along >= begin) & (along <= end) & (t > 0.f);
        z[k] = t;
        // Of the normal across the axis, whose length there is that of the taper.
        facing[k] = c2 * (t * lit_(dx, dy) - at_light_ - along * lit_axis_) / larger(ra - s * along, 1e-9f) +
                    s * lit_axis_;
        hits.hit[k] = on_cone ? 1u : 0u;
        within[k] = in ? 1u : 0u;
        last[k] = along > end ? 1u : 0u;
        beside |= within[k] & ~hits.hit[k];
      }
    }
    if (beside) {  // those met by the sphere at one end
      const Ball &first = balls_[0], &second = balls_[1];
      FOREST_LANES
      for (int k = 0; k < lanes; ++k) {
        const float dx = x[k] - x_, dy = lane_of(y, k) - y_;
        const bool b = last[k] != 0;
        const float root_a = first.root(dx, dy), root_b = second.root(dx, dy), root = b ? root_b : root_a;
        const float half_a = first.half(dx, dy), half_b = second.half(dx, dy), half = b ? half_b : half_a;
        const float t = (half - std::sqrt(larger(root, 0.f))) / square_(dx, dy);
        const float at_light = b ? second.at_light : first.at_light,
                    per_radius = b ? second.per_radius : first.per_radius;
        const bool cone = hits.hit[k] != 0;
        z[k] = cone ? z[k] : t;
        facing[k] = cone ? facing[k] : (t * lit_(dx, dy) - at_light) * per_radius;
        hits.hit[k] |= (within[k] != 0) & (root >= 0.f) & (t > 0.f) ? 1u : 0u;
      }
    }
    FOREST_LANES
    for (int k = 0; k < lanes; ++k) {
      hits.code[k] = depth_code(larger(z[k], near));
      hits.shade[k] = .5f + .5f * facing[k];
    }
  }

 private:
  // What changes evenly over the picture, by pixels beside the middle; and what does so in second degree.
  struct Slant {
    float one, x, y;
    [[gnu::always_inline]] float operator()(float dx, float dy) const { return one + dy * y + dx * x; }
  };
  struct Conic {
    float one, x, y, xx, xy, yy;
    [[gnu::always_inline]] float operator()(float dx, float dy) const {
      return one + dy * (y + dy * yy) + dx * (x + dy * xy + dx * xx);
    }
  };
  // From pixels beside the middle to rays (X, Y, 1).
  struct Map {
    double step;
    Eigen::Vector3d middle;
    Slant slant(const Eigen::Vector3d& v) const {
      return {float(v.dot(middle)), float(step * v.x()), float(-step * v.y())};
    }
    // Of (v·ray)² - p ray² + w (u·ray)².
    Conic conic(const Eigen::Vector3d& v, double p, const Eigen::Vector3d& u, double w) const {
      const double vm = v.dot(middle), um = u.dot(middle);
      const Eigen::Vector3d at = vm * v - p * middle + w * um * u;
      return {float(at.dot(middle)),
              float(2. * step * at.x()),
              float(-2. * step * at.y()),
              float(step * step * (v.x() * v.x() - p + w * u.x() * u.x())),
              float(-2. * step * step * (v.x() * v.y() + w * u.x() * u.y())),
              float(step * step * (v.y() * v.y() - p + w * u.y() * u.y()))};
    }
  };
  struct Ball {
    Conic root;
    Slant half;
    float at_light, per_radius;
  };

  bool nested_;
  float x_, y_;  // its middle, pixels
  float s_, c2_, ra_, begin_, end_;
  float at_axis_ = 0.f, at_light_ = 0.f, lit_axis_ = 0.f;
  Conic square_{}, root_{};
  Slant half_{}, along_{}, lit_{};
  std::array<Ball, 2> balls_{};
};

inline constexpr int rows_at_once = 8;

/// Two discs of the picture and all between them: where a capsule is seen.
class Outline {
 public:
  /// From where to where it reaches in each of some rows; left > right beside it.
  struct Rows {
    float left[rows_at_once], right[rows_at_once];
  };

  /// @param exact  nothing reaches beyond the discs; else, as before the eye, a little does
  Outline(const Vec2& p, const Vec2& q, float rp, float rq, bool exact)
      : p_(p), q_(q), rp_(rp), rq_(rq), exact_(exact) {
    const Vec2 between = q - p;
    const float rise = between.y(), distance = between.norm(),
                sine = distance > 0.f ? (rp - rq) / distance : 2.f;
    per_rise_ = 1.f / (rise < 0.f ? std::min(rise, -1e-3f) : std::max(rise, 1e-3f));
    if (std::abs(sine) >= 1.f) return;  // one lies within the other
    const Vec2 along = between / distance, beside(-along.y(), along.x());
    const float cosine = std::sqrt(1.f - sine * sine);
    for (const float side : {-1.f, 1.f}) {
      const Vec2 normal = sine * along + side * cosine * beside;
      const Vec2 from = p + rp * normal, to = q + rq * normal;
      if (from.y() == to.y()) continue;
      const float slope = (to.x() - from.x()) / (to.y() - from.y());
      tangents_[side > 0.f] = {from.x() - slope * from.y(), slope, std::min(from.y(), to.y()),
                               std::max(from.y(), to.y())};
    }
  }
  float top() const { return std::min(p_.y() - rp_, q_.y() - rq_); }
  float bottom() const { return std::max(p_.y() + rp_, q_.y() + rq_); }
  /// Which part of the way from p to q has discs that may reach a height; 0 to 1.
  [[gnu::always_inline]] void part(float y, float& from, float& to) const {
    const float reach = larger(rp_, rq_), middle = (y - p_.y()) * per_rise_,
                beside = reach * std::abs(per_rise_);
    from = smaller(larger(middle - beside, 0.f), 1.f), to = smaller(larger(middle + beside, 0.f), 1.f);
  }
  /// Of the rows from the height `y` on.
  [[gnu::always_inline]] void across(float y, Rows& rows) const {
    const float px = p_.x(), py = p_.y(), dx = q_.x() - p_.x(), qx = q_.x(), qy = q_.y(), rp = rp_, rq = rq_;
    if (!exact_) {
      const float wide = larger(rp, rq);
      FOREST_LANES
      for (int k = 0; k < rows_at_once; ++k) {
        float from, to;
        part(y + float(k), from, to);
        rows.left[k] = px + smaller(from * dx, to * dx) - wide;
        rows.right[k] = px + larger(from * dx, to * dx) + wide;
      }
      return;
    }
    const Tangent &s = tangents_[0], &t = tangents_[1];
    FOREST_LANES
    for (int k = 0; k < rows_at_once; ++k) {
      const float at = y + float(k);
      const float hp = rp * rp - (at - py) * (at - py), hq = rq * rq - (at - qy) * (at - qy),
                  wp = std::sqrt(larger(hp, 0.f)), wq = std::sqrt(larger(hq, 0.f));
      const float xs = s.at + at * s.slope, xt = t.at + at * t.slope;
      const bool on_p = hp >= 0.f, on_q = hq >= 0.f, on_s = (at >= s.top) & (at <= s.bottom),
                 on_t = (at >= t.top) & (at <= t.bottom);
      rows.left[k] = smaller(smaller(on_p ? px - wp : 1e9f, on_q ? qx - wq : 1e9f),
                             smaller(on_s ? xs : 1e9f, on_t ? xt : 1e9f));
      rows.right[k] = larger(larger(on_p ? px + wp : -1e9f, on_q ? qx + wq : -1e9f),
                             larger(on_s ? xs : -1e9f, on_t ? xt : -1e9f));
    }
  }

 private:
  // A line x = at + slope y that touches both discs, between these heights.
  struct Tangent {
    float at = 0.f, slope = 0.f, top = INFINITY, bottom = -INFINITY;
  };

  Vec2 p_, q_;
  float rp_, rq_, per_rise_;
  bool exact_;
  std::array<Tangent, 2> tangents_;
};

/// How far beside their middles the spheres of a capsule's ends are seen, pixels: f r |p| / z (z - r) holds a sphere at p, as in
/// scene/occlusion.cpp, and between two ends it changes about evenly. Not so before the eye or far aside, where one bound of
/// all three factors holds the whole capsule; what reaches behind the eye may be seen anywhere.
struct Reach {
  float a, b;
  bool exact;

  Reach(const frame::Constants& c, const Vec3& at_a, const Vec3& at_b, float ra, float rb)
      : Reach(c, at_a.squaredNorm(), at_a.z(), ra, at_b.squaredNorm(), at_b.z(), rb) {}

  /// @param a2, b2  squares of their distances
  [[gnu::always_inline]] Reach(const frame::Constants& c, float a2, float az, float ra, float b2, float bz,
                               float rb) {
    const bool even = c.parallel > 0.f;
    const float wide_a = ra / az, wide_b = rb / bz, aside_a = std::sqrt(a2) / az,
                aside_b = std::sqrt(b2) / bz, wide = larger(wide_a, wide_b), aside = larger(aside_a, aside_b);
    const bool small = (wide < .25f) & (aside < 1.58f);
    const float all =
        wide < 1.f ? smaller(c.focal * wide * aside / larger(1.f - wide, 1e-6f), anywhere) : anywhere;
    const float of_a = c.focal * wide_a * aside_a / (1.f - wide_a),
                of_b = c.focal * wide_b * aside_b / (1.f - wide_b);
    exact = even | small;
    a = even ? c.focal * ra : small ? of_a : all;
    b = even ? c.focal * rb : small ? of_b : all;
  }

 private:
  static constexpr float anywhere = 1e6f;
};

/// What a picture shows of a capsule: its axis without what lies so far beside the picture that no sphere around it reaches in.
class Crop {
 public:
  /// @param spread  pixels that samples lie beside the middle of theirs at most
  Crop(const frame::Constants& c, float spread)
      : needed_(c.parallel == 0.f),
        left_(plane(c, c.centre_x + spread)),
        right_(plane(c, float(c.width) - c.centre_x + spread)),
        above_(plane(c, c.centre_y + spread)),
        below_(plane(c, float(c.height) - c.centre_y + spread)) {}

  /// Cuts a capsule before the eye of a camera in perspective; the cut ends are as wide as it is there.
  /// @returns false where nothing is left
  bool operator()(Vec3& a, Vec3& b, float& ra, float& rb) const {
    if (!needed_) return true;
    const float radius = std::max(ra, rb);
    float from = 0.f, to = 1.f;
    const auto cut = [&](const Side& side, float beside_a, float beside_b) {
      const float at_a = side.forward * a.z() + side.across * beside_a + radius,
                  at_b = side.forward * b.z() + side.across * beside_b + radius;
      if (at_a < 0.f && at_b < 0.f) to = -1.f;
      if (at_a < 0.f) from = std::max(from, at_a / (at_a - at_b));
      if (at_b < 0.f) to = std::min(to, at_a / (at_a - at_b));
    };
    cut(left_, a.x(), b.x()), cut(right_, -a.x(), -b.x());
    cut(above_, -a.y(), -b.y()), cut(below_, a.y(), b.y());
    if (!(from <= to)) return false;
    const Vec3 axis = b - a;
    const float taper = rb - ra;
    if (to < 1.f) b = a + to * axis, rb = ra + to * taper;
    if (from > 0.f) a += from * axis, ra += from * taper;
    return true;
  }

 private:
  // A plane through the eye and an edge of the picture: its unit normal, into the picture.
  struct Side {
    float forward, across;
  };
  static Side plane(const frame::Constants& c, float pixels) {
    const float per_length = 1.f / std::hypot(pixels, c.focal);
    return {pixels * per_length, c.focal * per_length};
  }

  bool needed_;
  Side left_, right_, above_, below_;
};

inline float margin_of(float spread) { return 1.f + 1.4143f * spread; }

/// Where a capsule, whose ends lie at p and q on the picture, may be seen by any sample of a pixel, by its middle.
inline Outline outline_of(const frame::Constants& c, float spread, const Vec2& p, const Vec2& q,
                          const Body& body) {
  const Reach reach(c, body.a, body.b, body.ra, body.rb);
  const float margin = margin_of(spread);
  return {p, q, margin + reach.a, margin + reach.b, reach.exact};
}

/// Where every sample of a pixel certainly meets it, by the pixel's middle.
inline Outline inner_outline_of(const frame::Constants& c, const Vec2& p, const Vec2& q, const Body& body) {
  const auto reach = [&](const Vec3& at, float radius) {
    return std::max(c.focal * radius / lens(c, at.z()) - 1.f, 0.f);
  };
  return {p, q, reach(body.a, body.ra), reach(body.b, body.rb), true};
}

}  // namespace forest::render::cpu
