// SPDX-License-Identifier: Apache-2.0
#include "forest/render/cpu/cpu_renderer.h"

#include "forest/core/half.h"
#include "forest/core/parallel.h"
#include "forest/core/random.h"
#include "forest/render/cpu/arithmetic.h"
#include "forest/render/cpu/canvas.h"
#include "forest/render/cpu/primitives.h"

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

// Of any number of lines, thin or wide, beside the square or across it, exactly the samples are drawn that they cover.
template <int S>
void expect_lines_where_they_are() {
  const cpu::Samples<S> samples(0, S);
  cpu::Canvas canvas;
  canvas.resize(64, 64, S, (1u << S) - 1u, {0, 0, 64, 64});
  const cpu::Square square = canvas.square(0);
  canvas.clear(square);
  cpu::Window<S> window(canvas, square);
  auto rows = std::make_unique<cpu::Rows<S>>(samples);
  std::vector<std::uint32_t> expected(std::size_t(64 * 64 * S), FOREST_KEY_EMPTY);
  Random random(7);
  auto run = std::make_unique<cpu::Run>();
  for (int n = 0; n < 600; ++n) {
    const float first = float(std::int32_t(random.uniform(-20., 70.))),
                steps = float(std::int32_t(random.uniform(1., 40.)));
    const float half = float(n % 5 == 0 ? random.uniform(2., 90.) : random.uniform(.02, 1.));
    const bool steep = n % 2, beside = n % 3 == 0;  // a third has nothing in the square
    run->first[0] = std::max(first, 0.f), run->last[0] = std::min(first + steps, 64.f);
    run->y[0] = beside ? -2000.f : float(random.uniform(-5., 70.)),
    run->slope[0] = float(random.uniform(-1., 1.));
    run->line_width[0] = 2.f * half, run->z[0] = float(100 * (n * 7 % 600)), run->rise[0] = 0.f;
    run->begin[0] = float(random.uniform(-.5, .5)), run->length[0] = run->last[0] - run->first[0] - .3f;
    run->payload[0] = std::uint32_t(n % 100) << 5, run->steep[0] = steep, run->opacity[0] = 255;
    const cpu::Stroke line(*run, 0);
    rows->add(line, window);
    for (std::int32_t x = line.first; x < line.last; ++x)
      for (std::int32_t y = 0; y < 64; ++y)
        for (int k = 0; k < S; ++k) {
          const float along = steep ? samples.y[k] : samples.x[k],
                      across = steep ? samples.x[k] : samples.y[k], at = line.begin + float(x - line.first);
          const float t =
              (float(y) - line.y - line.slope * float(x - line.first) - across + line.slope * along) / half;
          if (!(std::abs(t) < 1.f && at >= along && at < along + line.length)) continue;
          std::uint32_t& key = expected[std::size_t(((steep ? x : y) * 64 + (steep ? y : x)) * S + k)];
          key = std::min(key, cpu::key_of(line.z, line.payload));
        }
  }
  rows->draw(window);
  std::size_t drawn = 0, otherwise = 0;
  for (std::int32_t y = 0; y < 64; ++y)
    for (std::int32_t x = 0; x < 64; ++x)
      for (int k = 0; k < S; ++k) {
        const std::uint32_t key = canvas.at(x, y)[k] >> 5,
                            should = expected[std::size_t((y * 64 + x) * S + k)] >> 5;
        drawn += key != FOREST_KEY_EMPTY >> 5, otherwise += key != should;
      }
  EXPECT_GT(drawn, std::size_t(64 * 64 * S / 2));
  EXPECT_LE(otherwise, drawn / 10'000);  // on a line's very edge
}
TEST(Rows, ShowOfEachLineWhatItCovers) {
  expect_lines_where_they_are<4>();
  expect_lines_where_they_are<16>();
}

TEST(Arithmetic, IsAsExactAsItSays) {
  for (float x = 1e-30f; x < 1e30f; x *= 1.0371f) {
    EXPECT_NEAR(cpu::log2_of(x), std::log2(double(x)), 1e-7 * std::abs(std::log2(double(x))) + 2e-7) << x;
    const float exponent = std::log2(x);
    EXPECT_NEAR(cpu::roughly_exp2_of(exponent) / std::exp2(double(exponent)), 1., 1e-4) << exponent;
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
