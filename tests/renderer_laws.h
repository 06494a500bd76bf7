// SPDX-License-Identifier: Apache-2.0
// What holds for every renderer that makes pictures. A room that has one includes this in its test and instantiates it:
// INSTANTIATE_TEST_SUITE_P(OpenGL, RendererLaws, testing::Values(make)); and the same for SurfaceLaws.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <vector>

#include <gtest/gtest.h>

#include "forest/core/error.h"
#include "forest/render/renderer.h"

#include "tests/small_scene.h"

namespace forest::render {

using Maker = std::unique_ptr<Renderer> (*)();

class RendererLaws : public testing::TestWithParam<Maker> {};
class SurfaceLaws : public testing::TestWithParam<Maker> {
};  // of triangles and balls: the reference keeps them, too

namespace {

// All of its segments as one item.
struct Fixture : SmallScene {
  std::unique_ptr<Renderer> renderer;

  explicit Fixture(Maker make) : renderer(make()) {}
  void add(const Vec3& a, const Vec3& b, float radius) {
    add_segment(a, b, radius, radius);
    items.assign(1, {0, 0, frame::first_segments(segments.size()), 0, 0, 0, 0, 200});
  }
  frame::Image draw() { return drawn_by(*renderer); }
};

double red_area(const frame::Image& image) {  // in pixels, by coverage
  return image.covered * image.width * image.height;
}

TEST_P(RendererLaws, CapsuleCoversItsProjectedArea) {
  for (const float radius : {.3f, 1.f, 6.f, 20.f}) {
    Fixture f(GetParam());
    f.add({-20, 3, 0}, {15, -8, 0}, radius);
    f.frame.capsules = f.items;
    f.frame.subframes = 32;
    const double scale = f.frame.camera.focal(200.f) / 100.;
    const double length = Vec3(35, -11, 0).norm(),
                 expected = scale * scale * (2 * radius * length + M_PI * radius * radius);
    EXPECT_NEAR(red_area(f.draw()) / expected, 1., radius < 1 ? .12 : .06) << radius;
  }
}

TEST_P(RendererLaws, AThinLineCoversItsAreaOnTheMean) {
  for (const float radius : {.02f, .1f, .4f}) {
    for (const Vec3& end : {Vec3(15, -8, 0), Vec3(-20, -25, 0), Vec3(20, 25, 0)}) {
      Fixture f(GetParam());
      f.add({-20, 3, 0}, end, radius);
      f.frame.lines = f.items;
      f.frame.subframes = 64;
      const double scale = f.frame.camera.focal(200.f) / 100.;
      const double expected = scale * scale * 2 * radius * (end - Vec3(-20, 3, 0)).norm();
      const double steps = 64 * 2 * radius * scale;  // of 64 subframes, those that draw it: a whole number
      EXPECT_NEAR(red_area(f.draw()) / expected, 1., .05 + 1. / steps) << radius;
    }
  }
}

TEST_P(RendererLaws, PictureDrawnInPartsIsThatDrawnAtOnce) {
  Fixture f(GetParam());
  f.add({-20, 3, 0}, {15, -8, 0}, 2.f);
  f.add({-20, -3, 5}, {15, 9, 5}, .1f);
  f.frame.capsules = f.items;
  f.frame.subframes = 16;
  const frame::Image at_once = f.draw();
  for (const auto& [first, last] : {std::pair(0u, 1u), std::pair(1u, 5u), std::pair(5u, 16u)}) {
    f.frame.first_subframe = first, f.frame.last_subframe = last;
    f.renderer->draw(f.frame);
    EXPECT_EQ(f.renderer->read().pixels == at_once.pixels, last == 16u);
    EXPECT_GT(f.renderer->read().covered, .5 * at_once.covered);
  }
}

TEST_P(RendererLaws, TwoThatDrawInTurnDrawAsOneAlone) {
  Fixture thick(GetParam());
  thick.add({-20, 3, 0}, {15, -8, 0}, 8.f);
  thick.frame.capsules = thick.items;
  const frame::Image alone = thick.draw();
  Fixture thin(GetParam());
  thin.add({-20, -3, 5}, {15, 9, 5}, 1.f);
  thin.add({-20, -6, 5}, {15, 2, 5}, 1.f);
  thin.frame.lines = thin.items;
  const frame::Image other = thin.draw();
  for (int i = 0; i < 2; ++i) {
    thick.renderer->draw(thick.frame);
    thin.renderer->draw(thin.frame);
    EXPECT_EQ(thick.renderer->covered(), alone.covered);
    EXPECT_EQ(thick.renderer->read().pixels, alone.pixels);
    EXPECT_EQ(thin.renderer->covered(), other.covered);
    EXPECT_EQ(thin.renderer->read().pixels, other.pixels);
  }
  EXPECT_GT(alone.covered, other.covered);
  EXPECT_GT(other.covered, 0.);
}

TEST_P(RendererLaws, OverlaysAreSeenWhereverTheOriginIs) {
  for (const float beside : {0.f, 500.f}) {  // the origin in the picture, and far beside it
    Fixture f(GetParam());
    f.frame.camera.eye.x() = f.frame.camera.target.x() = beside;
    const std::vector<frame::Overlay> marks{{Vec3(beside - 10, 0, 0), Vec3(beside + 10, 0, 0), 2.f, 5}};
    f.frame.overlays = marks;
    EXPECT_GT(red_area(f.draw()), 300.) << beside;
  }
}

TEST_P(RendererLaws, NearerHidesFartherInAnyOrderAndAnyBand) {
  for (const bool swapped : {false, true}) {
    Fixture f(GetParam());
    f.add({-10, 0, swapped ? -20.f : 20.f}, {10, 0, swapped ? -20.f : 20.f}, 8.f);
    f.segments[0].meta = swapped ? 4 : 3;
    f.add({-10, 0, swapped ? 20.f : -20.f}, {10, 0, swapped ? 20.f : -20.f}, 3.f);
    f.segments[1].meta = swapped ? 3 : 4;
    f.frame.palette[4] = Vec3(0, 1, 0);
    const std::vector<frame::Item> both{{0, 0, 1, 0, 0, 0, f.segments[0].az, 19},
                                        {0, 1, 1, 0, 0, 0, f.segments[1].az, 14}};
    const std::vector<frame::Band> bands{{0, 0, 1}, {0, 0, 2}};
    f.frame.capsules = both;
    f.frame.bands = bands;
    const frame::Image image = f.draw();
    const std::uint8_t* centre = &image.pixels[4 * (100 * 200 + 100)];
    EXPECT_GT(centre[0], 60);
    EXPECT_EQ(centre[1], 0);
  }
}

TEST_P(RendererLaws, BandsChangeNoPixel) {
  Fixture f(GetParam());
  for (int i = 0; i < 60; ++i) {
    const float a = float(i) * .7f, z = 40.f - float(i);
    f.add({30 * std::cos(a), 30 * std::sin(a), z}, {-30 * std::cos(a + .3f), -30 * std::sin(a + .3f), z},
          .2f + float(i % 7));
  }
  std::vector<frame::Item> items;
  std::vector<frame::Band> bands;
  for (std::uint32_t i = 0; i < 60; ++i) {
    items.push_back({0, i, 1, 0, 0, 0, f.segments[i].az, 40});
    if (i % 10 == 9) bands.push_back({0, 0, i + 1});
  }
  f.frame.capsules = items;
  const frame::Image whole = f.draw();
  f.frame.bands = bands;
  EXPECT_EQ(f.draw().pixels, whole.pixels);
  EXPECT_GT(whole.covered, .2);
}

TEST_P(RendererLaws, ASphereIsRoundLitFromAboveAndTheSameAsADot) {
  Fixture f(GetParam());
  f.add({0, 0, 0}, {0, 0, 0}, 10.f);
  f.frame.subframes = 16;
  f.frame.capsules = f.items;
  const frame::Image image = f.draw();
  const double scale = f.frame.camera.focal(200.f) / 100.;
  EXPECT_NEAR(red_area(image), M_PI * 100 * scale * scale, .03 * M_PI * 100 * scale * scale);
  const auto red = [&](int x, int y) { return image.pixels[4 * std::size_t(y * 200 + x)]; };
  EXPECT_GT(red(100, 85), red(100, 115));
  f.frame.capsules = {};
  f.frame.dots = f.items;
  EXPECT_NEAR(red_area(f.draw()), red_area(image), .03 * red_area(image));
}

TEST_P(RendererLaws, WhatLiesBehindTheEyeIsNotDrawn) {
  Fixture f(GetParam());
  f.add({0, 0, 150}, {5, 5, 300}, 5.f);
  f.frame.capsules = f.items;
  EXPECT_EQ(f.draw().covered, 0.);
  f.frame.lines = f.items;
  EXPECT_EQ(f.draw().covered, 0.);
}

TEST_P(RendererLaws, WhatStandsRightBeforeTheEyeStaysWithinThePicture) {
  Fixture f(GetParam());
  f.frame.camera.near = .05f;
  for (int i = 0; i < 48; ++i) {
    const float size = std::pow(10.f, float(2 + i % 6)), turn = float(i) * .1309f;
    const Vec3 far(size * std::cos(turn), size * std::sin(turn), float(i % 5 - 2) * size);
    f.segments.clear();
    f.add(Vec3(.01f, -.02f, 99.94f) - far, Vec3(-.01f, .03f, 99.93f) + far, i % 2 ? .3f : 40.f);
    f.add(Vec3(size, -size, 99.9f), Vec3(size, -size, 99.9f), std::min(.5f * size, 6e4f));
    const std::vector<frame::Item> run = f.items, sphere{{0, 1, 1, 0, 0, 0, 0, 200}};
    f.frame.lines = i % 3 ? run : std::span<const frame::Item>();
    f.frame.capsules = i % 3 ? std::span<const frame::Item>() : run;
    f.frame.dots = sphere;
    f.frame.subframes = i % 4 ? 1 : 2;
    f.draw();
  }
}

// Linear light of a colour byte.
double light_of(std::uint8_t code) {
  const double c = code / 255.;
  return c <= .04045 ? c / 12.92 : std::pow((c + .055) / 1.055, 2.4);
}

// Mean linear light, red and green, of the pixels within 12 of the middle.
std::pair<double, double> middle_of(const frame::Image& image) {
  double red = 0., green = 0.;
  for (std::size_t y = 88; y < 112; ++y)
    for (std::size_t x = 88; x < 112; ++x) {
      red += light_of(image.pixels[4 * (y * 200 + x)]) / 576.;
      green += light_of(image.pixels[4 * (y * 200 + x) + 1]) / 576.;
    }
  return {red, green};
}

TEST_P(RendererLaws, TransparentThingsBlendAsTheirOpacitiesSayInAnyOrder) {
  // A red capsule before a green one; which of them comes first in the list, and which neuron it is, must not matter.
  for (const std::uint32_t subframes : {256u, 15u, 1u})
    for (const auto& [near, far] :
         {std::pair(128, 255), std::pair(64, 128), std::pair(200, 100), std::pair(255, 90)})
      for (const bool swapped : {false, true}) {
        Fixture f(GetParam());
        f.instances.push_back(f.instances[0]);
        f.add({-30, 0, swapped ? -20.f : 20.f}, {30, 0, swapped ? -20.f : 20.f}, 12.f);
        f.add({0, -30, swapped ? 20.f : -20.f}, {0, 30, swapped ? 20.f : -20.f}, 12.f);
        f.frame.palette.fill(Vec3(1, 0, 0));
        for (std::size_t i = 8; i < 16; ++i) f.frame.palette[i] = Vec3(0, 1, 0);
        f.states = {{}, {}};
        const std::size_t front = swapped ? 1 : 0;
        f.states[1 - front].colour_class = 1;
        f.frame.states = f.states;
        f.frame.subframes = subframes;
        const std::vector<frame::Item> both{{0, 0, 1, 0, 0, 0, 0, 80}, {1, 1, 1, 0, 0, 0, 0, 80}};
        f.frame.capsules = std::span(both).subspan(front, 1);
        const double red = middle_of(f.draw()).first;
        f.frame.capsules = std::span(both).subspan(1 - front, 1);
        const double green = middle_of(f.draw()).second;
        f.frame.capsules = both;
        f.states[front].opacity = std::uint8_t(near), f.states[1 - front].opacity = std::uint8_t(far);
        f.frame.states = f.states;
        const auto [seen_red, seen_green] = middle_of(f.draw());
        EXPECT_NEAR(seen_red / red, near / 255., .05) << subframes << " " << near << " " << far;
        EXPECT_NEAR(seen_green / green, (1. - near / 255.) * far / 255., .05)
            << subframes << " " << near << " " << far;
      }
}

// Triangles in the world of one colour, and what they point to.
struct Facets {
  std::vector<Vec3> positions, normals;
  std::vector<std::uint8_t> entries, openness, presence;
  std::vector<Triangle> triangles;

