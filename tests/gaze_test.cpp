// SPDX-License-Identifier: Apache-2.0
// Pictures for a gaze, as the programs draw them.
#include <algorithm>
#include <cmath>

#include <gtest/gtest.h>

#include "forest/render/cpu/cpu_renderer.h"
#include "forest/scene/view.h"

#include "apps/foveated.h"
#include "tests/sample_forest.h"

namespace forest {
namespace {

constexpr std::uint32_t width = 960, height = 540;

struct Drawer {
  scene::Forest forest =
      scene::Forest::from_bytes(scene::pack(testing::sample_circuit(20), testing::sample_neurons()));
  Foveated foveated{forest, [] { return std::make_unique<render::CpuRenderer>(); }};

  frame::Image operator()(const scene::View& view, std::span<const frame::Overlay> lines) {
    const scene::Colouring colouring = scene::colour(forest, view.colour_by, view.background);
    return foveated.draw(view, width, height, colouring, lines, {}, 0, view.samples);
  }
};

// Of each pixel, how much the lines change it: sums over bytes.
std::vector<int> changed(const frame::Image& with, const frame::Image& without) {
  std::vector<int> change;
  for (std::size_t i = 0; i < with.pixels.size(); i += 4) {
    int sum = 0;
    for (std::size_t c = 0; c < 3; ++c) sum += std::abs(with.pixels[i + c] - without.pixels[i + c]);
    change.push_back(sum);
  }
  return change;
}

TEST(Gaze, TheOutlineIsAsThinAndAsBrightAsWithoutOne) {
  Drawer draw;
  for (const frame::Projection projection : {frame::Projection::perspective, frame::Projection::orthographic})
    for (const scene::Background background : {scene::Background::dark, scene::Background::light}) {
      scene::View view = scene::overview(draw.forest);
      view.camera.projection = projection, view.background = background;
      const auto lines = scene::outline(draw.forest);
      const auto plain = changed(draw(view, lines), draw(view, {}));
      view.detail.gaze = Vec2(.1f, .1f);
      const auto gazing = changed(draw(view, lines), draw(view, {}));
      std::size_t plain_pixels = 0, gazing_pixels = 0;
      double plain_sum = 0., gazing_sum = 0.;
      for (std::size_t i = 0; i < plain.size(); ++i) {
        plain_pixels += plain[i] > 12, gazing_pixels += gazing[i] > 12;
        plain_sum += plain[i], gazing_sum += gazing[i];
      }
      ASSERT_GT(plain_pixels, 1000u);
      EXPECT_NEAR(double(gazing_pixels) / double(plain_pixels), 1., .2);
      EXPECT_NEAR(gazing_sum / plain_sum, 1., .25);
    }
}

}  // namespace
}  // namespace forest
