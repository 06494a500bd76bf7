// SPDX-License-Identifier: Apache-2.0
#include "forest/render/cpu/past.h"

#include "forest/core/parallel.h"
#include "forest/core/random.h"
#include "forest/frame/similarity.h"
#include "forest/render/cpu/cpu_renderer.h"

#include "tests/renderer_laws.h"

namespace forest::render {
namespace {

std::unique_ptr<Renderer> make() { return std::make_unique<CpuRenderer>(); }

// A thicket in front of nothing, seen from pictures that follow one another.
struct Thicket : Fixture {
  std::vector<frame::Item> all;
  std::uint32_t picture = 0;

  explicit Thicket(std::uint64_t seed = 3) : Fixture(make) {
    Random random(seed);
    const auto place = [&](double reach) {
      return Vec3(float(random.uniform(-30., 30.)), float(random.uniform(-30., 30.)), float(random.uniform(-reach, reach)));
    };
    for (int i = 0; i < 400; ++i) {
      const Vec3 a = place(30.);
      add_segment(a, a + .4f * place(20.), .05f + .0025f * float(i % 100), .05f);
    }
    for (std::uint32_t i = 0; i < 400; ++i) all.push_back({0, i, 1, 0, 0, 0, 0, 80});
    frame.capsules = all;
    frame.subframes = 16;
    frame.style.halo = 1.f;
  }
  frame::Image still() {
    const frame::Frame before = frame;
    frame.past = 0, frame.first_subframe = 0, frame.last_subframe = 16;
    const frame::Image image = drawn_by(*make());
    frame = before;
    return image;
  }
  frame::Image next(std::uint32_t drawn, std::uint64_t past = 1) {
    frame.past = past;
    frame.first_subframe = drawn * picture++ % 16, frame.last_subframe = frame.first_subframe + drawn;
    return draw();
  }
};

TEST(Past, ACameraAtRestHasTheStillPicture) {
  for (const std::uint32_t drawn : {1u, 4u}) {
    Thicket f;
    double before = 0.;
    for (std::uint32_t i = 0; i < 16 / drawn; ++i) {
      const double alike = similarity(f.next(drawn), f.still());
      EXPECT_GE(alike, before - .02) << drawn << ", picture " << i;
      before = alike;
    }
    // All of its samples; their shades are rounded by other noise.
    EXPECT_LT(change(f.next(drawn), f.still()), .25) << drawn;
    EXPECT_GT(similarity(f.next(drawn), f.still()), .995) << drawn;
  }
}

TEST(Past, AMovingPictureIsMoreLikeTheStillOneThanWhatIsDrawnOfIt) {
  for (const std::uint32_t drawn : {1u, 4u}) {
    Thicket f, alone;
    for (std::uint32_t i = 0; i < 24; ++i) {
      f.frame.camera.eye = alone.frame.camera.eye = Vec3(.15f * float(i), 0.f, 100.f - .3f * float(i));
      const frame::Image with = f.next(drawn), without = alone.next(drawn, i + 1), still = f.still();
      if (i >= 16) {
        EXPECT_GT(similarity(with, still), .4 + .6 * similarity(without, still)) << drawn << ", picture " << i;
      }
    }
  }
}

TEST(Past, WhatSomethingElseLookedLikeIsForgotten) {
  const auto picture = [](auto&& before) {
    Thicket f;
    before(f);
    f.picture = 2;
    return f.next(4, 2).pixels;
  };
  const auto alone = picture([](Thicket&) {});
  EXPECT_EQ(picture([](Thicket& f) { f.next(4, 1); }), alone);  // another number
  EXPECT_EQ(picture([](Thicket& f) { f.frame.width = 160, f.next(4, 2), f.frame.width = 200; }), alone);
  EXPECT_NE(picture([](Thicket& f) { f.next(4, 2); }), alone);
}

TEST(Past, APictureOfThePastIsAFunctionOfThoseBeforeAtAnyNumberOfThreads) {
  const auto last = [](unsigned threads) {
    const ThreadLimit limit(threads);
    Thicket f;
    frame::Image image;
    for (int i = 0; i < 6; ++i) f.frame.camera.eye.x() = float(i), image = f.next(4);
    return image.pixels;
  };
  EXPECT_EQ(last(1), last(4));
}

}  // namespace
}  // namespace forest::render
