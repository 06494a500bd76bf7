// SPDX-License-Identifier: Apache-2.0
#include "forest/scene/colour_bar.h"

#include <algorithm>

#include <gtest/gtest.h>

namespace forest::scene {
namespace {

frame::Image black(std::uint32_t width, std::uint32_t height) {
  return {width, height, std::vector<std::uint8_t>(std::size_t(width) * height * 4, 0), 0.};
}

// At its usual spot, or right of there. Returns whether it has room.
bool paint(frame::Image& image, const auto& what, Background background, bool right = false) {
  const frame::Viewport picture{float(image.width), float(image.height)};
  const auto block = block_of(what, picture, background);
  if (!block) return false;
  const Box box = block->at(right ? Spot::top_right : block->usual, picture);
  block->paint(image, box.left, box.top);
  return true;
}

TEST(ColourBar, ShowsTheMapAndGreyBelowTheThreshold) {
  const ColourMap& map = *find_colour_map("viridis");
  const ColourBar bar{.map = &map, .low = -80.f, .high = 20.f, .threshold = -55.f};
  frame::Image image = black(120, 60);
  paint(image, bar, {10.f, 10.f, 110.f, 20.f}, Lettering{.height = 8.f});
  const auto at = [&](std::size_t x) -> Vec3 {
    const std::uint8_t* p = &image.pixels[4 * (15 * 120 + x)];
    return Vec3(p[0], p[1], p[2]) / 255.f;
  };
  EXPECT_LT((at(12) - screen_of(below_threshold(Background::dark))).norm(), .01f);
  EXPECT_LT((at(109) - map.screen(.995f)).norm(), .02f);
  EXPECT_LT((at(60) - map.screen(.505f)).norm(), .02f);
  image = black(120, 60);  // a bar that begins within a pixel is as bright
  paint(image, bar, {10.4f, 10.f, 110.4f, 20.f}, Lettering{.height = 8.f});
  EXPECT_LT((at(60) - map.screen(.505f)).norm(), .02f);
}

TEST(ColourBar, OfSpikesAloneIsADotOfTheirColourAndNoMapOfValues) {
  for (const Background background : {Background::dark, Background::light}) {
    const ColourBar bar = bar_of_spikes(ActivityView(), 12.5, background);
    EXPECT_EQ(bar.map, nullptr);
    EXPECT_EQ(bar.note, "a spike, then fading, 300 µm/ms");
    frame::Image image = black(640, 480);
    EXPECT_TRUE(paint(image, std::span(&bar, 1), background));
    std::size_t dot = 0;
    for (std::size_t i = 0; i < image.pixels.size(); i += 4) {
      const Vec3 pixel = Vec3(image.pixels[i], image.pixels[i + 1], image.pixels[i + 2]) / 255.f;
      dot += (pixel - bar.marks.front()).norm() < .02f;
    }
    EXPECT_GT(dot, 30u);
    EXPECT_LT(dot, 400u);
  }
}

TEST(ColourBar, BesideValuesSaysWhatFlashesAreWhereThereAreSome) {
  for (const Background background : {Background::dark, Background::light}) {
    ActivityView view;
    view.speed = 250.f;
    const ColourBar bar = bar_of(view, 12.5, "mV", background);
    EXPECT_EQ(bar.note, "a spike, then fading, 250 µm/ms");
    frame::Image image = black(640, 480);
    EXPECT_TRUE(paint(image, std::span(&bar, 1), background));
    for (const Vec3& mark : bar.marks) {
      std::size_t dot = 0;
      for (std::size_t i = 0; i < image.pixels.size(); i += 4)
        dot += (Vec3(image.pixels[i], image.pixels[i + 1], image.pixels[i + 2]) / 255.f - mark).norm() < .02f;
      EXPECT_GT(dot, 30u);
    }
  }
  ActivityView quiet;
  quiet.speed = 0.f;
  const ColourBar none = bar_of(quiet, 12.5, "mV", Background::dark);
  EXPECT_EQ(none.note, "");
  EXPECT_TRUE(none.marks.empty());
}

TEST(ColourBar, NamesOfColoursStandAtEitherSideAndNotWhereTheyDoNotFit) {
  const std::vector<LegendEntry> names{{"pyramidal cell", {{0.f, 1.f, 0.f}}},
                                       {"basket cell", {{1.f, 0.f, 0.f}}}};
  const auto greens = [](const frame::Image& image, std::uint32_t from, std::uint32_t to) {
    std::size_t count = 0;
    for (std::uint32_t y = 0; y < image.height; ++y)
      for (std::uint32_t x = from; x < to; ++x) {
        const std::uint8_t* p = &image.pixels[4 * (std::size_t(y) * image.width + x)];
        count += p[0] == 0 && p[1] == 255 && p[2] == 0;
      }
    return count;
  };
  for (const bool right : {false, true}) {
    frame::Image image = black(640, 360);
    EXPECT_TRUE(paint(image, std::span(names), Background::dark, right));
    EXPECT_GT(greens(image, right ? 320 : 0, right ? 640 : 320), 30u);
    EXPECT_EQ(greens(image, right ? 0 : 320, right ? 320 : 640), 0u);
  }
  frame::Image small = black(80, 45);
  EXPECT_FALSE(paint(small, std::span(names), Background::dark));
  EXPECT_EQ(std::ranges::count(small.pixels, 0), std::ptrdiff_t(small.pixels.size()));
}

TEST(ColourBar, NamesThatHaveNoRoomAreShortenedAndCounted) {
  std::vector<LegendEntry> names;
  for (int i = 0; i < 60; ++i) names.push_back({"type " + std::to_string(i), {{0.f, 1.f, 0.f}}});
  const auto green_rows = [](const frame::Image& image) {
    std::size_t rows = 0;
    for (std::uint32_t y = 0; y < image.height; ++y) {
      bool green = false;
      for (std::uint32_t x = 0; x < image.width; ++x) {
        const std::uint8_t* p = &image.pixels[4 * (std::size_t(y) * image.width + x)];
        green |= p[0] == 0 && p[1] == 255 && p[2] == 0;
      }
      rows += green;
    }
    return rows;
  };
  frame::Image many = black(640, 360), few = black(640, 360);
  EXPECT_TRUE(paint(many, std::span(names), Background::dark));
  EXPECT_TRUE(paint(few, std::span(names).first(5), Background::dark));
  EXPECT_GT(green_rows(many), green_rows(few));
  EXPECT_LT(green_rows(many), .65 * 360);
  names.resize(3);
  names[0].name.assign(500, 'w').append("ö");
  frame::Image wide = black(640, 360);
  EXPECT_TRUE(paint(wide, std::span(names), Background::dark));
  for (std::uint32_t y = 0; y < 360; ++y)  // they end where two thirds of the picture do
    EXPECT_EQ(wide.pixels[4 * (std::size_t(y) * 640 + 430)], 0);
}

TEST(ColourBar, ItsEndsHaveAsManyDigitsAsTellThemApart) {
  const auto painted = [](float low, float high) {
    frame::Image image = black(400, 100);
    paint(image, ColourBar{.low = low, .high = high}, {20.f, 20.f, 380.f, 40.f}, {.height = 12.f});
    return image.pixels;
  };
  EXPECT_NE(painted(2.f, 2.00001f), painted(2.f, 2.00002f));
  EXPECT_NE(painted(2.f, 2.00001f), painted(2.f, 2.f));
}

TEST(ColourBar, IsLeftOutOfPicturesInWhichItCannotBeRead) {
  const ColourBar bars[] = {bar_of(ActivityView(), 12.5, "mV", Background::dark),
                            {.map = &colour_maps().front()}};
  EXPECT_EQ(bars[0].title, "12.5 ms");
  frame::Image small = black(160, 100), large = black(640, 480);
  EXPECT_FALSE(paint(small, std::span(bars), Background::dark));
  EXPECT_EQ(small.pixels, black(160, 100).pixels);
  EXPECT_TRUE(paint(large, std::span(bars), Background::dark));
  EXPECT_NE(large.pixels, black(640, 480).pixels);
  EXPECT_FALSE(paint(large, std::span(bars).first(0), Background::light));
}

}  // namespace
}  // namespace forest::scene
