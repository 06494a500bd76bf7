// SPDX-License-Identifier: Apache-2.0
#include "forest/render/cpu/cpu_renderer.h"

#include "forest/core/half.h"
#include "forest/core/parallel.h"
#include "forest/core/random.h"
#include "forest/render/cpu/arithmetic.h"
#include "forest/render/cpu/canvas.h"

#include "tests/renderer_laws.h"

namespace forest::render {
namespace {

std::unique_ptr<Renderer> make() { return std::make_unique<CpuRenderer>(); }
INSTANTIATE_TEST_SUITE_P(Processor, RendererLaws, testing::Values(make));
INSTANTIATE_TEST_SUITE_P(Processor, SurfaceLaws, testing::Values(make));

// What shows only through gaps counts as hidden, but for some thousandths of its distance; elsewhere the farthest decides.
TEST(Canvas, SeesPastGapsAsFarAsItIsAllowed) {
  Random random(2);
  for (const int samples : {1, 4, 16})
    for (const float gaps : {0.f, .2f}) {
      cpu::Canvas canvas;
      std::vector<std::uint8_t> unwanted(8 * 5, 0);
      for (std::size_t y = 0; y < 2; ++y) std::fill_n(&unwanted[8 * y + 5], 3, 1);
      canvas.resize(64, 40, samples, (1u << samples) - 1u, {8, 0, 64, 40}, unwanted, gaps);
      std::vector<float> depths;
      for (std::size_t n = 0; n < canvas.squares(); ++n) {
        canvas.clear(canvas.square(n));
        for (std::int32_t y = 16; y < 24; ++y)
          for (std::int32_t x = 8; x < 16; ++x)
            for (int k = 0; k < samples; ++k) {
              depths.push_back(float(random.uniform(20., 900.)));
              canvas.at(x, y)[k] = cpu::key_of(cpu::depth_code(depths.back()), 7);
            }
        canvas.look(canvas.square(n));
      }
      ASSERT_EQ(canvas.squares(), 1u);
      std::ranges::sort(depths);
      const float far = depths[depths.size() - 1 - std::size_t(float(depths.size()) * gaps)];
      const auto hidden = [&](float x, float y, float depth) {
        return canvas.hidden(canvas.square(0), x, y, x + 1.f, y + 1.f, cpu::depth_code(depth));
      };
      EXPECT_TRUE(hidden(10.f, 18.f, far * 1.005f));
      EXPECT_FALSE(hidden(10.f, 18.f, far * .99f));
      EXPECT_FALSE(hidden(20.f, 18.f, 5000.f));  // empty
      EXPECT_TRUE(hidden(50.f, 8.f, 1.f));       // unwanted
      const frame::DepthMap map = canvas.depth_map();
      EXPECT_EQ(map.left, 1u);
      EXPECT_EQ(map.width, 7u);
      ASSERT_EQ(map.depths.size(), 35u);
      EXPECT_NEAR(map.depths[2 * 7] / far, 1.f, .005f);
      EXPECT_TRUE(std::isinf(map.depths[2 * 7 + 1]));
    }
}

TEST(Arithmetic, IsAsExactAsItSays) {
  for (float x = 1e-30f; x < 1e30f; x *= 1.0371f) {
    EXPECT_NEAR(cpu::log2_of(x), std::log2(double(x)), 1e-7 * std::abs(std::log2(double(x))) + 2e-7) << x;
    const float exponent = std::log2(x);
    EXPECT_NEAR(cpu::exp2_of(exponent) / std::exp2(double(exponent)), 1., 6e-7) << exponent;
  }
  for (float x = 1e-30f, before = -200.f; x < 1e-29f; x = std::nextafter(x * 1.00001f, 1.f)) {
    EXPECT_GE(cpu::log2_of(x), before);
    before = cpu::log2_of(x);
  }
  for (std::uint32_t half = 0; half < 0x7c00; ++half)
    EXPECT_EQ(from_half(half), float(Eigen::numext::bit_cast<Eigen::half>(std::uint16_t(half))));
}

TEST(CpuRenderer, TheNumberOfThreadsChangesNoPixel) {
  const auto picture = [](unsigned threads) {
    const ThreadLimit limit(threads);
    Fixture f(+[]() -> std::unique_ptr<Renderer> { return std::make_unique<CpuRenderer>(); });
    for (int i = 0; i < 60; ++i) {
      const float a = float(i) * .7f;
      f.add({30 * std::cos(a), 30 * std::sin(a), 40.f - float(i)},
            {-30 * std::cos(a), -30 * std::sin(a), 0.f}, .05f * float(i % 17));
    }
    std::vector<frame::Item> items;
    for (std::uint32_t i = 0; i < 3000; ++i) items.push_back({0, i % 60, 1, 0, 0, 0, 0, 80});
    f.frame.capsules = items;
    f.frame.lines = items;
    return f.draw().pixels;
  };
  EXPECT_EQ(picture(1), picture(4));
}

}  // namespace
}  // namespace forest::render
