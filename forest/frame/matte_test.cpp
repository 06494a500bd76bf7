// SPDX-License-Identifier: Apache-2.0
#include "forest/frame/matte.h"

#include <cmath>

#include <gtest/gtest.h>

#include "forest/core/random.h"

namespace forest::frame {
namespace {

Image one(const Vec3& colour) {
  Image image{1, 1, {0, 0, 0, 255}, 0.};
  for (std::size_t c = 0; c < 3; ++c)
    image.pixels[c] = std::uint8_t(std::lround(255.f * colour[Eigen::Index(c)]));
  return image;
}
// 0–255.
Vec3 over(const Image& image, float ground) {
  const auto& p = image.pixels;
  const float a = float(p[3]) / 255.f;
  return a * Vec3(p[0], p[1], p[2]) + Vec3::Constant(255.f * (1.f - a) * ground);
}
Vec3 pixel(const Image& image) { return Vec3(image.pixels[0], image.pixels[1], image.pixels[2]); }

TEST(Matte, WhatIsTheSameOnBothIsOpaqueAndWhereOnlyGroundIsNothingIs) {
  Random random(1);
  for (int i = 0; i < 100; ++i) {
    const Image colour = one({float(random.uniform()), float(random.uniform()), float(random.uniform())});
    EXPECT_EQ(matted(colour, colour).pixels, colour.pixels);
  }
  const Image nothing = matted(one(Vec3::Zero()), one(Vec3::Ones()));
  EXPECT_EQ(nothing.pixels, (std::vector<std::uint8_t>{0, 0, 0, 0}));
}

TEST(Matte, LaidOverBlackAndWhiteItIsBothPictures) {
  Random random(2);
  for (int i = 0; i < 2000; ++i) {
    const float a = float(random.uniform());
    const Vec3 colour(float(random.uniform()), float(random.uniform()), float(random.uniform()));
    const Image black = one(a * colour), white = one(a * colour + Vec3::Constant(1.f - a));
    const Image image = matted(black, white);
    EXPECT_NEAR(image.pixels[3], 255.f * a, 1.f);
    EXPECT_LT((over(image, 0.f) - pixel(black)).cwiseAbs().maxCoeff(), 1.6f);
    EXPECT_LT((over(image, 1.f) - pixel(white)).cwiseAbs().maxCoeff(), 1.6f);
  }
}

// Light is averaged before it becomes sRGB, so the edge of a coloured branch hides different shares of the ground's colours.
TEST(Matte, WhereColoursHideDifferentSharesTheErrorIsSharedByBothGrounds) {
  Random random(3);
  for (int i = 0; i < 2000; ++i) {
    Vec3 dark, through;
    for (int c = 0; c < 3; ++c)
      dark[c] = .5f * float(random.uniform()), through[c] = .5f * float(random.uniform());
    const Image black = one(dark), white = one(dark + through);
    const Image image = matted(black, white);
    const float wrong = 255.f * (through.array() - through.mean()).abs().maxCoeff();  // of one ground alone
    const Vec3 on_black = over(image, 0.f) - pixel(black), on_white = over(image, 1.f) - pixel(white);
    EXPECT_LT(on_black.cwiseAbs().maxCoeff(), wrong + 1.6f);
    EXPECT_LT(on_white.cwiseAbs().maxCoeff(), wrong + 1.6f);
    EXPECT_LT((on_black - on_white).cwiseAbs().maxCoeff(), wrong + 3.2f);
  }
}

}  // namespace
}  // namespace forest::frame
