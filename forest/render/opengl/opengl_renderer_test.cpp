// SPDX-License-Identifier: Apache-2.0
#include <string>
#include <utility>

#include <epoxy/gl.h>

#include "forest/core/random.h"
#include "forest/render/opengl/offscreen.h"

#include "tests/refused.h"
#include "tests/renderer_laws.h"

namespace forest::render {
namespace {

std::unique_ptr<Renderer> make() { return std::make_unique<OffscreenRenderer>(); }
std::unique_ptr<Renderer> as_cards() { return std::make_unique<OffscreenRenderer>(Habit::of_cards); }
INSTANTIATE_TEST_SUITE_P(OpenGL, RendererLaws, testing::Values(make, as_cards));
INSTANTIATE_TEST_SUITE_P(OpenGL, SurfaceLaws, testing::Values(make, as_cards));

// What is large, long or small, and more of it than a queue holds.
TEST(OpenGL, HoweverWorkIsCutThePictureIsTheSame) {
  const auto drawn = [](Maker maker, bool overflowing) {
    Fixture f(maker);
    Random random(5);
    const auto place = [&](float far) {
      return Vec3(float(random.uniform(-far, far)), float(random.uniform(-far, far)),
                  float(random.uniform(-60, 90)));
    };
    for (std::uint32_t i = 0; i < (overflowing ? 3000u : 300u); ++i) {
      const Vec3 from = place(60.f), way = place(i % 3 ? 4.f : 40.f);
      f.add(from, from + way, overflowing ? 12.f : std::exp(float(random.uniform(-4., 2.))));
    }
    std::vector<frame::Item> items;
    for (std::uint32_t i = 0; i < f.segments.size(); i += frame::cluster_size)
      items.push_back({0, i, frame::first_segments(f.segments.size() - i), 0, 0, 0, 0, 1000});
    const auto third = items.begin() + std::ptrdiff_t(items.size() / 3);
    const std::vector<frame::Item> lines(items.begin(), third), capsules(third, items.end());
    f.frame.lines = lines, f.frame.capsules = capsules;
    if (overflowing) f.frame.width = f.frame.height = 900;
    return f.draw();
  };
  for (const bool overflowing : {false, true}) {
    const auto a = drawn(make, overflowing), b = drawn(as_cards, overflowing);
    EXPECT_GT(a.covered, .5);
    EXPECT_EQ(a.covered, b.covered);
    std::size_t other = 0;
    for (std::size_t i = 0; i < a.pixels.size(); ++i) other += std::abs(a.pixels[i] - b.pixels[i]) > 1;
    EXPECT_LT(double(other), 1e-4 * double(a.pixels.size()));
  }
}

// Sets what a driver answers, and puts it right again.
template <class Function>
class Answer {
 public:
  Answer(Function& of, Function instead) : of_(of), before_(std::exchange(of, instead)) {}
  ~Answer() { of_ = before_; }

 private:
  Function& of_;
  Function before_;
};

TEST(OpenGL, ACardThatWasResetIsToldAndDrawsNoBlackPicture) {
  Fixture f(make);
  f.add({-20, 3, 0}, {15, -8, 0}, 6.f);
  f.frame.capsules = f.items;
  EXPECT_GT(f.draw().covered, 0.);
  {
    const Answer lost(
        epoxy_glGetGraphicsResetStatus, +[]() -> GLenum { return GL_UNKNOWN_CONTEXT_RESET; });
    EXPECT_NE(refused([&] { f.renderer->draw(f.frame); }).find("graphics card was reset"), std::string::npos);
    EXPECT_NE(refused([&] { (void)f.renderer->read(); }).find("graphics card was reset"), std::string::npos);
  }
  EXPECT_GT(f.draw().covered, 0.);
}

TEST(OpenGL, WhatADriverWouldReadInPartIsRefused) {
  Fixture f(make);
  f.add({-20, 3, 0}, {15, -8, 0}, 6.f);
  f.frame.capsules = f.items;
  {
    const Answer small(
        epoxy_glGetIntegerv, +[](GLenum name, GLint* value) {
          if (name == GL_MAX_TEXTURE_BUFFER_SIZE) *value = 1000;
        });
    EXPECT_NE(refused([&] { f.draw(); }).find("too large for the graphics driver"), std::string::npos);
  }
  EXPECT_GT(f.draw().covered, 0.);
}

}  // namespace
}  // namespace forest::render
