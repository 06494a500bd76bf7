// SPDX-License-Identifier: Apache-2.0
#include "forest/frame/soften.h"

#include <algorithm>
#include <array>
#include <random>

#include <gtest/gtest.h>

#include "forest/core/parallel.h"

namespace forest::frame {
namespace {

Image noise(std::uint32_t width, std::uint32_t height) {
  Image image;
  image.width = width, image.height = height;
  std::mt19937 random(5);
  for (std::uint32_t i = 0; i < 4 * width * height; ++i) image.pixels.push_back(std::uint8_t(random()));
  return image;
}

TEST(Soften, IsTheProductOfTwoKernelsToARounding) {
  for (const auto& [width, height] : {std::pair{2u, 1u}, {3u, 5u}, {97u, 70u}}) {
    const Image before = noise(width, height);
    Image after;
    soften(before, .125f, after);
    const auto at = [&](int x, int y, std::size_t c) {
      const auto column = std::size_t(std::clamp(x, 0, int(width) - 1)),
                 line = std::size_t(std::clamp(y, 0, int(height) - 1));
      return double(before.pixels[4 * (line * width + column) + c]);
    };
    constexpr std::array weight{.125, .75, .125};
    for (int y = 0; y < int(height); ++y)
      for (int x = 0; x < int(width); ++x)
        for (std::size_t c = 0; c < 4; ++c) {
          double sum = 0.;
          for (int j = -1; j <= 1; ++j)
            for (int i = -1; i <= 1; ++i)
              sum += weight[std::size_t(i + 1)] * weight[std::size_t(j + 1)] * at(x + i, y + j, c);
          ASSERT_NEAR(double(after.pixels[4 * (std::size_t(y) * width + std::size_t(x)) + c]), sum, 1.01);
        }
  }
}

TEST(Soften, LeavesOneColourAndNoShareAlone) {
  Image flat = noise(9, 4);
  flat.pixels.assign(flat.pixels.size(), 255);
  const auto before = flat.pixels;
  Image soft;
  soften(flat, .25f, soft);
  EXPECT_EQ(soft.pixels, before);
  const Image noisy = noise(9, 4);
  soften(noisy, 0.f, soft);
  EXPECT_EQ(soft.pixels, noisy.pixels);
}

TEST(Soften, IsTheSameAtAnyNumberOfThreads) {
  const Image image = noise(300, 200);
  Image one, many;
  {
    const ThreadLimit limit(1);
    soften(image, .1f, one);
  }
  soften(image, .1f, many);
  EXPECT_EQ(one.pixels, many.pixels);
}

}  // namespace
}  // namespace forest::frame
