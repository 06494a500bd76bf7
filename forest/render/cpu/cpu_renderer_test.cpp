// SPDX-License-Identifier: Apache-2.0
#include "forest/render/cpu/cpu_renderer.h"

#include "forest/core/half.h"
#include "forest/core/parallel.h"
#include "forest/core/random.h"
#include "forest/render/cpu/arithmetic.h"

#include "tests/renderer_laws.h"

namespace forest::render {
namespace {

std::unique_ptr<Renderer> make() { return std::make_unique<CpuRenderer>(); }
INSTANTIATE_TEST_SUITE_P(Processor, RendererLaws, testing::Values(make));
INSTANTIATE_TEST_SUITE_P(Processor, SurfaceLaws, testing::Values(make));

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
