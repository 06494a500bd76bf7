// SPDX-License-Identifier: Apache-2.0
#include "forest/render/cpu/capsule.h"

#include <gtest/gtest.h>

#include "forest/core/random.h"

namespace forest::render::cpu {
namespace {

constexpr int lanes = 16;

// A picture of 1280×720, seen from the origin along z.
frame::Constants picture() {
  frame::Constants c{};
  c.focal = 990.f, c.centre_x = 640.f, c.centre_y = 360.f;
  c.near = .5f, c.converge = 1.f, c.parallel = 0.f;
  c.width = 1280, c.height = 720;
  return c;
}

Vec2 pixel_of(const frame::Constants& c, const Vec3& p) {
  return {c.centre_x + c.focal * p.x() / p.z(), c.centre_y - c.focal * p.y() / p.z()};
}

struct Case {
  Vec3 a, b;
  float ra, rb;
  Case(const frame::Constants& c, Random& random) {
    const float depth = float(std::exp(random.uniform(std::log(5.), std::log(800.))));
    const float pixels = float(std::exp(random.uniform(std::log(3.), std::log(150.))));
    ra = pixels * depth / c.focal;
    rb = ra * float(random.uniform(.3, 1.8));
    a = depth * Vec3(float(random.uniform(-.6, .6)), float(random.uniform(-.35, .35)), 1.f);
    const Vec3 way(float(random.normal()), float(random.normal()), float(random.normal()));
    b = a + way.normalized() * ra * float(random.below(8) ? random.uniform(.2, 30.) : 0.);
  }
};

TEST(Capsule, ItsSilhouetteIsWhatItsRaysMeet) {
  const frame::Constants c = picture();
  const Vec3 light = Vec3(.3f, .8f, -.5f).normalized();
  Random random(3);
  int fitting = 0, hit = 0, differing = 0, deeper = 0, brighter = 0;
  for (int i = 0; i < 4000; ++i) {
    const Case k(c, random);
    const Body body(k.a, k.b, k.ra, k.rb);
    if (!Silhouette::fits(c, body)) continue;
    ++fitting;
    const Vec2 p = pixel_of(c, k.a), q = pixel_of(c, k.b);
    const Silhouette silhouette(c, light, body, p, q);
    const float wide = c.focal * std::max(k.ra / k.a.z(), k.rb / k.b.z());
    float x[lanes], y[lanes];
    for (int lane = 0; lane < lanes; ++lane) {
      const Vec2 at = p + float(random.uniform()) * (q - p);
      x[lane] = at.x() + wide * float(random.uniform(-1.3, 1.3));
      y[lane] = at.y() + wide * float(random.uniform(-1.3, 1.3));
    }
    Hits<lanes> seen, met;
    silhouette.meet<lanes>(x, static_cast<const float*>(y), c.near, seen);
    meet(c, light, body, x, y, met);
    const float radius = 62400.f * std::max(k.ra, k.rb) / std::min(k.a.z(), k.b.z());  // in steps of depth
    for (int lane = 0; lane < lanes; ++lane) {
      hit += met.hit[lane] != 0;
      if (seen.hit[lane] != met.hit[lane]) {
        ++differing;
      } else if (met.hit[lane]) {
        deeper += std::abs(seen.code[lane] - met.code[lane]) > 3.f + .01f * radius;
        brighter += std::abs(seen.shade[lane] - met.shade[lane]) > .01f;
      }
    }
  }
  EXPECT_GT(fitting, 3000);
  EXPECT_GT(hit, 20000);
  EXPECT_LT(differing, hit / 500);  // at the very rim
  EXPECT_LT(deeper, hit / 500);
  EXPECT_LT(brighter, hit / 500);
}

// Of capsules before the eye, and of such as lie far aside, or reach beside it and behind.
TEST(Capsule, ItsOutlineHoldsWhatItsRaysMeet) {
  const frame::Constants c = picture();
  Random random(5);
  int inside = 0, beside = 0, even = 0, near = 0;
  for (int i = 0; i < 4000; ++i) {
    Case k(c, random);
    if (i % 2) {
      const auto place = [&] {
        const float depth = c.near + float(std::exp(random.uniform(std::log(.1), std::log(30.))));
        return Vec3(depth * float(random.normal()), depth * float(random.normal()), depth);
      };
      k.a = place(), k.b = place();
      k.ra = k.a.z() * float(random.uniform(.02, .9)), k.rb = k.b.z() * float(random.uniform(.02, .9));
    }
    if (std::min(k.a.z(), k.b.z()) < c.near) continue;  // cut there before
    const Body body(k.a, k.b, k.ra, k.rb);
    ++(Reach(c, k.a, k.b, k.ra, k.rb).exact ? even : near);
    const Outline outline = outline_of(c, 0.f, pixel_of(c, k.a), pixel_of(c, k.b), body);
    const float top = std::floor(std::max(outline.top(), -2000.f)),
                high = std::min(outline.bottom(), 2000.f) - top;
    if (!(high > 1.f)) continue;
    for (int row = 0; row < 40; ++row) {
      const float first = std::floor(top + high * float(random.uniform(-.1, 1.1))) + .5f;
      Outline::Rows rows;
      outline.across(first, rows);
      float x[lanes], y[lanes];
      for (int lane = 0; lane < lanes; ++lane) {
        y[lane] = first + float(lane % rows_at_once);
        const bool left = lane < rows_at_once;
        x[lane] = left ? rows.left[lane] - .01f : rows.right[lane - rows_at_once] + .01f;
      }
      Hits<lanes> hits;
      meet(c, Vec3(0, 0, -1), body, x, y, hits);
      for (int lane = 0; lane < lanes; ++lane) beside += hits.hit[lane] && std::abs(x[lane]) < 1e5f;
      for (int lane = 0; lane < rows_at_once; ++lane) {
        const float middle = .5f * (rows.left[lane] + rows.right[lane]);
        x[lane] = rows.left[lane] < rows.right[lane] ? middle : -1e9f;
      }
      meet(c, Vec3(0, 0, -1), body, x, y, hits);
      for (int lane = 0; lane < rows_at_once; ++lane) inside += hits.hit[lane] != 0;
    }
  }
  EXPECT_EQ(beside, 0);
  EXPECT_GT(inside, 100000);
  EXPECT_GT(even, 1500);
  EXPECT_GT(near, 1500);
}

// Of capsules around and behind the edges of the picture, some of which begin right before the eye.
TEST(Capsule, WhatIsCutOffBesideThePictureIsNotSeen) {
  const frame::Constants c = picture();
  const Crop crop(c, 0.f);
  const Vec3 light(0, 0, -1);
  Random random(7);
  int cut = 0, gone = 0, hit = 0, differing = 0, fitting = 0;
  for (int i = 0; i < 20000; ++i) {
    const auto place = [&] {
      const float depth = c.near + float(std::exp(random.uniform(std::log(.01), std::log(300.))));
      return Vec3(float(random.uniform(-60., 60.)), float(random.uniform(-60., 60.)), depth);
    };
    const Vec3 a = place(), b = place();
    const float ra = float(random.uniform(.1, 3.)), rb = float(random.uniform(.1, 3.));
    Vec3 from = a, to = b;
    float r_from = ra, r_to = rb;
    const bool left = crop(from, to, r_from, r_to);
    if (left && from == a && to == b) continue;
    ++(left ? cut : gone);
    const Body whole(a, b, ra, rb), part(from, to, r_from, r_to);
    const bool fits = left && Silhouette::fits(c, part);
    fitting += fits;
    for (int row = 0; row < 8; ++row) {
      float x[lanes], y[lanes];
      for (int lane = 0; lane < lanes; ++lane)
        x[lane] = float(random.uniform(0., 1280.)), y[lane] = float(random.uniform(0., 720.));
      Hits<lanes> all, seen{};
      meet(c, light, whole, x, y, all);
      if (fits)
        Silhouette(c, light, part, pixel_of(c, from), pixel_of(c, to))
            .meet<lanes>(x, static_cast<const float*>(y), c.near, seen);
      else if (left)
        meet(c, light, part, x, y, seen);
      for (int lane = 0; lane < lanes; ++lane) {
        hit += all.hit[lane] != 0;
        differing += all.hit[lane] != seen.hit[lane] ||
                     (all.hit[lane] && std::abs(all.code[lane] - seen.code[lane]) >
                                           30.f + 600.f * std::max(ra, rb) / std::min(a.z(), b.z()));
      }
    }
  }
  EXPECT_GT(cut, 2000);
  EXPECT_GT(fitting, 1500);
  EXPECT_GT(gone, 2000);
  EXPECT_GT(hit, 20000);
  EXPECT_LT(differing, hit / 300);  // at the very rim
}

}  // namespace
}  // namespace forest::render::cpu
