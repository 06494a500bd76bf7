// SPDX-License-Identifier: Apache-2.0
#include "forest/scene/scale_bar.h"

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

TEST(ScaleBar, IsPaintedAtTheBottomLeftOnlyAndNotIntoSmallPictures) {
  frame::Image image;
  image.width = 640, image.height = 360, image.pixels.assign(std::size_t(4) * 640 * 360, 0);
  ASSERT_TRUE(paint_scale(image, at(100.f), Background::dark));
  std::size_t inside = 0, elsewhere = 0;
  for (std::size_t y = 0; y < 360; ++y)
    for (std::size_t x = 0; x < 640; ++x)
      if (image.pixels[4 * (640 * y + x)] != 0) (x < 200 && y > 300 ? inside : elsewhere) += 1;
  EXPECT_GT(inside, 500u);
  EXPECT_EQ(elsewhere, 0u);
  frame::Image small;
  small.width = 64, small.height = 64, small.pixels.assign(std::size_t(4) * 64 * 64, 0);
  EXPECT_FALSE(paint_scale(small, at(100.f), Background::dark));
}

}  // namespace
}  // namespace forest::scene
