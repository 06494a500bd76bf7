// SPDX-License-Identifier: Apache-2.0
#include "forest/render/reference/reference_renderer.h"

#include <cmath>

#include <gtest/gtest.h>

#include "forest/core/error.h"
#include "forest/core/half.h"
#include "forest/core/parallel.h"
#include "forest/core/random.h"
#include "forest/geometry/round_cone.h"

#include "tests/small_scene.h"

namespace forest::render {
namespace {

// Each of its segments as an item of its own, all of them capsules.
struct Fixture : SmallScene {
  ReferenceRenderer renderer;

  void add(const Vec3& a, const Vec3& b, float ra, float rb) {
    add_segment(a, b, ra, rb);
    items.push_back({0, std::uint32_t(segments.size() - 1), 1, 0, 0, 0, a.z(), 200});
  }
  frame::Image draw() {
    frame.capsules = items;
    return drawn_by(renderer);
  }
  double scale() const {
    return frame.camera.focal(float(frame.height)) / 100.;
  }                                                                      // pixels a µm at the origin
  double area() { return draw().covered * frame.width * frame.height; }  // pixels
};

TEST(ReferenceRenderer, AnOrthographicCameraShowsThingsAsLargeAtAnyDepth) {
  for (const float depth : {-60.f, 0.f, 60.f})
    for (const float radius : {.3f, 5.f}) {
      Fixture f;
      f.frame.camera.projection = frame::Projection::orthographic;
      f.frame.subframes = 64;
      f.add({-20, 3, depth}, {15, -8, depth - 10}, radius, radius);
      const double scale = f.frame.camera.focal(200.f), length = Vec3(35, -11, 0).norm(),
                   r = double(from_half(to_half(radius)));
      EXPECT_NEAR(f.area() / (scale * scale * (2 * r * length + M_PI * r * r)), 1., .01) << radius;
    }
}

TEST(ReferenceRenderer, GlassTintsWhatLiesBehindItAndNothingBefore) {
  Fixture f;
  f.add({-12, 0, 20}, {-12, 0, 20}, 6.f, 6.f);
  f.add({12, 0, -20}, {12, 0, -20}, 6.f, 6.f);
  f.frame.glass = frame::Glass{.plane = Plane::through({0, 0, 0}, {0, 0, 1}),
                               .low = {-25, -20},
                               .high = {25, 20},
                               .colour = {0, 0, 1},
                               .opacity = .5f};
  const frame::Image image = f.draw();
  const auto at = [&](const Vec3& point) {
    const Vec3 place = frame::project(f.frame.camera, {200, 200}, point);
    return &image.pixels[4 * (std::size_t(place.y()) * 200 + std::size_t(place.x()))];
  };
  EXPECT_EQ(at({-12, 0, 20})[2], 0);
  EXPECT_GT(at({12, 0, -20})[2], 100);
  EXPECT_GT(at({24, 19, 0})[2], 100);
  EXPECT_EQ(at({26, 19, 0})[2], 0);
  EXPECT_EQ(at({24, 21, 0})[2], 0);
}

TEST(ReferenceRenderer, CapsuleCoversItsProjectedAreaHoweverThin) {
  for (const float radius : {.01f, .05f, .3f, 1.f, 6.f}) {
    Fixture f;
    f.add({-20, 3, 0}, {15, -8, 0}, radius, radius);
    f.frame.subframes = 256;
    const double length = Vec3(35, -11, 0).norm(), r = double(from_half(to_half(radius)));
    const double expected = f.scale() * f.scale() * (2 * r * length + M_PI * r * r);
    EXPECT_NEAR(f.area() / expected, 1., .01) << radius;
  }
}

TEST(ReferenceRenderer, TaperedCapsuleCoversTheAreaBetweenItsTangents) {
  Fixture f;
  f.frame.camera = {.eye = {0, 0, 4000}, .target = {0, 0, 0}, .field_of_view = 1.f};  // nearly parallel rays
  f.add({-15, 0, 0}, {12, 4, 0}, 6.f, 2.f);
  f.frame.subframes = 256;
  const double scale = f.frame.camera.focal(200.f) / 4000., length = Vec3(27, 4, 0).norm();
  const double angle = std::asin(4. / length);  // of the tangents to the axis
  const double expected =
      std::sqrt(length * length - 16.) * 8. + 36. * (M_PI / 2 + angle) + 4. * (M_PI / 2 - angle);
  EXPECT_NEAR(f.area() / (scale * scale * expected), 1., .005);
}

TEST(ReferenceRenderer, TransparentThingsBlendAsTheirOpacitiesSayInAnyOrder) {
  for (const std::uint32_t subframes : {256u, 12u})
    for (const bool swapped : {false, true}) {
      Fixture f;
      f.instances.push_back(f.instances[0]);
      f.add({-30, 0, swapped ? -20.f : 20.f}, {30, 0, swapped ? -20.f : 20.f}, 12.f, 12.f);
      f.add({0, -30, swapped ? 20.f : -20.f}, {0, 30, swapped ? 20.f : -20.f}, 12.f, 12.f);
      f.items[1].instance = 1;
      f.states = {{}, {.colour_class = 1}};
      f.frame.states = f.states;
      for (std::size_t i = 8; i < 16; ++i) f.frame.palette[i] = Vec3(0, 1, 0);
      f.frame.subframes = subframes;
      // Mean linear light, red and green, around the middle.
      const auto middle = [&] {
        const frame::Image image = f.draw();
        std::array<double, 2> sum{};
        for (std::size_t y = 90; y < 110; ++y)
          for (std::size_t x = 90; x < 110; ++x)
            for (std::size_t c = 0; c < 2; ++c)
              sum[c] += std::pow((image.pixels[4 * (y * 200 + x) + c] / 255. + .055) / 1.055, 2.4) / 400.;
        return sum;
      };
      const std::size_t front = swapped ? 1 : 0, back = 1 - front;
      const double near = middle()[front];
      f.states[front].opacity = 0;
      f.frame.states = f.states;
      const double far = middle()[back];
      f.states[front].opacity = 77, f.states[back].opacity = 160;
      f.frame.states = f.states;
      const auto seen = middle();
      EXPECT_NEAR(seen[front] / near, 77. / 255., .03) << subframes;
      EXPECT_NEAR(seen[back] / far, (1. - 77. / 255.) * 160. / 255., .03) << subframes;
    }
}

TEST(ReferenceRenderer, EveryPixelIsThatOfTheNearestOfRaysMetOneByOne) {
  // Black capsules in white fog: what is seen is depth.
  Fixture f;
  Random random(7);
  std::vector<RoundCone> cones;
  for (int i = 0; i < 120; ++i) {
    const auto place = [&] {
      return Vec3(float(random.uniform(-40, 40)), float(random.uniform(-40, 40)),
                  float(random.uniform(-60, 60)));
    };
    const Vec3 a = place(), b = i % 10 ? Vec3(a + .2f * place()) : a;
    const float ra = std::exp2(float(random.below(9)) - 5.f),
                rb = i % 10 ? std::exp2(float(random.below(9)) - 5.f) : ra;
    f.add(a, b, ra, rb);
    cones.push_back({a, b, ra, rb});
  }
  f.frame.palette = frame::black_palette();
  f.frame.style.fog_colour = Vec3::Ones();
  f.frame.style.fog_length = 100.f;
  f.frame.camera.near = .01f;
  const frame::Image image = f.draw();
  const frame::Viewport viewport{200, 200};
  int covered = 0, wrong = 0;
  for (std::uint32_t y = 0; y < 200; ++y)
    for (std::uint32_t x = 0; x < 200; ++x) {
      const Ray ray = frame::ray_through(f.frame.camera, viewport, Vec2(float(x) + .5f, float(y) + .5f));
      float nearest = INFINITY;
      for (const RoundCone& cone : cones)
        if (const auto t = intersect(ray, cone)) nearest = std::min(nearest, *t);
      double light = 0.;
      if (nearest < INFINITY) {
        const double depth = -nearest * ray.direction.z();
        light = 1. - std::exp(-depth / 100.);
        light = 1.055 * std::pow(light, 1. / 2.4) - .055;
        ++covered;
      }
      wrong += std::abs(255. * light - image.pixels[4 * (y * 200 + x)]) > 1.5;
    }
  EXPECT_GT(covered, 5000);
  EXPECT_LE(wrong, 4);  // rays that graze
}

TEST(ReferenceRenderer, AHalfCoveredPixelIsHalfAsBright) {
  const auto light_of = [](float radius) {
    Fixture f;
    f.add({-30, 1, 0}, {30, 1, 0}, radius, radius);
    f.frame.subframes = 256;
    const frame::Image image = f.draw();
    double sum = 0.;
    for (std::size_t i = 0; i < image.pixels.size(); i += 4) {
      const double c = image.pixels[i] / 255.;
      sum += c <= .04045 ? c / 12.92 : std::pow((c + .055) / 1.055, 2.4);
    }
    return sum;
  };
  EXPECT_NEAR(light_of(.125f) / light_of(.0625f), 2., .05);
}

TEST(ReferenceRenderer, DotsAndLinesAreCapsulesToo) {
  Fixture f;
  f.add({-20, 3, 0}, {15, -8, 0}, .5f, .25f);
  f.add({5, 9, 0}, {5, 9, 0}, 3.f, 3.f);
  f.frame.subframes = 16;
  const frame::Image image = f.draw();
  const auto all = f.items;
  f.items.clear();
  f.frame.lines = std::span(all).first(1), f.frame.dots = std::span(all).last(1);
  EXPECT_EQ(f.draw().pixels, image.pixels);
  EXPECT_GT(image.covered, .01);
}

TEST(ReferenceRenderer, WhatTheSceneLeftOutIsDrawnToo) {
  Fixture f;
  f.add({-20, 3, 0}, {15, -8, 0}, .5f, .25f);
  f.add({5, 9, 0}, {5, 9, 0}, 3.f, 3.f);
  const frame::Image image = f.draw();
  const auto all = f.items;
  f.items.resize(1);
  EXPECT_NE(f.draw().pixels, image.pixels);
  f.frame.rest = [&](const frame::DepthMap& seen, std::uint32_t) {
    EXPECT_TRUE(seen.depths.empty());
    frame::Lists rest;
    rest.capsules = std::span(all).last(1);
    return rest;
  };
  EXPECT_EQ(f.draw().pixels, image.pixels);
}

TEST(ReferenceRenderer, TheSameAtAnyNumberOfThreadsAndInAnyOrder) {
  Fixture f;
  Random random(3);
  for (int i = 0; i < 300; ++i) {
    const auto place = [&] {
      return Vec3(float(random.normal()) * 20.f, float(random.normal()) * 20.f,
                  float(random.normal()) * 20.f);
    };
    f.add(place(), place(), float(random.uniform(.05, 2.)), float(random.uniform(.05, 2.)));
  }
  f.frame.style.halo = 1.f;
  f.frame.subframes = 16;
  const frame::Image image = f.draw();
  {
    const ThreadLimit one(1);
    EXPECT_EQ(f.draw().pixels, image.pixels);
  }
  std::ranges::reverse(f.items);
  EXPECT_EQ(f.draw().pixels, image.pixels);
}

TEST(ReferenceRenderer, PictureDrawnInPartsIsThatDrawnAtOnce) {
  Fixture f;
  f.add({-20, 3, 0}, {15, -8, 0}, 2.f, .1f);
  f.frame.subframes = 37;
  const frame::Image at_once = f.draw();
  for (const auto& [first, last] : {std::pair(0u, 1u), std::pair(1u, 20u), std::pair(20u, 37u)}) {
    f.frame.first_subframe = first, f.frame.last_subframe = last;
    f.renderer.draw(f.frame);
  }
  const frame::Image in_parts = f.renderer.read();
  for (std::size_t i = 0; i < at_once.pixels.size(); ++i)
    EXPECT_NEAR(in_parts.pixels[i], at_once.pixels[i], 1) << i;  // sums in another order
}

TEST(ReferenceRenderer, WhatLiesBehindTheEyeIsNotDrawn) {
  Fixture f;
  f.add({0, 0, 150}, {5, 5, 300}, 5.f, 5.f);
  EXPECT_EQ(f.draw().covered, 0.);
}

TEST(ReferenceRenderer, OverlaysAreSeen) {
  Fixture f;
  const std::vector<frame::Overlay> marks{{Vec3(-10, 0, 0), Vec3(10, 0, 0), .001f, 5}};
  f.frame.overlays = marks;
  f.frame.subframes = 64;
  EXPECT_NEAR(f.area(), 2. * 20. * f.scale() + M_PI, 2.);  // never thinner than two pixels
}

TEST(ReferenceRenderer, RefusesAFrameThatBreaksTheContract) {
  Fixture f;
  f.add({0, 0, 0}, {1, 1, 1}, 1.f, 1.f);
  f.frame.width = 0;
  EXPECT_THROW(f.draw(), Error);
}

}  // namespace
}  // namespace forest::render
