// SPDX-License-Identifier: Apache-2.0
#include "forest/scene/scale_bar.h"

#include <algorithm>
#include <cmath>

#include <gtest/gtest.h>

namespace forest::scene {
namespace {

frame::Camera at(float distance, frame::Projection projection = frame::Projection::perspective) {
  return {.eye = Vec3(0.f, 0.f, distance), .projection = projection};
}

float micrometres(const std::string& label) {
  return std::stof(label) * (label.find("mm") != std::string::npos ? 1000.f : 1.f);
}

TEST(ScaleBar, IsAsLongAsItSaysWhereTheCameraLooks) {
  for (const auto projection : {frame::Projection::perspective, frame::Projection::orthographic})
    for (float distance = 1.f; distance < 1e6f; distance *= 1.7f) {
      const frame::Camera camera = at(distance, projection);
      const ScaleBar bar = scale_bar(camera, 720.f, 160.f);
      const Vec3 right = camera.axes().col(0);
      const frame::Viewport viewport{1280.f, 720.f};
      const Vec3 from = frame::project(camera, viewport, camera.target),
                 to = frame::project(camera, viewport, camera.target + micrometres(bar.label) * right);
      EXPECT_NEAR((to - from).head<2>().norm(), bar.length, .01f * bar.length) << bar.label;
      EXPECT_LE(bar.length, 160.1f);
      EXPECT_GT(bar.length, 160.f / 2.6f);
    }
}

TEST(ScaleBar, NamesMicrometresAndMillimetres) {
  EXPECT_EQ(scale_bar(at(100.f), 720.f, 160.f).label, "10 µm");
  EXPECT_EQ(scale_bar(at(1e4f), 720.f, 160.f).label, "1 mm");
}

TEST(ScaleBar, IsPaintedWithinItsBlockAndNotIntoSmallPictures) {
  const frame::Viewport picture{640.f, 360.f};
  frame::Image image{640, 360, std::vector<std::uint8_t>(std::size_t(4) * 640 * 360), 0.};
  const auto block = scale_block(at(100.f), picture, Background::dark);
  ASSERT_TRUE(block);
  for (const Spot spot : {block->usual, Spot::top_right}) {
    std::ranges::fill(image.pixels, std::uint8_t(0));
    const Box box = block->at(spot, picture);
    block->paint(image, box.left, box.top);
    std::size_t inside = 0, elsewhere = 0;
    for (std::size_t y = 0; y < 360; ++y)
      for (std::size_t x = 0; x < 640; ++x)
        if (image.pixels[4 * (640 * y + x)] != 0)
          (float(x) >= box.left && float(x) < box.right && float(y) >= box.top && float(y) < box.bottom
               ? inside
               : elsewhere) += 1;
    EXPECT_GT(inside, 200u);
    EXPECT_EQ(elsewhere, 0u);
  }
  EXPECT_FALSE(scale_block(at(100.f), {64.f, 64.f}, Background::dark));
}

}  // namespace
}  // namespace forest::scene