  /// A corner with its normal along z.
  std::uint32_t corner(const Vec3& at, std::uint8_t entry = 3, const Vec3& normal = Vec3::UnitZ()) {
    positions.push_back(at), normals.push_back(normal), entries.push_back(entry);
    return std::uint32_t(positions.size() - 1);
  }
  void triangle(const Vec3& a, const Vec3& b, const Vec3& c, std::uint8_t entry = 3) {
    triangles.push_back({corner(a, entry), corner(b, entry), corner(c, entry)});
  }
  frame::Surface surface() const {
    frame::Surface s;
    s.positions = positions, s.normals = normals, s.entries = entries, s.openness = openness;
    s.presence = presence;
    s.triangles = triangles;
    return s;
  }
};

// Where a point of the world is seen, as a pixel of the picture.
std::array<std::uint8_t, 3> pixel_at(const frame::Frame& frame, const frame::Image& image,
                                     const Vec3& point) {
  const Vec3 at = frame::project(frame.camera, {float(frame.width), float(frame.height)}, point);
  const std::size_t place = 4 * (std::size_t(at.y()) * image.width + std::size_t(at.x()));
  return {image.pixels[place], image.pixels[place + 1], image.pixels[place + 2]};
}

TEST_P(SurfaceLaws, BallsCoverTheirDiscsHoweverSmall) {
  Fixture f(GetParam());
  const double scale = f.frame.camera.focal(200.f) / 100.;
  for (const float radius : {.02f, .1f, .3f, 1.f, 6.f}) {
    std::vector<frame::Ball> balls;  // apart from one another, at many places within a pixel
    for (int i = 0; i < 25; ++i)
      balls.push_back({Vec3(-26.f + 13.07f * float(i % 5), -26.f + 13.13f * float(i / 5), 0.f), radius, 5});
    f.frame.balls = balls;
    f.frame.subframes = 64;
    EXPECT_NEAR(red_area(f.draw()) / (25. * scale * scale * M_PI * double(radius) * double(radius)), 1.,
                radius < .05f ? .25 : .05)
        << radius;
    f.frame.subframes = 1;
    f.draw();  // is sound, too
  }
}

TEST_P(SurfaceLaws, BallsHaveTheirColourAndAreHiddenByWhatIsNearer) {
  for (const bool behind : {false, true}) {
    Fixture f(GetParam());
    f.frame.palette[5] = Vec3(0, 1, 0);
    f.add({-20, 0, 0}, {20, 0, 0}, 4.f);
    f.frame.capsules = f.items;
    const std::vector<frame::Ball> balls{{Vec3(0, 0, behind ? -10.f : 10.f), 2.f, 5},
                                         {Vec3(0, 30, 500), 9.f, 5}};
    f.frame.balls = balls;
    const frame::Image image = f.draw();
    const std::size_t middle = 4 * (100 * 200 + 100);
    EXPECT_EQ(image.pixels[middle] < image.pixels[middle + 1], !behind);
    EXPECT_GT(image.pixels[middle] + image.pixels[middle + 1], 60);
  }
}

TEST_P(SurfaceLaws, BallsShowAsFarAsTheyAreOpaque) {
  for (const std::uint32_t subframes : {1u, 16u}) {
    Fixture f(GetParam());
    std::vector<frame::Ball> balls;
    for (int i = 0; i < 100; ++i)
      balls.push_back({Vec3(-30.f + 6.6f * float(i % 10), -30.f + 6.6f * float(i / 10), 0.f), 2.f, 5});
    f.frame.balls = balls;
    f.frame.subframes = subframes;
    const double whole = red_area(f.draw());
    for (frame::Ball& ball : balls) ball.opacity = 77;
    EXPECT_NEAR(red_area(f.draw()) / whole, 77. / 255., .06) << subframes;
    for (frame::Ball& ball : balls) ball.opacity = 0;
    EXPECT_EQ(red_area(f.draw()), 0.);
  }
}

TEST_P(SurfaceLaws, BallsThatAreNoneAreRefused) {
  for (const frame::Ball& wrong : {frame::Ball{Vec3(NAN, 0, 0), 1.f, 5},
                                   {Vec3::Zero(), -1.f, 5},
                                   {Vec3::Zero(), INFINITY, 5},
                                   {Vec3::Zero(), 1.f, 128}}) {
    Fixture f(GetParam());
    f.frame.balls = {&wrong, 1};
    EXPECT_THROW(f.draw(), Error);
  }
}

TEST_P(SurfaceLaws, ATriangleCoversItsPixels) {
  for (const auto projection : {frame::Projection::perspective, frame::Projection::orthographic})
    for (const float depth : {-40.f, 0.f, 50.f})
      for (const bool turned : {false, true}) {
        Fixture f(GetParam());
        f.frame.camera.projection = projection;
        f.frame.subframes = 16;
        const Vec3 a(-12, -8, depth), b(14, -5, depth), c(-3, 11, depth);
        Facets facets;
        turned ? facets.triangle(a, c, b) : facets.triangle(a, b, c);
        const std::vector surfaces{facets.surface()};
        f.frame.surfaces = surfaces;
        const frame::Image image = f.draw();
        const double scale = projection == frame::Projection::perspective
                                 ? f.frame.camera.focal(200.f) / (100. - depth)
                                 : f.frame.camera.focal(200.f);
        const double area = .5 * double((b - a).cross(c - a).norm()) * scale * scale;
        EXPECT_NEAR(red_area(image) / area, 1., .01) << depth;
        EXPECT_GT(pixel_at(f.frame, image, {-1, 0, depth})[0], 60);
        for (const Vec3& beside : {Vec3(-11, 0, depth), Vec3(8, 4, depth), Vec3(2, -9, depth)})
          EXPECT_EQ(pixel_at(f.frame, image, beside)[0], 0);
      }
}

TEST_P(SurfaceLaws, TrianglesSideBySideLeaveNoGapAndNoRim) {
  for (const auto& [eye, size] : {std::pair(100.f, 20.f), std::pair(4e5f, 8e4f), std::pair(.3f, .06f)}) {
    Fixture f(GetParam());
    f.frame.camera.eye.z() = eye, f.frame.camera.near = std::min(.5f, .1f * eye);
    Facets facets;
    constexpr int steps = 60;  // corners that no pixel's middle meets, not even in a turned grid
    for (int j = 0; j <= steps; ++j)
      for (int i = 0; i <= steps; ++i) {
        const float x = (float(i) / steps - .5f) * 2.f * size, y = (float(j) / steps - .5f) * 2.f * size;
        facets.corner({.98f * x - .17f * y, .17f * x + .98f * y, .3f * x * std::sin(9.f * y / size)});
      }
    const auto at = [](int i, int j) { return std::uint32_t(j * (steps + 1) + i); };
    for (int j = 0; j < steps; ++j)
      for (int i = 0; i < steps; ++i) {
        facets.triangles.push_back({at(i, j), at(i + 1, j), at(i + 1, j + 1)});
        facets.triangles.push_back({at(i, j), at(i + 1, j + 1), at(i, j + 1)});
      }
    const std::vector surfaces{facets.surface()};
    f.frame.surfaces = surfaces;
    const frame::Image image = f.draw();
    const float inside = .7f * size;
    for (float y = -inside; y <= inside; y += inside / 40.f)
      for (float x = -inside; x <= inside; x += inside / 40.f) {
        if (std::hypot(x, y) >= inside) continue;
        EXPECT_GT(pixel_at(f.frame, image, {x, y, 0.f})[0], 20) << x << " " << y << " of " << size;
      }
    EXPECT_EQ(pixel_at(f.frame, image, {1.6f * size, 0, 0})[0], 0);
  }
}

TEST_P(SurfaceLaws, TheNearestOfTrianglesAndSegmentsIsSeen) {
  for (const float depth : {-20.f, 20.f})
    for (const auto list : {&frame::Lists::capsules, &frame::Lists::lines, &frame::Lists::dots}) {
      Fixture f(GetParam());
      f.add({0, 0, 0}, {0, 0, 0}, 4.f);
      if (list == &frame::Lists::lines) f.segments[0].ax = -5.f, f.segments[0].bx = 5.f;
      f.frame.palette[5] = Vec3(0, 1, 0);
      f.frame.*list = f.items;
      Facets facets;
      facets.triangle({-30, -20, depth}, {30, -20, depth}, {0, 30, depth}, 5);
      const std::vector surfaces{facets.surface()};
      f.frame.surfaces = surfaces;
      f.frame.subframes = 4;
      const auto seen = pixel_at(f.frame, f.draw(), {.4f, .4f, 0});
      EXPECT_GT(seen[depth > 0.f ? 1 : 0], 60) << depth;
      EXPECT_EQ(seen[depth > 0.f ? 0 : 1], 0) << depth;
    }
}

TEST_P(SurfaceLaws, TrianglesMayPassTheEyeAndReachFarBeyondThePicture) {
  // The ground, three micrometres below the eye, from behind it to the horizon.
  for (const float reach : {1e3f, 1e5f, 1e6f}) {
    Fixture f(GetParam());
    f.frame.camera.near = .05f;
    Facets facets;
    const auto ground = [&](float x, float z) { return Vec3(x * reach, -3.f, 100.f + z * reach); };
    facets.triangle(ground(-1, 1), ground(1, 1), ground(0, -1));
    const std::vector surfaces{facets.surface()};
    f.frame.surfaces = surfaces;
    const frame::Image image = f.draw();
    // It ends .9 reach before the eye at the farthest, almost on the horizon; its sides leave the picture near the eye.
    EXPECT_GT(image.pixels[4 * (199 * 200 + 100)], 20) << reach;
    EXPECT_GT(image.pixels[4 * (199 * 200 + 2)], 20) << reach;
    EXPECT_GT(image.pixels[4 * (199 * 200 + 197)], 20) << reach;
    EXPECT_GT(image.pixels[4 * (110 * 200 + 100)], 20) << reach;
    EXPECT_EQ(image.pixels[4 * (98 * 200 + 100)], 0) << reach;
    EXPECT_EQ(image.pixels[4 * (5 * 200 + 100)], 0) << reach;
    EXPECT_NEAR(red_area(image), 2e4, 1500.) << reach;
    // Before the near distance nothing is seen of it.
    f.frame.camera.near = 20.f;
    EXPECT_EQ(f.draw().pixels[4 * (199 * 200 + 100)], 0) << reach;
  }
}

TEST_P(SurfaceLaws, WhatIsSeenThroughASurfaceIsItsShare) {
  for (const std::uint32_t subframes : {64u, 16u, 1u})
    for (const int opacity : {64, 128, 200}) {
      Fixture f(GetParam());
      f.frame.subframes = subframes;
      f.frame.palette[5] = Vec3(0, 1, 0);
      Facets before, behind;
      before.triangle({-40, -40, 20}, {40, -40, 20}, {0, 60, 20});
      behind.triangle({-40, -40, -20}, {40, -40, -20}, {0, 60, -20}, 5);
      frame::Surface front = before.surface(), back = behind.surface();
      const std::vector first{front}, second{back};
      f.frame.surfaces = first;
      const double red = middle_of(f.draw()).first;
      f.frame.surfaces = second;
      const double green = middle_of(f.draw()).second;
      front.opacity = std::uint8_t(opacity), back.opacity = std::uint8_t(255 - opacity / 2);
      const double share = opacity / 255., other = (255 - opacity / 2) / 255.;
      for (const auto& both : {std::vector{front, back}, std::vector{back, front}}) {
        f.frame.surfaces = both;
        const auto [seen_red, seen_green] = middle_of(f.draw());
        EXPECT_NEAR(seen_red / red, share, .06) << subframes;
        EXPECT_NEAR(seen_green / green, (1. - share) * other, .06) << subframes;
      }
      // Half present, it is half as opaque; and from end to end it goes over.
      before.presence.assign(3, 128);
      frame::Surface half = before.surface();
      half.opacity = std::uint8_t(opacity);
      const std::vector halves{half};
      f.frame.surfaces = halves;
      EXPECT_NEAR(middle_of(f.draw()).first / red, .5 * share, .06) << subframes;
      before.presence = {0, 255,
                         128};  // the picture's middle is halfway between the first two, and halfway up
      EXPECT_NEAR(middle_of(f.draw()).first / red, .5 * share, .1) << subframes;
      // A capsule behind shows through, too.
      f.add({-30, 0, 0}, {30, 0, 0}, 12.f);
      f.segments[0].meta = 5;
      f.frame.capsules = f.items;
      f.frame.surfaces = {};
      const double whole = middle_of(f.draw()).second;
      front.opacity = std::uint8_t(opacity);
      const std::vector one{front};
      f.frame.surfaces = one;
      EXPECT_NEAR(middle_of(f.draw()).second / whole, 1. - share, .06) << subframes;
    }
}

TEST_P(SurfaceLaws, SurfacesAreLitColouredAndPlacedAsTheySay) {
  Fixture f(GetParam());
  f.frame.subframes = 64;
  f.frame.palette[9] = Vec3(0, 1, 0), f.frame.palette[127] = Vec3(0, 0, 1);
  const Vec3 a(-30, -30, 0), b(30, -30, 0), c(0, 40, 0), towards(-.35f, .75f, .55f);
  Facets facets;
  facets.triangles.push_back({facets.corner(a, 9, towards.normalized()),
                              facets.corner(b, 127, towards.normalized()),
                              facets.corner(c, 9, towards.normalized())});
  const auto light_at = [&](const Vec3& place) {
    const std::vector surfaces{facets.surface()};
    f.frame.surfaces = surfaces;
    const auto pixel = pixel_at(f.frame, f.draw(), place);
    return std::array{light_of(pixel[0]), light_of(pixel[1]), light_of(pixel[2])};
  };
  const auto left = light_at({-28, -29, 0}), right = light_at({28, -29, 0}), between = light_at({0, -29, 0});
  EXPECT_GT(left[1], .9);
  EXPECT_LT(left[2], .1);
  EXPECT_GT(right[2], .9);
  EXPECT_LT(right[1], .1);
  EXPECT_NEAR(between[1], .5 * left[1], .16);  // what is lit fully is a fifth brighter than white
  EXPECT_NEAR(between[2], .5 * right[2], .16);
  EXPECT_EQ(between[0], 0.);
  // Turned away from the light, or where little of it gets, it is darker; from behind it is lit from behind.
  for (Vec3& normal : facets.normals) normal = Vec3(.35f, -.75f, .55f).normalized();
  const double away = light_at({-28, -29, 0})[1];
  EXPECT_LT(away, .6);
  std::swap(facets.triangles[0][1], facets.triangles[0][2]);
  EXPECT_NEAR(light_at({-28, -29, 0})[1], .16 + 1.05 * std::pow(1. - std::sqrt((away - .16) / 1.05), 2.),
              .04);
  std::swap(facets.triangles[0][1], facets.triangles[0][2]);
  for (Vec3& normal : facets.normals) normal = towards.normalized();
  facets.openness.assign(3, 51);  // a fifth
  EXPECT_NEAR(light_at({-28, -29, 0})[1], .16 + 1.05 * .04, .04);
  // In a neuron's coordinates: turned by a quarter about the view and moved.
  const float half = std::sqrt(.5f);
  f.instances.assign(1, {5, 0, -10, 0, 0, 0, half, half});
  facets.openness.clear();
  std::vector placed{facets.surface()};
  placed[0].instance = 0;
  f.frame.surfaces = placed;
  const frame::Image image = f.draw();
  EXPECT_GT(pixel_at(f.frame, image, {34, 28, -10})[2], 100);  // b
  EXPECT_GT(pixel_at(f.frame, image, {-30, 0, -10})[1], 100);  // near c
  EXPECT_EQ(pixel_at(f.frame, image, {-20, 20, -10})[1], 0);
  // The same number says the same arrays, another one others; colours are asked for every time.
  placed[0].version = 7;
  EXPECT_EQ(f.draw().pixels, image.pixels);
  EXPECT_EQ(f.draw().pixels, image.pixels);
  facets.entries.assign(3, 3);
  placed[0].entries = facets.entries;
  EXPECT_GT(pixel_at(f.frame, f.draw(), {34, 28, -10})[0], 100);
  for (Vec3& position : facets.positions) position.x() += 500.f;
  placed[0].version = 8;
  EXPECT_EQ(f.draw().covered, 0.);
}

TEST_P(SurfaceLaws, RefusesSurfacesThatBreakTheContract) {
  const auto refused = [](const auto& change) {
    Fixture f(GetParam());
    f.renderer->load({f.segments, f.instances});
    Facets facets;
    facets.triangle({-12, -8, 0}, {14, -5, 0}, {-3, 11, 0});
    frame::Surface surface;
    change(facets, surface);
    const std::uint32_t instance = surface.instance;
    surface = facets.surface();
    surface.instance = instance;
    const std::vector surfaces{surface};
    f.frame.surfaces = surfaces;
    try {
      f.renderer->draw(f.frame);
    } catch (const Error&) {
      return true;
    }
    return false;
  };
  EXPECT_FALSE(refused([](Facets&, frame::Surface&) {}));
  EXPECT_TRUE(refused([](Facets& x, frame::Surface&) { x.triangles[0][1] = 3; }));
  EXPECT_TRUE(refused([](Facets& x, frame::Surface&) { x.positions[0].y() = NAN; }));
  EXPECT_TRUE(refused([](Facets& x, frame::Surface&) { x.normals[0] *= 2.f; }));
  EXPECT_TRUE(refused([](Facets& x, frame::Surface&) { x.normals[0].x() = NAN; }));
  EXPECT_TRUE(refused([](Facets& x, frame::Surface&) { x.normals.pop_back(); }));
  EXPECT_TRUE(refused([](Facets& x, frame::Surface&) { x.entries[2] = 128; }));
  EXPECT_TRUE(refused([](Facets& x, frame::Surface&) { x.openness = {1, 2}; }));
  EXPECT_TRUE(refused([](Facets& x, frame::Surface&) { x.presence = {1}; }));
  EXPECT_TRUE(refused([](Facets&, frame::Surface& s) { s.instance = 1; }));
}

TEST_P(RendererLaws, OpacityOfAKindAndOfAPartAreObeyed) {
  Fixture f(GetParam());
  f.add({-20, 10, 0}, {20, 10, 0}, 6.f);
  f.add({-20, -10, 0}, {20, -10, 0}, 6.f);
  f.segments[0].meta = 2, f.segments[1].meta = 4;
  const std::vector<frame::Item> both{{0, 0, 3, 0, 0, 0, 0, 80}};
  for (const std::uint32_t subframes : {4u, 32u}) {
    f.frame.subframes = subframes;
    f.frame.opacities = frame::opaque();
    f.frame.capsules = both;
    const double whole = red_area(f.draw());
    f.frame.opacities[2] = 0;
    EXPECT_NEAR(red_area(f.draw()), .5 * whole, .02 * whole);
    f.frame.opacities = frame::opaque();
    // A part of the neuron, in a state of its own: the announcement is the neuron's.
    f.states[0].flags |= frame::State::parted;
    f.frame.states = f.states;
    const frame::State part{.opacity = 64};
    const std::vector<frame::Item> parts{{0, 0, 1, 0, 0, 0, 0, 80}, {0, 1, 1, packed(part), 0, 0, 0, 80}};
    f.frame.capsules = parts;
    EXPECT_NEAR(red_area(f.draw()), (.5 + .5 * 64. / 255.) * whole, .03 * whole);
    f.states[0].flags = frame::State::visible;
    f.frame.states = f.states;
  }
}

TEST_P(RendererLaws, ABranchDrawnAsDotsCoversItsArea) {
  Fixture f(GetParam());
  for (int i = 0; i < 40; ++i)  // apart from one another
    f.add({float(i % 8) * 7.f - 25.f, float(i / 8) * 10.f - 20.f, 0},
          {float(i % 8) * 7.f - 23.f, float(i / 8) * 10.f - 18.f, 0}, i % 2 ? .1f : .5f);
  std::vector<frame::Item> dots;
  for (std::uint32_t i = 0; i < 40; ++i) dots.push_back({0, i, 1, 0, 0, 0, 0, 200});
  f.frame.subframes = 64;
  f.frame.lines = std::vector<frame::Item>();
  f.frame.dots = dots;
  const double scale = f.frame.camera.focal(200.f) / 100.,
               expected = 20 * std::sqrt(8.) * 1.2 * scale * scale;
  EXPECT_NEAR(red_area(f.draw()), expected, .2 * expected);
}

TEST_P(RendererLaws, AnOrthographicCameraShowsThingsAsLargeAtAnyDepth) {
  for (const float depth : {-60.f, 0.f, 60.f}) {
    Fixture f(GetParam());
    f.frame.camera.projection = frame::Projection::orthographic;
    const double scale = f.frame.camera.focal(200.f);  // pixels a µm
    const auto draw_as = [&](std::span<const frame::Item> frame::Lists::*list) {
      f.frame.dots = f.frame.lines = f.frame.capsules = {};
      f.frame.*list = f.items;
      return f.draw();
    };
    f.frame.subframes = 16;
    f.add({12, -9, depth}, {12, -9, depth}, 8.f);
    const double disc = M_PI * 64. * scale * scale;
    for (const auto list : {&frame::Lists::capsules, &frame::Lists::dots}) {
      const frame::Image image = draw_as(list);
      EXPECT_NEAR(red_area(image) / disc, 1., .03) << depth;
      EXPECT_GT(pixel_at(f.frame, image, {12, -9, depth})[0], 60) << depth;
      EXPECT_EQ(pixel_at(f.frame, image, {12, 2, depth})[0], 0) << depth;
    }
    f.segments.clear();
    f.add({-20, 3, depth}, {15, -8, depth - 10}, 1.5f);  // a tube; and below a line and a capsule
    const double length = Vec3(35, -11, 0).norm();
    EXPECT_NEAR(red_area(draw_as(&frame::Lists::lines)) / (3. * length * scale * scale), 1., .05) << depth;
    const double tube = (3. * length + M_PI * 2.25) * scale * scale;
    EXPECT_NEAR(red_area(draw_as(&frame::Lists::capsules)) / tube, 1., .06) << depth;
    f.segments.clear();
    f.add({-20, 3, depth}, {15, -8, depth - 10}, 6.f);
    const double capsule = (12. * length + M_PI * 36.) * scale * scale;
    EXPECT_NEAR(red_area(draw_as(&frame::Lists::capsules)) / capsule, 1., .04) << depth;
  }
  // What lies behind the plane of the eye is not drawn, and what is marked is seen.
  Fixture f(GetParam());
  f.frame.camera.projection = frame::Projection::orthographic;
  f.add({0, 0, 110}, {5, 5, 300}, 5.f);
  f.frame.capsules = f.items;
  EXPECT_EQ(f.draw().covered, 0.);
  const std::vector<frame::Overlay> marks{{Vec3(-10, 0, -50), Vec3(10, 0, -50), 2.f, 5}};
  f.frame.overlays = marks;
  EXPECT_GT(red_area(f.draw()), 300.);
}

TEST_P(RendererLaws, GlassTintsWhatLiesBehindItAndNothingBefore) {
  for (const auto projection : {frame::Projection::perspective, frame::Projection::orthographic}) {
    Fixture f(GetParam());
    f.frame.camera.projection = projection;
    f.add({-12, 0, 20}, {-12, 0, 20}, 6.f);  // before
    f.add({12, 0, -20}, {12, 0, -20}, 6.f);  // behind
    f.frame.capsules = f.items;
    const frame::Image clear = f.draw();
    f.frame.glass = frame::Glass{.plane = Plane::through({1, 2, 0}, {0, 0, -1}),
                                 .low = {-24, -22},
                                 .high = {26, 18},
                                 .colour = {0, 0, 1},
                                 .opacity = .5f};
    for (const std::uint32_t subframes : {1u, 4u}) {
      f.frame.subframes = subframes;
      const frame::Image tinted = f.draw();
      const auto at = [&](const Vec3& point) { return pixel_at(f.frame, tinted, point); };
      EXPECT_EQ(at({-12, 0, 20})[2], 0);
      EXPECT_GT(at({-12, 0, 20})[0], 60);
      EXPECT_GT(at({12, 0, -20})[2], 100);
      EXPECT_LT(at({12, 0, -20})[0], pixel_at(f.frame, clear, {12, 0, -20})[0]);
      EXPECT_GT(at({12, 0, -20})[0], 20);
      EXPECT_GT(at({0, -15, 0})[2], 100);  // nothing, seen through it
      // Its edges, in the world: x from -25 to 25 (the right of what is seen from behind points to -x), y from -20 to 20.
      for (const float side : {-1.f, 1.f}) {
        EXPECT_GT(at({side * 24.f, -19.f, 0})[2], 100) << side;
        EXPECT_EQ(at({side * 26.f, -19.f, 0})[2], 0) << side;
        EXPECT_GT(at({0, side * 19.f, 0})[2], 100) << side;
        EXPECT_EQ(at({0, side * 21.f, 0})[2], 0) << side;
      }
    }
  }
}

TEST_P(RendererLaws, WhatIsWantedOfAPictureIsThatOfTheWholePicture) {
  Fixture f(GetParam());
  f.add({-20, 3, 0}, {15, -8, 0}, 5.f);
  f.add({-30, -9, 9}, {35, 20, -5}, .4f);
  f.frame.capsules = f.items;
  f.frame.style.halo = 1.f;
  const frame::Area area{61, 80, 130, 143};
  for (const std::uint32_t subframes : {1u, 4u}) {
    f.frame.subframes = subframes;
    f.frame.area.reset();
    const frame::Image whole = f.draw();
    f.frame.area = area;
    const frame::Image part = f.draw();
    for (std::uint32_t y = area.top + 2; y < area.bottom - 2; ++y)
      for (std::uint32_t x = area.left + 2; x < area.right - 2; ++x)
        for (std::size_t c = 0; c < 3; ++c)
          ASSERT_EQ(part.pixels[4 * (y * 200 + x) + c], whole.pixels[4 * (y * 200 + x) + c]) << x << " " << y;
  }
  // Of squares that are not wanted, none.
  std::vector<std::uint8_t> unwanted(25 * 25, 0);
  for (std::size_t i = 0; i < unwanted.size(); ++i) unwanted[i] = i % 25 < 9 || i / 25 > 15;
  for (const std::uint32_t subframes : {1u, 4u}) {
    f.frame.subframes = subframes;
    f.frame.area.reset(), f.frame.unwanted = {};
    const frame::Image whole = f.draw();
    f.frame.unwanted = unwanted;
    const frame::Image part = f.draw();
    for (std::uint32_t y = 0; y < 126; ++y)
      for (std::uint32_t x = 74; x < 200; ++x)
        for (std::size_t c = 0; c < 3; ++c)
          ASSERT_EQ(part.pixels[4 * (y * 200 + x) + c], whole.pixels[4 * (y * 200 + x) + c]) << x << " " << y;
  }
  f.frame.unwanted = std::span(unwanted).first(600);
  EXPECT_THROW(f.renderer->draw(f.frame), Error);
  f.frame.unwanted = {};
  f.frame.area = frame::Area{0, 0, 201, 10};
  EXPECT_THROW(f.renderer->draw(f.frame), Error);
}

TEST_P(RendererLaws, RefusesAFrameThatBreaksTheContract) {
  Fixture f(GetParam());
  f.add({0, 0, 0}, {1, 1, 1}, 1.f);
  f.renderer->load({f.segments, f.instances});
  f.frame.width = 0;
  EXPECT_THROW(f.renderer->draw(f.frame), Error);
}

TEST_P(RendererLaws, WhatIsRevealedBelongsToThePicture) {
  Fixture f(GetParam());
  f.add({-20, 3, 0}, {15, -8, 0}, 9.f);
  f.add({-20, -3, -30}, {25, 9, -30}, .4f);
  f.frame.subframes = 4;
  f.frame.capsules = f.items;
  const frame::Image whole = f.draw();
  const std::vector<frame::Item> first{{0, 0, 1, 0, 0, 0, 0, 200}}, second{{0, 1, 1, 0, 0, 0, 0, 200}};
  f.frame.capsules = first;
  int asked = 0;
  f.frame.rest = [&](const frame::DepthMap& seen, std::uint32_t round) {
    if (round > 0) return frame::Lists{};
    ++asked;
    EXPECT_EQ(seen.width, 25u);
    EXPECT_EQ(seen.depths.size(), 625u);
    EXPECT_NEAR(seen.depths[12 * 25 + 12], 92.f,
                1.f);  // near the front of the capsule, the farthest of 64 pixels
    EXPECT_TRUE(std::isinf(seen.depths[0]));
    frame::Lists more;
    more.capsules = second;
    return more;
  };
  EXPECT_EQ(f.draw().pixels, whole.pixels);
  EXPECT_GE(asked, 1);  // once for all subframes that are drawn together
  EXPECT_EQ(f.renderer->seen().depths.size(), 625u);
}

TEST_P(RendererLaws, AStrawLiesInTheWorldAndLooksAsItsOwner) {
  Fixture f(GetParam());
  f.frame.subframes = 16;
  f.frame.palette[8 * 5 + 3] = Vec3(1, .2f, .1f), f.frame.palette[8 * 2 + 3] = Vec3(.1f, .2f, 1);
  f.add({-20, 3, 0}, {15, -8, 0}, 1.f);
  f.add({-20, -12, 0}, {15, 12, -30}, 1.f);
  f.instances = {{0, 0, 0, 0, 0, 0, 0, 1}, {0, 0, 0, 0, 0, 0, 0, 1}};
  f.frame.lines = f.items;
  const auto draw = [&](std::span<const frame::Item> items, std::span<const frame::Instance> instances,
                        std::span<const frame::State> states, std::span<const frame::Owner> owners) {
    f.renderer->load({f.segments, instances, owners});
    f.frame.lines = items, f.frame.states = states;
    f.renderer->draw(f.frame);
    return f.renderer->read();
  };
  const std::vector<frame::State> states{{.colour_class = 5}, {.colour_class = 2}};
  const std::vector<frame::Item> apart{{0, 0, 1, 0, 0, 0, 0, 200}, {1, 1, 1, 0, 0, 0, 0, 200}},
      straws{{FOREST_IN_WORLD, 0, 3, 0, 0, 0, 0, 200}};
  const frame::Image expected = draw(apart, f.instances, states, {});
  // Instances that stand elsewhere do not matter.
  const std::vector<frame::Instance> elsewhere{{500, 0, 0, 0, 0, 0, 0, 1}, {0, 0, 900, 0, 0, 0, 0, 1}};
  const std::vector<frame::Owner> owners{{0, 0}, {1, 1}};
  EXPECT_EQ(draw(straws, elsewhere, states, owners).pixels, expected.pixels);
  const std::vector<frame::Item> mixed{{0, 0, 1, 0, 0, 0, 0, 200}, {FOREST_IN_WORLD, 1, 1, 0, 0, 0, 0, 200}};
  EXPECT_EQ(draw(mixed, f.instances, states, std::span(owners).last(1)).pixels, expected.pixels);
  // Nor does what was loaded before.
  const std::vector<frame::Segment> many(40, f.segments[0]);
  f.renderer->load({many, f.instances, std::vector<frame::Owner>(30, frame::Owner{0, 0})});
  EXPECT_EQ(draw(straws, elsewhere, states, owners).pixels, expected.pixels);
  EXPECT_THROW(draw(straws, elsewhere, states, std::span(owners).last(1)), Error);
}

TEST_P(RendererLaws, AStrawIsDrawnForItsLikeInEverySampleOrInNone) {
  Fixture f(GetParam());
  f.frame.subframes = 16, f.frame.thinnest = 1.f;
  f.add({-20, 3, 0}, {15, -8, 0}, .05f);
  const std::vector<frame::Item> straws{{FOREST_IN_WORLD, 0, 1, 0, 0, 0, 0, 200}};
  const std::vector<frame::Owner> owners{{0, 0}};
  f.frame.lines = straws;
  std::vector<double> areas;  // of those that are drawn
  for (std::uint32_t rank = 0; rank < 256; rank += 16) {
    f.segments[0].meta = 3u | rank << 8 | to_half(.04f) << 16;
    f.renderer->load({f.segments, f.instances, owners});
    f.renderer->draw(f.frame);
    if (const double area = red_area(f.renderer->read()); area > 0.) areas.push_back(area);
  }
  ASSERT_GT(areas.size(), 2u);
  EXPECT_LT(areas.size(), 14u);
  EXPECT_NEAR(std::ranges::min(areas), std::ranges::max(areas), .02 * std::ranges::max(areas));
}

TEST_P(RendererLaws, SegmentsMayHaveColoursOfTheirOwn) {
  Fixture f(GetParam());
  f.frame.palette.fill(Vec3::Zero());
  f.frame.palette[3] = Vec3(1, 0, 0);  // of the colour class, which is not asked
  f.frame.palette[40] = Vec3(0, 1, 0), f.frame.palette[41] = Vec3(0, 0, 1);
  f.frame.subframes = 4;
  const auto channels = [](const frame::Image& image) {
    std::array<double, 3> sum{};
    for (std::size_t i = 0; i < image.pixels.size(); ++i)
      if (i % 4 < 3) sum[i % 4] += image.pixels[i];
    return sum;
  };
  f.add({-30, 10, 0}, {-5, 10, 0}, 3.f);
  f.add({5, 10, 0}, {30, 10, 0}, 3.f);
  f.add({0, -20, 0}, {0, -20, 0}, 4.f);
  std::vector<std::uint8_t> entries(frame::cluster_size), others(frame::cluster_size, 41);
  entries[0] = 40, entries[1] = 41;
  const std::vector<std::uint8_t> of_dots{40};
  const std::vector<frame::Item> run{{0, 0, 3, 0, 0, 0, 0, 200}}, dot{{0, 2, 1, 0, 0, 0, 0, 200}};
  for (const bool as_lines : {false, true}) {
    f.frame.capsules = f.frame.lines = f.frame.dots = {};
    f.frame.entries = {};
    (as_lines ? f.frame.lines : f.frame.capsules) = run;
    (as_lines ? f.frame.entries.lines : f.frame.entries.capsules) = entries;
    const auto two = channels(f.draw());
    EXPECT_EQ(two[0], 0.);
    EXPECT_GT(two[1], 1000.);
    EXPECT_NEAR(two[2] / two[1], 1., .1);  // as long and as thick
    f.frame.dots = dot, f.frame.entries.dots = of_dots;
    const auto three = channels(f.draw());
    EXPECT_GT(three[1], two[1] + 1000.);
    EXPECT_NEAR(three[2], two[2], .01 * two[2]);
  }
  // Items of later bands find theirs.
  const std::vector<frame::Item> halves{{0, 0, 1, 0, 0, 0, 0, 200}, {0, 1, 1, 0, 0, 0, 0, 200}};
  const std::vector<frame::Band> bands{{0, 0, 1}, {0, 0, 2}};
  std::vector<std::uint8_t> of_halves(2 * frame::cluster_size);
  of_halves[0] = 40, of_halves[frame::cluster_size] = 41;
  f.frame.dots = f.frame.lines = {}, f.frame.entries = {};
  f.frame.capsules = run, f.frame.entries.capsules = entries;
  const auto before = channels(f.draw());
  f.frame.capsules = halves, f.frame.entries.capsules = of_halves, f.frame.bands = bands;
  EXPECT_EQ(channels(f.draw()), before);
  f.frame.bands = {};
  // What is revealed brings its own, also when the picture is drawn several times.
  f.frame.rest = [&](const frame::DepthMap&, std::uint32_t round) {
    frame::Lists more;
    if (round > 0) return more;
    more.capsules = dot, more.entries.capsules = others;
    return more;
  };
  const auto after = channels(f.draw());
  EXPECT_NEAR(after[1], before[1], .01 * before[1]);
  EXPECT_GT(after[2], before[2] + 1000.);
  f.frame.rest = {};
  f.frame.entries.capsules = entries;  // for one of the two
  EXPECT_THROW(f.renderer->draw(f.frame), Error);
  of_halves[40] = 128;
  f.frame.entries.capsules = of_halves;
  EXPECT_THROW(f.renderer->draw(f.frame), Error);
}

}  // namespace
}  // namespace forest::render
