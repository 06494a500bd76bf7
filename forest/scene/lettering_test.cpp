// SPDX-License-Identifier: Apache-2.0
#include "forest/scene/lettering.h"

#include <gtest/gtest.h>

namespace forest::scene {
namespace {

frame::Image black(std::uint32_t width, std::uint32_t height) {
  frame::Image image{width, height, std::vector<std::uint8_t>(std::size_t(width) * height * 4, 0), 0.};
  for (std::size_t i = 3; i < image.pixels.size(); i += 4) image.pixels[i] = 255;
  return image;
}
double light(const frame::Image& image) {  // in white pixels
  double sum = 0.;
  for (std::size_t i = 0; i < image.pixels.size(); i += 4) sum += image.pixels[i] / 255.;
  return sum;
}
double written(std::string_view text, float height = 20.f) {
  frame::Image image = black(400, 60);
  Lettering{.height = height}.write(image, text, 20.f, 40.f);
  return light(image);
}

TEST(Lettering, EverySignIsThereAndAnUnknownOneIsABox) {
  for (const char c : std::string_view("0123456789ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz"))
    EXPECT_GT(written(std::string_view(&c, 1)), 15.) << c;
  EXPECT_GT(written("µ"), 15.);
  EXPECT_EQ(written(" "), 0.);
  EXPECT_EQ(written("☃"), written("\xff"));
  EXPECT_GT(written("☃"), 30.);
  EXPECT_EQ(written(""), 0.);
}

TEST(Lettering, HasAllOfAsciiMarksAndGreek) {
  const double box = written("☃");
  const auto known = [&](std::string_view sign) {
    frame::Image one = black(100, 60), other = black(100, 60);
    Lettering{.height = 20.f}.write(one, sign, 20.f, 40.f);
    Lettering{.height = 20.f}.write(other, "☃", 20.f, 40.f);
    return one.pixels != other.pixels && light(one) > 2.;
  };
  for (char c = '!'; c <= '~'; ++c) EXPECT_TRUE(known(std::string_view(&c, 1))) << c;
  for (const char* sign :
       {"ö", "Ö", "é", "ñ", "å", "Å", "ç", "š", "í", "ß", "ø", "α", "β", "γ", "δ", "ω", "Ω", "…", "—"})
    EXPECT_TRUE(known(sign)) << sign;
  EXPECT_GT(written("ö"), written("o") + 2.);
  EXPECT_GT(written("Ö"), written("O") + 2.);
  EXPECT_FLOAT_EQ(Lettering{}.width("ö"), Lettering{}.width("o"));
  EXPECT_GT(box, 30.);
}

TEST(Lettering, InkGrowsWithTheSquareOfTheSizeAndWidthWithTheSize) {
  EXPECT_NEAR(written("mV 123", 24.f) / written("mV 123", 12.f), 4., .5);
  EXPECT_FLOAT_EQ(Lettering{.height = 24.f}.width("mV 123"), 2.f * Lettering{.height = 12.f}.width("mV 123"));
  EXPECT_EQ(Lettering{}.width(""), 0.f);
}

TEST(Lettering, WhatLiesBeyondThePictureIsLeftOut) {
  frame::Image image = black(30, 20);
  const Lettering letters{.height = 12.f};
  for (const Vec2& at : {Vec2(-500, 10), Vec2(500, 10), Vec2(5, -500), Vec2(5, 500), Vec2(1e9f, 1e9f)})
    letters.write(image, "100 mV", at.x(), at.y());
  EXPECT_EQ(light(image), 0.);
  letters.write(image, "100 mV", -10.f, 25.f);
  EXPECT_GT(light(image), 0.);
  fill(image, {-1e9f, -1e9f, 1e9f, 1e9f}, Vec3::Ones());
  EXPECT_EQ(light(image), 600.);
}

TEST(Lettering, ABoxCoversItsAreaToAFractionOfAPixel) {
  frame::Image image = black(30, 20);
  fill(image, {2.25f, 3.5f, 12.5f, 9.f}, Vec3::Ones());
  EXPECT_NEAR(light(image), 10.25 * 5.5, .1);
}

}  // namespace
}  // namespace forest::scene
